//! The interval test of Möller in single precision: the baseline to compare with, not a test to rely on.
//!
//! Source: T. Möller, A fast triangle-triangle intersection test, Journal of Graphics Tools 2(2), 1997. Each triangle
//! is held against the plane of the other; if neither lies on one side, both cut the line where the planes meet in an
//! interval, and the triangles meet iff the intervals overlap. Coplanar triangles are compared in two dimensions.
//!
//! Where it errs, whatever the care of the implementation:
//! * A vertex counts as in the plane when |N·U + d| < epsilon, with N the unnormalised normal: epsilon is compared with
//!   twice the area times the distance, so the answer depends on the unit of length. Triangles of 1 mm given in
//!   metres are "coplanar" with everything within a metre.
//! * N·U + d cancels far from the origin: the distance is wrong by about 2^-22 of the offset.
//! * Signs are compared through products, which underflow for small triangles and overflow for large ones; with an
//!   overflow the comparisons of NaN fall through to "they meet".
//! * The coplanar branch takes the axis of the largest component of the normal and is wrong for triangles of zero
//!   area, which have none.

use glam::{Vec2, Vec3};

/// Tolerance of the source, in units of twice an area times a distance \[m³].
pub const DEFAULT_EPSILON: f32 = 1e-6;

/// A triangle with its plane N·x + d = 0.
#[derive(Clone, Copy, Debug)]
pub struct PlanedTriangle {
    /// Corners \[m].
    pub corners: [Vec3; 3],
    /// Normal N, as long as twice the area \[m²].
    normal: Vec3,
    /// Offset d \[m³].
    offset: f32,
}

impl PlanedTriangle {
    /// Computes the plane of a triangle.
    #[must_use]
    pub fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        Self {
            corners,
            normal,
            offset: -normal.dot(a),
        }
    }

    /// Signed distances of the points to the plane times twice the area, those below epsilon taken as zero \[m³].
    #[inline]
    fn distances(&self, points: &[Vec3; 3], epsilon: f32) -> [f32; 3] {
        let distance = |p: Vec3| {
            let distance = self.normal.dot(p) + self.offset;
            if distance.abs() < epsilon {
                0.0
            } else {
                distance
            }
        };
        [
            distance(points[0]),
            distance(points[1]),
            distance(points[2]),
        ]
    }

    /// Whether the triangles meet, as far as this method can tell.
    #[inline]
    #[must_use]
    pub fn intersects(&self, other: &Self, epsilon: f32) -> bool {
        let distances = other.distances(&self.corners, epsilon);
        if one_side(distances) {
            return false;
        }
        let other_distances = self.distances(&other.corners, epsilon);
        if one_side(other_distances) {
            return false;
        }
        // Positions along the line of intersection may be replaced by the coordinate in which the line runs most.
        let direction = self.normal.cross(other.normal);
        let axis = largest_component(direction);
        let along = |t: &Self| t.corners.map(|p| p[axis]);
        let intervals = (
            interval(along(self), distances),
            interval(along(other), other_distances),
        );
        match intervals {
            (Some([start, end]), Some([other_start, other_end])) => {
                !(end < other_start || other_end < start)
            }
            _ => self.coplanar_meet(other),
        }
    }

    /// The test in two dimensions: an edge crosses an edge, or one triangle contains the other.
    fn coplanar_meet(&self, other: &Self) -> bool {
        let dropped = largest_component(self.normal);
        let project = |t: &Self| {
            t.corners.map(|p| match dropped {
                0 => Vec2::new(p.y, p.z),
                1 => Vec2::new(p.x, p.z),
                _ => Vec2::new(p.x, p.y),
            })
        };
        let (a, b) = (project(self), project(other));
        (0..3)
            .any(|i| (0..3).any(|j| segments_cross([a[i], a[(i + 1) % 3]], [b[j], b[(j + 1) % 3]])))
            || contains(&b, a[0])
            || contains(&a, b[0])
    }
}

#[inline]
fn one_side([d0, d1, d2]: [f32; 3]) -> bool {
    d0 * d1 > 0.0 && d0 * d2 > 0.0
}

fn largest_component(v: Vec3) -> usize {
    let v = v.abs();
    let mut largest = 0;
    for axis in 1..3 {
        if v[axis] > v[largest] {
            largest = axis;
        }
    }
    largest
}

