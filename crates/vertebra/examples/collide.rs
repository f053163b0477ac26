//! Two tori like links of a chain: the four questions about their triangles, from cheap to rich, and
//! how the answers change as one moves until the links touch and cut into each other.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

use std::f64::consts::{FRAC_PI_2, TAU};
use vertebra::glam::{DQuat, DVec3, Vec3};
use vertebra::{MeshError, Pose, Query, TriangleMesh};

/// Radius of the ring and of its section \[m\].
const RING: f64 = 1.0;
const SECTION: f64 = 0.3;

/// A torus about z of `2 * around * across` triangles.
fn torus(around: u32, across: u32) -> Result<TriangleMesh, MeshError> {
    let (mut vertices, mut triangles): (Vec<Vec3>, Vec<[u32; 3]>) = Default::default();
    for i in 0..around {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
        for j in 0..across {
            let (up, out) = (TAU * f64::from(j) / f64::from(across)).sin_cos();
            let radius = RING + SECTION * out;
            let point = DVec3::new(radius * cos, radius * sin, SECTION * up);
            vertices.push(point.as_vec3());
            let [next_i, next_j] = [(i + 1) % around, (j + 1) % across];
            let [a, b] = [i * across + j, next_i * across + j];
            let [c, d] = [next_i * across + next_j, i * across + next_j];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriangleMesh::new(vertices, triangles)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (a, b) = (torus(48, 24)?, torus(64, 16)?);
    println!("{} x {} triangles", a.len(), b.len());
    let upright = DQuat::from_rotation_x(FRAC_PI_2);
    for shift in [1.0, 1.2, 1.35, 1.39, 1.4, 1.45, 1.6] {
        // Through A's hole; the links are taut where their inner sides meet, 2 (RING - SECTION).
        let pose_b = Pose::new(upright, DVec3::new(shift, 0.0, 0.0));
        let query = Query::new(&a, &b).pose_b(pose_b)?.threads(0);
        if !query.any()? {
            println!("shifted by {shift:.2} m: the links do not meet");
            continue;
        }
        let (mask_a, mask_b) = query.mask()?;
        let [in_a, in_b] = [mask_a, mask_b].map(|mask| mask.iter().filter(|hit| **hit).count());
        println!(
            "shifted by {shift:.2} m: {} pairs meet, {in_a} triangles of A and {in_b} of B; the first are {:?}",
            query.count()?,
            query.pairs()?.first().copied().unwrap_or_default(),
        );
    }
    Ok(())
}
