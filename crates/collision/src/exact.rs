//! The exact test of one pair of triangles.
//!
//! Fifteen orientation signs decide a pair of proper triangles in different planes: on which side of each triangle's
//! plane the other's vertices lie (6), and how each edge of one passes each edge of the other (9). All are signs of
//! polynomials of degree three, so exact signs (`predicates.rs`) make an exact test; Guigue & Devillers (Fast and
//! robust triangle-triangle overlap test using orientation predicates, Journal of Graphics Tools 8(1), 2003) decide
//! by the same kind of signs through a tree of permutations. Here nothing depends on the order of the vertices or of
//! the triangles.

use glam::DVec3;

use crate::degenerate::{Segment, segments_meet};
use crate::predicates::{Axis, Sign, orient2d, orient3d, strictly_one_side};

/// Whether two closed triangles share a point.
///
/// The answer is that of rational arithmetic on the given points, provided every coordinate is zero or of a magnitude
/// in [2^-250, 2^331); every `f32` converted to `f64` is. A triangle of zero area counts as the segment or the point
/// that its vertices span. Coordinates must be finite; with others the answer has no meaning.
///
/// ```
/// use glam::DVec3;
/// use vertebra_collision::exact::triangles_intersect;
///
/// let a = [DVec3::ZERO, DVec3::X, DVec3::Y];
/// // An edge of b grazes the corner (1, 0, 0) of a ...
/// let b = [DVec3::new(1.0, 0.0, -1.0), DVec3::new(1.0, 0.0, 1.0), DVec3::new(2.0, 0.0, 0.0)];
/// assert!(triangles_intersect(&a, &b));
/// // ... and one ulp away it does not.
/// let away = b.map(|p| p + DVec3::X * f64::EPSILON);
/// assert!(!triangles_intersect(&a, &away));
/// ```
#[must_use]
pub fn triangles_intersect(a: &[DVec3; 3], b: &[DVec3; 3]) -> bool {
    let a_sides = sides(b, a);
    if strictly_one_side(a_sides) {
        return false;
    }
    let b_sides = sides(a, b);
    if strictly_one_side(b_sides) {
        return false;
    }
    // A triangle of zero area has no plane: every point gets the sign zero against it. So unless some sign differs
    // from zero both ways, the triangles share a plane or one of them has zero area.
    let in_plane = [Sign::Zero; 3];
    if a_sides == in_plane || b_sides == in_plane {
        return coplanar_or_degenerate_meet(a, b);
    }
    // The intersection, if any, is a segment or point of the line where the planes meet, and each of its ends lies on
    // an edge of one triangle and in the other triangle.
    let passes: [[Sign; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|j| orient3d(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]))
    });
    (0..3).any(|i| {
        let next = (i + 1) % 3;
        edge_meets([a_sides[i], a_sides[next]], passes[i], || {
            in_plane_segment_meets(a[i], a[next], b)
        })
    }) || (0..3).any(|j| {
        let next = (j + 1) % 3;
        edge_meets(
            [b_sides[j], b_sides[next]],
            passes.map(|row| row[j]),
            || in_plane_segment_meets(b[j], b[next], a),
        )
    })
}

/// Sides of the three points against the plane of the triangle.
fn sides(triangle: &[DVec3; 3], points: &[DVec3; 3]) -> [Sign; 3] {
    points.map(|p| orient3d(triangle[0], triangle[1], triangle[2], p))
}

/// Whether a segment meets a triangle, from the sides of its ends and from how its line passes the three edges.
///
/// A line that crosses the plane does so within the triangle iff it does not pass the edges on both sides strictly. A
/// line within the plane passes every edge with the sign zero, whether it meets the triangle or not: then the test in
/// the plane decides.
fn edge_meets(ends: [Sign; 2], passes: [Sign; 3], in_plane: impl FnOnce() -> bool) -> bool {
    if strictly_one_side(ends) {
        return false;
    }
    if ends == [Sign::Zero; 2] {
        return in_plane();
    }
    !(passes.contains(&Sign::Positive) && passes.contains(&Sign::Negative))
}

/// Whether a segment, possibly a point, meets a proper triangle.
fn segment_meets(segment: Segment, triangle: &[DVec3; 3]) -> bool {
    let Segment { start, end } = segment;
    let [a, b, c] = *triangle;
    let ends = [orient3d(a, b, c, start), orient3d(a, b, c, end)];
    let passes = [(a, b), (b, c), (c, a)].map(|(u, v)| orient3d(start, end, u, v));
    edge_meets(ends, passes, || {
        in_plane_segment_meets(start, end, triangle)
    })
}

/// Whether a segment, possibly a point, in the plane of a triangle meets it; never if the triangle has zero area.
///
/// Two convex polygons of a plane are disjoint iff an edge of their Minkowski difference separates it from the origin;
/// its edges are parallel to theirs. For a segment and a triangle that leaves the outer sides of the triangle's edges
/// and both sides of the segment.
fn in_plane_segment_meets(start: DVec3, end: DVec3, triangle: &[DVec3; 3]) -> bool {
    let Some(axis) = Axis::of_plane(triangle) else {
        return false;
    };
    let [start, end] = [start, end].map(|p| axis.project(p));
    let corners = triangle.map(|p| axis.project(p));
    let outside = orient2d(corners[0], corners[1], corners[2]).opposite();
    let beyond_an_edge = (0..3).any(|i| {
        let (u, v) = (corners[i], corners[(i + 1) % 3]);
        orient2d(u, v, start) == outside && orient2d(u, v, end) == outside
    });
    !beyond_an_edge && !strictly_one_side(corners.map(|corner| orient2d(start, end, corner)))
}

fn coplanar_or_degenerate_meet(a: &[DVec3; 3], b: &[DVec3; 3]) -> bool {
    match (Axis::of_plane(a), Axis::of_plane(b)) {
        (Some(axis), Some(_)) => !beyond_an_edge(axis, a, b) && !beyond_an_edge(axis, b, a),
        (Some(_), None) => segment_meets(Segment::spanned_by(b), a),
        (None, Some(_)) => segment_meets(Segment::spanned_by(a), b),
        (None, None) => segments_meet(Segment::spanned_by(a), Segment::spanned_by(b)),
    }
}

/// Whether `points` lie strictly beyond one edge of a coplanar triangle, whose plane projects one to one along `axis`.
fn beyond_an_edge(axis: Axis, triangle: &[DVec3; 3], points: &[DVec3; 3]) -> bool {
    let corners = triangle.map(|p| axis.project(p));
    let points = points.map(|p| axis.project(p));
    let outside = orient2d(corners[0], corners[1], corners[2]).opposite();
    (0..3).any(|i| {
        let (u, v) = (corners[i], corners[(i + 1) % 3]);
        points.map(|p| orient2d(u, v, p)) == [outside; 3]
    })
}