/// Where the triangle cuts the line, from its corners' positions along the line and distances to the other plane;
/// none if all distances are zero.
fn interval(at: [f32; 3], distance: [f32; 3]) -> Option<[f32; 2]> {
    let [d0, d1, d2] = distance;
    // The corner alone on its side; the line cuts the two edges at it.
    let alone = if d0 * d1 > 0.0 {
        2
    } else if d0 * d2 > 0.0 {
        1
    } else if d1 * d2 > 0.0 || d0 != 0.0 {
        0
    } else if d1 != 0.0 {
        1
    } else if d2 != 0.0 {
        2
    } else {
        return None;
    };
    let cut = |other: usize| {
        at[alone] + (at[other] - at[alone]) * distance[alone] / (distance[alone] - distance[other])
    };
    let ends = [cut((alone + 1) % 3), cut((alone + 2) % 3)];
    Some(if ends[0] > ends[1] {
        [ends[1], ends[0]]
    } else {
        ends
    })
}

/// Whether two segments of a plane cross; collinear ones are left to their neighbours.
fn segments_cross([p, q]: [Vec2; 2], [r, s]: [Vec2; 2]) -> bool {
    // p + t (q - p) = r + u (s - r): both t and u, fractions over the same denominator, must lie in [0, 1].
    let along = q - p;
    let across = r - s;
    let between = p - r;
    let denominator = along.perp_dot(across);
    let t = across.perp_dot(between);
    let u = between.perp_dot(along);
    let within = |numerator: f32| {
        (denominator > 0.0 && (0.0..=denominator).contains(&numerator))
            || (denominator < 0.0 && (denominator..=0.0).contains(&numerator))
    };
    within(t) && within(u)
}

/// Whether the point lies strictly inside the triangle.
fn contains(triangle: &[Vec2; 3], point: Vec2) -> bool {
    let [d0, d1, d2]: [f32; 3] = std::array::from_fn(|i| {
        let (u, v) = (triangle[i], triangle[(i + 1) % 3]);
        (v - u).perp_dot(point - u)
    });
    one_side([d0, d1, d2])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meet(a: [Vec3; 3], b: [Vec3; 3]) -> bool {
        PlanedTriangle::new(a).intersects(&PlanedTriangle::new(b), DEFAULT_EPSILON)
    }

    const BASE: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    #[test]
    fn crossing_and_disjoint() {
        let crossing = [
            Vec3::new(0.2, 0.2, -1.0),
            Vec3::new(0.2, 0.2, 1.0),
            Vec3::new(2.0, 2.0, 0.0),
        ];
        assert!(meet(BASE, crossing));
        assert!(meet(crossing, BASE));
        let aside = crossing.map(|p| p + Vec3::X);
        assert!(!meet(BASE, aside));
        let above = BASE.map(|p| p + Vec3::Z * 0.1);
        assert!(!meet(BASE, above));
    }

    #[test]
    fn coplanar_in_every_plane() {
        let shifted = |by: Vec3| BASE.map(|p| p * 0.5 + by);
        let cases = [
            (shifted(Vec3::new(0.1, 0.1, 0.0)), true),
            (shifted(Vec3::new(0.4, 0.4, 0.0)), true),
            (shifted(Vec3::new(0.6, 0.6, 0.0)), false),
        ];
        for (other, expected) in cases {
            for turn in [
                |p: Vec3| p,
                |p: Vec3| Vec3::new(p.y, p.z, p.x),
                |p: Vec3| Vec3::new(p.z, p.x, p.y),
            ] {
                assert_eq!(meet(BASE.map(turn), other.map(turn)), expected);
                assert_eq!(meet(other.map(turn), BASE.map(turn)), expected);
            }
        }
    }

    /// The error that the module's documentation names first: the same two triangles, a tenth of their size apart,
    /// given in metres and in millimetres.
    #[test]
    fn answer_depends_on_the_unit_of_length() {
        let above = BASE.map(|p| p + Vec3::Z * 0.1);
        assert!(!meet(BASE, above));
        let scale = |t: [Vec3; 3]| t.map(|p| p * 1e-3);
        assert!(meet(scale(BASE), scale(above)));
    }
}
