//! The inside of closed meshes against what their construction says.

use crate::support::{Random, cuboid, exploded, gold_mesh};
use glam::{DQuat, DVec3, IVec3, Vec3};
use vertebra_collision::{
    Collider, Location, Query, QueryError, RelativePose, Solid, TriangleMesh,
};
use vertebra_spatial::Pose;

const SIZE: i32 = 4;

/// Some cells of a grid, as the faces between filled and empty ones.
struct Cells(Vec<IVec3>);

impl Cells {
    fn random(random: &mut Random) -> Self {
        let all = (0..SIZE.pow(3)).map(|i| IVec3::new(i % SIZE, i / SIZE % SIZE, i / SIZE.pow(2)));
        Self(all.filter(|_| random.int(0, 1) == 1).collect())
    }

    /// The surface, mapped; triangles in no particular orientation.
    fn mesh(&self, map: impl Fn(Vec3) -> Vec3) -> TriangleMesh {
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        for cell in &self.0 {
            for side in [IVec3::X, IVec3::Y, IVec3::Z] {
                for (step, from) in [(side, side), (-side, IVec3::ZERO)] {
                    if self.0.contains(&(cell + step)) {
                        continue;
                    }
                    let first = vertices.len() as u32;
                    let (u, v) = (
                        IVec3::new(side.z, side.x, side.y),
                        IVec3::new(side.y, side.z, side.x),
                    );
                    for corner in [IVec3::ZERO, u, u + v, v] {
                        vertices.push(map((cell + from + corner).as_vec3()));
                    }
                    triangles.push([first, first + 1, first + 2]);
                    triangles.push([first, first + 2, first + 3]);
                }
            }
        }
        TriangleMesh::new(vertices, triangles).unwrap()
    }

    /// By the cells around a point of half-integers: cells may meet in edges and corners only.
    fn locate(&self, twice: IVec3) -> Location {
        let around = |k: usize| match twice[k].rem_euclid(2) {
            1 => [twice[k].div_euclid(2); 2],
            _ => [twice[k] / 2 - 1, twice[k] / 2],
        };
        let filled = (0..8).filter(|i| {
            let pick = |k: usize| around(k)[i >> k & 1];
            self.0.contains(&IVec3::new(pick(0), pick(1), pick(2)))
        });
        match filled.count() {
            0 => Location::Outside,
            8 => Location::Inside,
            _ => Location::OnSurface,
        }
    }
}

