//! Mass properties of what a closed mesh encloses.

use super::shape::SolidError;
use crate::MassProperties;
use glam::{DMat3, DVec3};
use std::collections::HashMap;

/// Volume, centre and inertia at density 1.
///
/// Sums over the tetrahedra from a point to the triangles (a, b, c), with d = det(a b c) and s = a + b + c:
/// volume d/6, first moment d s/24, second moment d (a a' + b b' + c c' + s s')/120 (Tonon, J. Math. Stat.
/// 1, 2005). The point is the mean of the vertices, so that a mesh far from the origin loses nothing.
pub(super) fn unit_density(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
) -> Result<MassProperties, SolidError> {
    check(vertices, triangles)?;
    #[expect(clippy::cast_precision_loss, reason = "a mean of some kind")]
    let count = vertices.len().max(1) as f64;
    let middle = vertices.iter().fold(DVec3::ZERO, |sum, v| sum + *v / count);
    let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    let mut size = 0.0;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|index| vertices[index as usize] - middle);
        let d = a.dot(b.cross(c));
        let s = a + b + c;
        size += d.abs();
        volume += d / 6.0;
        first += s * (d / 24.0);
        second += (outer(a) + outer(b) + outer(c) + outer(s)) * (d / 120.0);
    }
    // Triangles that all face inwards enclose the same.
    if volume < 0.0 {
        (volume, first, second) = (-volume, -first, -second);
    }
    if volume.is_nan() || volume <= 1e-12 * size {
        return Err(SolidError::NoVolume);
    }
    let center = first / volume;
    let central = second - outer(center) * volume;
    let trace = central.x_axis.x + central.y_axis.y + central.z_axis.z;
    Ok(MassProperties {
        mass: volume,
        center: middle + center,
        inertia: DMat3::from_diagonal(DVec3::splat(trace)) - central,
    })
}

/// Checks that every side is run as often forwards as backwards.
fn check(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), SolidError> {
    if let Some(vertex) = vertices.iter().position(|vertex| !vertex.is_finite()) {
        return Err(SolidError::NonFiniteVertex { vertex });
    }
    // Zeros of either sign are one place.
    let place = |index: u32| {
        (vertices[index as usize] + 0.0)
            .to_array()
            .map(f64::to_bits)
    };
    let mut runs: HashMap<_, i64> = HashMap::with_capacity(3 * triangles.len() / 2);
    let sides = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
    for (triangle, corners) in triangles.iter().enumerate() {
        let missing = corners
            .iter()
            .find(|&&vertex| vertex as usize >= vertices.len());
        if let Some(&vertex) = missing {
            return Err(SolidError::UnknownVertex {
                triangle,
                vertex,
                count: vertices.len(),
            });
        }
        for (from, to) in sides(corners) {
            let (from, to) = (place(from), place(to));
            if from < to {
                *runs.entry((from, to)).or_default() += 1;
            } else if to < from {
                *runs.entry((to, from)).or_default() -= 1;
            }
        }
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        for (from, to) in sides(corners) {
            let (a, b) = (place(from), place(to));
            let key = if a < b { (a, b) } else { (b, a) };
            if runs.get(&key).is_some_and(|&left| left != 0) {
                return Err(SolidError::OpenMesh { triangle, from, to });
            }
        }
    }
    Ok(())
}
