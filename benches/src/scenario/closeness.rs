//! How far apart triangles are, and what is inside a mesh, in `f64` without hierarchies, exact tests or bounds: the
//! judges of [`super::queries`].

use super::reference;
use std::f64::consts::PI;
use vertebra::TriangleMesh;
use vertebra::collision::RelativePose;
use vertebra::glam::DVec3;

/// Rounding of a distance, in units of the largest coordinate.
pub const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// All pairs no further apart than a distance \[m], in lexicographic order, and how far.
#[must_use]
pub fn within(
    a: &TriangleMesh,
    b: &TriangleMesh,
    pose: &RelativePose,
    distance: f64,
) -> Vec<([u32; 2], f64)> {
    let mut close = Vec::new();
    reference::sweep(a, b, pose, distance, |pair, a, b| {
        let apart = triangle_distance(a, b);
        if apart <= distance {
            close.push((pair, apart));
        }
    });
    close.sort_unstable_by_key(|(pair, _)| *pair);
    close
}

/// The distance of two triangles \[m]: 0 if they meet, else that of two edges, or of a corner and the triangle it is
/// above.
#[must_use]
pub fn triangle_distance(a: &[DVec3; 3], b: &[DVec3; 3]) -> f64 {
    if reference::meet(a, b) {
        return 0.0;
    }
    let edges = |t: &[DVec3; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let mut least = f64::INFINITY;
    for one in edges(a) {
        for other in edges(b) {
            least = least.min(segment_distance(one, other));
        }
    }
    for (corners, triangle) in [(a, b), (b, a)] {
        for corner in corners {
            least = least.min(height_above(*corner, triangle));
        }
    }
    least
}

/// Height of a point above a triangle; infinite beside it.
fn height_above(point: DVec3, triangle: &[DVec3; 3]) -> f64 {
    let [a, b, c] = *triangle;
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(u, v)| (*v - *u).cross(point - *u).dot(normal) >= 0.0);
    if inside && normal != DVec3::ZERO {
        ((point - a).dot(normal) / normal.length()).abs()
    } else {
        f64::INFINITY
    }
}

/// The distance of two segments: that of the lines' closest points if both are on the segments, else of an end and the
/// other segment.
fn segment_distance([p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> f64 {
    let (d, e, w) = (q - p, s - r, p - r);
    let (dd, de, ee, dw, ew) = (d.dot(d), d.dot(e), e.dot(e), d.dot(w), e.dot(w));
    let determinant = dd * ee - de * de;
    let (on_d, on_e) = (
        (de * ew - ee * dw) / determinant,
        (dd * ew - de * dw) / determinant,
    );
    let mut least = [(p, [r, s]), (q, [r, s]), (r, [p, q]), (s, [p, q])]
        .map(|(point, segment)| point_distance(point, segment))
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    // Of parallel segments an end is closest.
    if (0.0..=1.0).contains(&on_d) && (0.0..=1.0).contains(&on_e) {
        least = least.min((w + d * on_d - e * on_e).length());
    }
    least
}

fn point_distance(point: DVec3, [u, v]: [DVec3; 2]) -> f64 {
    let along = v - u;
    let length = along.length_squared();
    let share = if length > 0.0 {
        ((point - u).dot(along) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (point - u - along * share).length()
}

/// How many times an oriented closed mesh winds around a point \[1], from the solid angles of its triangles (A. van
/// Oosterom, J. Strackee, "The solid angle of a plane triangle", IEEE Transactions on Biomedical Engineering 30(2),
/// 1983): 1 or -1 inside, 0 outside.
#[must_use]
pub fn winding(mesh: &TriangleMesh, point: DVec3) -> f64 {
    let angle = |index: usize| {
        let [a, b, c] = mesh.triangle(index).map(|v| v.as_dvec3() - point);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * libm::atan2(a.dot(b.cross(c)), below)
    };
    (0..mesh.len()).map(angle).sum::<f64>() / (4.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::tableware;
    use vertebra::{DistanceBounds, Random};

    #[test]
    fn distances_lie_between_their_bounds() {
        let mut random = Random::new(6);
        let mut apart = 0;
        for _ in 0..2000 {
            let mut corner =
                || DVec3::new(random.symmetric(), random.symmetric(), random.symmetric());
            let [a, b] = [(); 2].map(|()| [(); 3].map(|()| corner()));
            let (distance, bounds) = (triangle_distance(&a, &b), DistanceBounds::of(&a, &b));
            apart += usize::from(distance > 0.0);
            let slack = ROUNDING * 2.0;
            assert!(
                bounds.lower - slack <= distance && distance <= bounds.upper + slack,
                "{distance} {bounds:?}"
            );
        }
        assert!(apart > 500, "{apart}");
    }

    #[test]
    fn a_sphere_winds_around_its_inside_once() {
        let sphere = tableware::sphere().unwrap();
        for (x, expected) in [(0.0, 1.0), (0.9, 1.0), (1.1, 0.0), (40.0, 0.0)] {
            let found = winding(&sphere, DVec3::new(0.3 * x, 0.2 * x, 0.93 * x)).abs();
            assert!((found - expected).abs() < 1e-12, "{found} at {x}");
        }
    }
}
