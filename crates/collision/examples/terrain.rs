//! What the queries take on a large mesh: a terrain of a million triangles (or as many as the first argument says, ten
//! million take 2 GB) that is cut by a plane, prepared once.
//!
//! ```sh
//! cargo run --release -p vertebra-collision --example terrain -- 10000000
//! ```

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

use std::error::Error;
use std::time::Instant;

use glam::{DVec3, Vec3};
use vertebra_collision::{Collider, MeshError, Query, SelfQuery, Solid, TriangleMesh};
use vertebra_spatial::Pose;

/// A closed block with hills on top, of `12 n²` triangles: the top has a sixth.
fn block(n: u32) -> Result<TriangleMesh, MeshError> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // Flat at the edges, where the sides begin.
    let edge = |x: f32| 1.0 - x * x;
    let hill = |x: f32, y: f32| 0.1 * edge(x) * edge(y) * (7.0 * x).sin() * (23.0 * (x + y)).sin();
    for (axis, far) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let first = vertices.len();
        let coordinate = |i: u32| 2.0 * (i as f32 / n as f32) - 1.0;
        for i in 0..=n {
            for j in 0..=n {
                let mut p = Vec3::ZERO;
                p[axis] = if far { 1.0 } else { -1.0 };
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (coordinate(i), coordinate(j));
                if p.z == 1.0 {
                    p.z += hill(p.x, p.y);
                }
                vertices.push(p);
            }
        }
        let first = u32::try_from(first).map_err(|_| MeshError::Empty)?;
        for i in 0..n {
            for j in 0..n {
                let a = first + i * (n + 1) + j;
                let [b, c, d] = [a + 1, a + n + 1, a + n + 2];
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }
    TriangleMesh::new(vertices, triangles)
}

/// Does something and says how long it took.
fn timed<T>(what: &str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    println!("{what:<44} {:>9.2} ms", start.elapsed().as_secs_f64() * 1e3);
    result
}

fn main() -> Result<(), Box<dyn Error>> {
    let wanted: f64 = match std::env::args().nth(1) {
        Some(count) => count.parse()?,
        None => 1e6,
    };
    #[expect(clippy::cast_possible_truncation, reason = "a number of rows")]
    let mesh = block((wanted / 12.0).sqrt().ceil() as u32)?;
    println!("{} triangles", mesh.len());
    let block = timed("hierarchy", || Collider::on_threads(mesh, 0));
    let corners = [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]];
    let plane = corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
    let plane = Collider::new(TriangleMesh::new(plane, vec![[0, 1, 2]])?);
    let cut = Query::new(&block, &plane).pose_b(Pose::from_translation(DVec3::Z * 1.01))?;
    let cut = cut.threads(0);
    println!(
        "any:    {}",
        timed("whether the plane meets it", || cut.any())?
    );
    println!(
        "count:  {}",
        timed("how many triangles it meets", || cut.count())?
    );
    let curves = timed("the curves in which it does", || cut.curves())?;
    println!(
        "curves: {} of {} points",
        curves.curves().len(),
        curves.points().len()
    );
    let near = timed("triangles within 0.001", || cut.within(1e-3))?;
    println!("within: {}", near.len());
    let itself = SelfQuery::new(&block).threads(0);
    println!(
        "itself: {}",
        timed("triangles that meet others of the block", || itself.count())
    );
    let solid = timed("whether it is closed", || Solid::new(&block))?;
    let points: Vec<DVec3> = (0..1000)
        .map(|i| DVec3::splat(0.002 * f64::from(i) - 1.0))
        .collect();
    let inside = timed("a thousand points", || {
        points
            .iter()
            .map(|&p| solid.locate(p))
            .collect::<Result<Vec<_>, _>>()
    })?;
    println!("located: {:?} ... {:?}", inside[0], inside[999]);
    Ok(())
}