/// Cells, straight and oblique, at all points that make rays pass through edges and vertices.
#[test]
fn cells_at_half_integers() {
    let mut random = Random::new(61);
    let oblique = |p: Vec3| Vec3::new(p.x + 2.0 * p.y - p.z, p.y - p.x, p.z + 3.0 * p.x);
    let maps: [&dyn Fn(Vec3) -> Vec3; 3] = [&|p| p, &oblique, &|p| Vec3::new(p.z, p.x, p.y) * -1.0];
    let mut seen = [0; 3];
    for map in maps {
        for _ in 0..4 {
            let cells = Cells::random(&mut random);
            let mesh = cells.mesh(map);
            let solid = Solid::new(&mesh).unwrap();
            for i in 0..(2 * SIZE + 3).pow(3) {
                let n = 2 * SIZE + 3;
                let twice = IVec3::new(i % n, i / n % n, i / (n * n)) - 1;
                let point = map(twice.as_vec3() / 2.0).as_dvec3();
                let expected = cells.locate(twice);
                assert_eq!(solid.locate(point).unwrap(), expected, "{point}");
                seen[expected as usize] += 1;
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 500), "{seen:?}");
}

/// An ulp makes the difference; and points at the ends of the range are outside.
#[test]
fn next_to_the_surface() {
    let cube = cuboid(Vec3::splat(-1.0), Vec3::ONE);
    let collider = Collider::new(exploded(&cube));
    let solid = Solid::new(&collider).unwrap();
    let locate = |p: DVec3| solid.locate(p).unwrap();
    for k in 0..3 {
        for sign in [-1.0, 1.0] {
            let at = |x: f64| {
                let mut p = DVec3::new(0.0, 0.3, 0.0);
                p[k] = sign * x;
                p
            };
            assert_eq!(locate(at(1.0)), Location::OnSurface);
            assert_eq!(locate(at(1.0_f64.next_down())), Location::Inside);
            assert_eq!(locate(at(1.0_f64.next_up())), Location::Outside);
            for far in [1e30, 1e39, 1e100, f64::MAX] {
                assert_eq!(locate(at(far)), Location::Outside);
            }
        }
    }
    assert_eq!(locate(DVec3::new(1e-300, -5e-324, 0.0)), Location::Inside);
    for bad in [f64::NAN, f64::INFINITY] {
        let error = solid.locate(DVec3::new(0.0, bad, 0.0)).unwrap_err();
        assert!(
            matches!(error, QueryError::NonFinitePoint { .. }),
            "{error}"
        );
    }
}

/// What is inside stays inside under turns; the mean of a gold mesh's vertices is.
#[test]
fn meshes_in_meshes() {
    let big = cuboid(Vec3::splat(-4.0), Vec3::splat(4.0));
    let solid = Solid::new(&big).unwrap();
    let small = cuboid(Vec3::splat(-1.0), Vec3::ONE);
    let contains = |pose: Pose| {
        let relative = RelativePose::between(&Pose::IDENTITY, &pose).unwrap();
        solid.contains(&small, &relative).unwrap()
    };
    let turn = DQuat::from_xyzw(0.3, -0.2, 0.6, 0.5).normalize();
    for (shift, turned, expected) in [
        (0.0, true, true),
        (2.9, false, true),
        (3.0_f64.next_down(), false, true),
        (3.0, false, false),
        (3.5, false, false),
        (2.0, true, true),
        (9.0, true, false),
    ] {
        let rotation = if turned { turn } else { DQuat::IDENTITY };
        assert_eq!(
            contains(Pose::new(rotation, DVec3::Y * shift)),
            expected,
            "{shift}"
        );
    }
    // Two parts, one of them outside; and the part that has no vertex of the first triangle.
    let mut vertices = small.vertices().to_vec();
    vertices.extend(small.vertices().iter().map(|&v| v + 10.0));
    let shifted = small.triangles().iter().map(|t| t.map(|i| i + 8));
    let triangles = small.triangles().iter().copied().chain(shifted).collect();
    let two = TriangleMesh::new(vertices, triangles).unwrap();
    assert!(!Query::new(&big, &two).any().unwrap());
    assert!(!solid.contains(&two, &RelativePose::IDENTITY).unwrap());
    assert!(
        !Solid::new(&small)
            .unwrap()
            .contains(&big, &RelativePose::IDENTITY)
            .unwrap()
    );
    // Gold meshes are closed where they should be.
    for name in ["sphere", "cylinder"] {
        let mesh = gold_mesh(name);
        let mean = mesh.vertices().iter().map(|v| v.as_dvec3()).sum::<DVec3>();
        let solid = Solid::new(&mesh).unwrap();
        let mean = mean / mesh.vertices().len() as f64;
        assert_eq!(solid.locate(mean).unwrap(), Location::Inside);
    }
}

#[test]
fn open_meshes_are_named() {
    let cube = cuboid(Vec3::ZERO, Vec3::ONE);
    let mut triangles = cube.triangles().to_vec();
    let [a, b, c] = triangles.remove(5);
    let open = TriangleMesh::new(cube.vertices().to_vec(), triangles).unwrap();
    for mesh in [&open, &exploded(&open)] {
        let Err(QueryError::NotClosed { triangle, side }) = Solid::new(mesh).map(|_| ()) else {
            panic!("accepted")
        };
        let corners = mesh.triangles()[triangle as usize];
        assert!(side.iter().all(|end| corners.contains(end)));
        let position = |i: u32| mesh.vertices()[i as usize];
        let lost = [a, b, c].map(|i| cube.vertices()[i as usize]);
        assert!(side.iter().all(|&end| lost.contains(&position(end))));
    }
    // A fin on a closed mesh is one too; a triangle of zero area in a seam is not.
    let mut fin = cube.triangles().to_vec();
    fin.push([0, 3, 6]);
    let fin = TriangleMesh::new(cube.vertices().to_vec(), fin).unwrap();
    let error = Solid::new(&fin).map(|_| ()).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("the mesh is not closed: the side from vertex")
    );
    let mut seam = cube.triangles().to_vec();
    seam.push([0, 3, 3]);
    let seam = TriangleMesh::new(cube.vertices().to_vec(), seam).unwrap();
    assert!(Solid::new(&seam).is_ok());
}

/// Many points at once are one by one, in order, on any number of threads.
#[test]
fn many_points() {
    let mesh = gold_mesh("sphere");
    let mut random = Random::new(95);
    let size = f64::from(mesh.vertices()[0].length());
    let mut points: Vec<DVec3> = (0..500).map(|_| random.point().as_dvec3() * size).collect();
    points.push(mesh.vertices()[7].as_dvec3());
    let solid = Solid::new(&mesh).unwrap();
    let expected: Vec<Location> = points.iter().map(|&p| solid.locate(p).unwrap()).collect();
    for location in [Location::Inside, Location::OnSurface, Location::Outside] {
        assert!(expected.contains(&location), "{location:?}");
    }
    for threads in [1, 2, 0] {
        let solid = Solid::new(&mesh).unwrap().threads(threads);
        assert_eq!(solid.locate_all(&points).unwrap(), expected);
        let mut broken = points.clone();
        (broken[20].y, broken[400].y) = (f64::INFINITY, f64::NEG_INFINITY);
        let point = broken[20].to_array();
        let error = solid.locate_all(&broken).unwrap_err();
        assert_eq!(error, QueryError::NonFinitePoint { point });
    }
}
