//! Which polygons may be divided into a fan of triangles: planar and convex ones, up to rounding.

use glam::{DVec3, Vec3};

use crate::error::PolygonProblem;

/// How far a corner may lie from the plane, as a fraction of the polygon's radius.
///
/// Beyond it the surface depends on how the polygon is divided, so the choice must be the user's.
const RELATIVE_TOLERANCE: f64 = 1e-4;

/// How far rounding may have moved a corner, as a fraction of its largest coordinate: files often have six digits.
const ROUNDING: f64 = 1.0 / 1048576.0;

/// Divides a polygon into triangles, a fan from its first corner, if that is the only way to understand it.
///
/// The corners must be indices of the vertices.
pub(super) fn fan(
    corners: &[u32],
    vertices: &[Vec3],
    triangles: &mut Vec<[u32; 3]>,
) -> Result<(), PolygonProblem> {
    let (&[first, ref rest @ ..], 3..) = (corners, corners.len()) else {
        return Err(PolygonProblem::TooFewVertices);
    };
    if rest.len() > 2 {
        let position = |&i: &u32| vertices[i as usize].as_dvec3();
        check(&corners.iter().map(position).collect::<Vec<_>>())?;
    }
    triangles.extend(rest.windows(2).map(|side| [first, side[0], side[1]]));
    Ok(())
}

/// Checks that a polygon of at least four corners is planar and convex, hence the union of its fan from any corner.
///
/// With c the mean of the corners, r their largest distance from it and m the largest coordinate, corners may be off
/// by the tolerance t = 1e-4 r + 2^-20 m. The plane goes through c with Newell's normal (the sum of the cross products
/// of successive corners, twice the vector area). The polygon is planar if no corner is further than t from the plane,
/// and convex if it turns right at no corner by more than t allows and turns around once in all.
fn check(corners: &[DVec3]) -> Result<(), PolygonProblem> {
    let mut corners = corners.to_vec();
    corners.dedup();
    while corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    let count = corners.len();
    let largest = corners
        .iter()
        .fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
    // Coordinates are f32, so at size 1 nothing below can under- or overflow.
    let scale = if largest > 0.0 { largest.recip() } else { 1.0 };
    for p in &mut corners {
        *p *= scale;
    }
    let center = corners.iter().sum::<DVec3>() / count as f64;
    for p in &mut corners {
        *p -= center;
    }
    let radius = corners.iter().fold(0.0_f64, |r, p| r.max(p.length()));
    let tolerance = RELATIVE_TOLERANCE * radius + ROUNDING;

    let corner = |i: usize| corners[i % count];
    let normal: DVec3 = (0..count).map(|i| corner(i).cross(corner(i + 1))).sum();
    // An area within the tolerance of a line does not say which side is inside.
    if count < 3 || normal.length() <= 2.0 * tolerance * radius {
        return Err(PolygonProblem::ZeroArea);
    }
    let normal = normal.normalize();
    if corners.iter().any(|p| p.dot(normal).abs() > tolerance) {
        return Err(PolygonProblem::NotPlanar);
    }
    let mut turned = 0.0;
    for i in 0..count {
        let (before, here, after) = (corner(i), corner(i + 1), corner(i + 2));
        let (inward, outward) = (here - before, after - here);
        let turn = inward.cross(outward).dot(normal);
        // The corner lies this far inside the line from its predecessor to its successor.
        if turn < -tolerance * (after - before).length() {
            return Err(PolygonProblem::NotConvex);
        }
        turned += turn.atan2(inward.dot(outward));
    }
    if (turned - std::f64::consts::TAU).abs() > std::f64::consts::PI {
        return Err(PolygonProblem::NotConvex);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(count: usize, step: usize) -> Vec<DVec3> {
        (0..count)
            .map(|i| {
                let angle = std::f64::consts::TAU * (i * step) as f64 / count as f64;
                DVec3::new(angle.cos(), angle.sin(), 0.0)
            })
            .collect()
    }

    #[test]
    fn convex_rings_of_any_size_and_place() {
        for count in [4, 5, 12] {
            for (size, offset) in [(1.0, 0.0), (1e-30, 0.0), (1e30, 0.0), (1.0, 1e3)] {
                let corners: Vec<_> = ring(count, 1)
                    .iter()
                    .map(|p| (*p * size + offset).as_vec3().as_dvec3())
                    .collect();
                assert_eq!(check(&corners), Ok(()), "{count} {size} {offset}");
            }
        }
    }

    #[test]
    fn corners_along_an_edge_and_repeated_corners_are_convex() {
        let mut square = vec![
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(2.0, 0.0, 0.0),
            DVec3::new(2.0, 2.0, 0.0),
            DVec3::new(0.0, 2.0, 0.0),
        ];
        assert_eq!(check(&square), Ok(()));
        square.insert(1, DVec3::ZERO);
        square.push(DVec3::ZERO);
        assert_eq!(check(&square), Ok(()));
    }

    #[test]
    fn reflex_corners_stars_and_spirals_are_not() {
        let dart = [
            DVec3::ZERO,
            DVec3::new(2.0, 1.0, 0.0),
            DVec3::new(0.0, 2.0, 0.0),
            DVec3::new(0.5, 1.0, 0.0),
        ];
        assert_eq!(check(&dart), Err(PolygonProblem::NotConvex));
        assert_eq!(check(&ring(5, 2)), Err(PolygonProblem::NotConvex));
        let mut bow = ring(4, 1);
        bow.swap(1, 2);
        bow[0] *= 2.0;
        assert!(check(&bow).is_err());
        // Around twice: every corner turns left, and every triangle of the fan from the inner end does too.
        let mut spiral = ring(6, 1);
        spiral.extend(ring(6, 1).iter().map(|p| *p * 1.5));
        assert_eq!(check(&spiral), Err(PolygonProblem::NotConvex));
    }

    #[test]
    fn bent_and_flat_polygons_are_refused() {
        let mut bent = ring(4, 1);
        bent[0].z = 1e-3;
        assert_eq!(check(&bent), Err(PolygonProblem::NotPlanar));
        bent[0].z = 1e-5;
        assert_eq!(check(&bent), Ok(()));
        let flat = [1.0, 2.0, 4.0, 3.0].map(|s| DVec3::ONE * s);
        assert_eq!(check(&flat), Err(PolygonProblem::ZeroArea));
        assert_eq!(check(&[DVec3::ZERO; 5]), Err(PolygonProblem::ZeroArea));
    }
}
