//! Distances of triangles, with bounds that hold whatever was rounded.

use glam::DVec3;

use crate::construct::to_unit;
use crate::exact;
use crate::predicates::Plane;

/// Bounds on the distance of two triangles \[m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceBounds {
    /// They are at least this far apart; 0 if they meet.
    pub lower: f64,
    /// They are at most this far apart; 0 if they meet, and only then.
    pub upper: f64,
}

/// What rounding adds to either bound, in units of the largest coordinate seen from the first corner of A.
///
/// With u = 2^-53 and m that coordinate: coordinates are off by u m, sides by 4 u m, a point of a triangle, the sum of
/// a corner and parts of two sides, by less than 16 u m, and the vector between two of them by 36 u m, in each
/// component. A direction's length is off by a few u, and the inner product of a vector of at most 2 m with it by as
/// much. The length of such an error is below 36 sqrt(3) u m < 64 u m.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

impl DistanceBounds {
    const ZERO: Self = Self {
        lower: 0.0,
        upper: 0.0,
    };

    /// Bounds on the distance of two closed triangles. Whether they meet is exact, for points for which
    /// [`triangles_intersect`](exact::triangles_intersect) is.
    ///
    /// The bounds are some units in the last place of the triangles' size apart, unless the triangles are far closer to
    /// each other than they are long, or so thin that their planes are lost in rounding.
    ///
    /// ```
    /// use glam::DVec3;
    /// use vertebra_collision::DistanceBounds;
    ///
    /// let a = [DVec3::ZERO, DVec3::X, DVec3::Y];
    /// let b = a.map(|p| p + DVec3::Z * 0.25);
    /// let distance = DistanceBounds::of(&a, &b);
    /// assert!(distance.lower <= 0.25 && 0.25 <= distance.upper);
    /// assert!(distance.upper - distance.lower < 1e-13);
    /// ```
    #[must_use]
    pub fn of(a: &[DVec3; 3], b: &[DVec3; 3]) -> Self {
        if exact::decide(a, b, &Plane::through(*b)).meet {
            Self::ZERO
        } else {
            Self::of_disjoint(a, b)
        }
    }

    /// Bounds for triangles that do not meet.
    ///
    /// Two points, one of each triangle, bound the distance from above. The triangles' extents along the direction
    /// between them bound it from below: by the gap between the planes normal to it. For the closest points both are
    /// the distance.
    pub(crate) fn of_disjoint(a: &[DVec3; 3], b: &[DVec3; 3]) -> Self {
        let origin = a[0];
        let (a, b) = (a.map(|p| p - origin), b.map(|p| p - origin));
        let corners = a.iter().chain(&b);
        let size = corners.fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
        // In units of a power of two near the size nothing over- or underflows, and going there and back is exact.
        let unit = to_unit(size);
        let (a, b) = (a.map(|p| p * unit), b.map(|p| p * unit));
        let rounding = ROUNDING * (size * unit);
        let vector = closest(&a, &b);
        let length = vector.length();
        let direction = vector.try_normalize().unwrap_or(DVec3::ZERO);
        let along = |p: &DVec3| p.dot(direction);
        let nearest = b.iter().map(along).fold(f64::INFINITY, f64::min);
        let farthest = a.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
        Self {
            lower: (nearest - farthest - rounding).max(0.0) / unit,
            upper: (length + rounding) / unit,
        }
    }
}

/// The vector from A to B between the closest points found: on two sides, or a corner and the inside of a triangle.
fn closest(a: &[DVec3; 3], b: &[DVec3; 3]) -> DVec3 {
    let sides = |t: &[DVec3; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let between_sides = sides(a)
        .into_iter()
        .flat_map(|p| sides(b).map(|q| between_segments(p, q)));
    let to_b = a.iter().filter_map(|&p| above(p, b).map(|foot| foot - p));
    let to_a = b.iter().filter_map(|&q| above(q, a).map(|foot| q - foot));
    between_sides
        .chain(to_b)
        .chain(to_a)
        .min_by(|left, right| left.length_squared().total_cmp(&right.length_squared()))
        .unwrap_or(b[0] - a[0])
}

/// The vector from the first segment to the second between their closest points (Ericson, Real-Time Collision
/// Detection, 2005, section 5.1.9); either may be a point.
fn between_segments([p, p_end]: [DVec3; 2], [q, q_end]: [DVec3; 2]) -> DVec3 {
    let (d, e, r) = (p_end - p, q_end - q, p - q);
    let (dd, ee, de, dr, er) = (d.dot(d), e.dot(e), d.dot(e), d.dot(r), e.dot(r));
    let clamp = |numerator: f64, denominator: f64| {
        if denominator > 0.0 {
            (numerator / denominator).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    let mut s = clamp(de * er - dr * ee, dd * ee - de * de);
    let t = clamp(de * s + er, ee);
    // The best s for that t: if t was cut off, and against cancellation between nearly parallel segments.
    s = clamp(de * t - dr, dd);
    (q + e * t) - (p + d * s)
}

/// The foot of the perpendicular from a point to a triangle's plane, if inside.
fn above(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<DVec3> {
    let (u, v, w) = (b - a, c - a, p - a);
    let normal = u.cross(v);
    let square = normal.length_squared();
    if square <= 0.0 {
        return None;
    }
    let (s, t) = (
        w.cross(v).dot(normal) / square,
        u.cross(w).dot(normal) / square,
    );
    // Sums of parts of the sides, so that the foot is in the triangle however the normal was rounded.
    (s >= 0.0 && t >= 0.0 && s + t <= 1.0).then(|| a + u * s + v * t)
}
