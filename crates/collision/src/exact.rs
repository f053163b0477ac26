//! The exact test of one pair of triangles.
//!
//! Orientation signs decide: on which side of each triangle's plane the other's vertices lie (6), and, on the line
//! where the planes meet, how the ends of the two triangles' parts of it are ordered (at most 4). All are signs of
//! polynomials of degree three, so exact signs (`predicates.rs`) make an exact test. Guigue & Devillers (Fast and
//! robust triangle-triangle overlap test using orientation predicates, Journal of Graphics Tools 8(1), 2003) order the
//! ends by two such signs after permuting the vertices through a tree of cases; four need no permutation, and give the
//! class of the intersection as well.

use glam::DVec3;

use crate::degenerate::{Segment, segments_meet};
use crate::predicates::{
    Axis, Plane, Sign, orient2d, orient3d, strictly_both_sides, strictly_one_side,
};

/// Whether two closed triangles share a point.
///
/// The answer is that of rational arithmetic on the given points, provided every coordinate is zero or of a magnitude
/// in [2^-250, 2^331), or else zero or in [2^-401, 2^131); every `f32` converted to `f64` is, and every vertex posed by
/// a [`RelativePose`](crate::RelativePose). A triangle of zero area counts as the segment or the point that its
/// vertices span. Coordinates must be finite; with others the answer has no meaning.
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
    decide(a, b, &Plane::through(*b)).meet
}

/// What decided a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// A lies strictly on one side of B's plane.
    PlaneOfB,
    /// B lies strictly on one side of A's plane.
    PlaneOfA,
    /// The order on the line where the planes meet.
    Line,
    /// Two dimensions: the triangles share a plane, or one has zero area.
    Degenerate,
}

/// The answer for a pair, and what it took.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decision {
    pub(crate) meet: bool,
    pub(crate) stage: Stage,
    /// Orientation signs that the filter left to expansions.
    pub(crate) exact_signs: u32,
}

/// Decides a pair, given the plane of B.
#[inline]
pub(crate) fn decide(a: &[DVec3; 3], b: &[DVec3; 3], plane_b: &Plane) -> Decision {
    let mut exact_signs = 0;
    let (meet, stage) = decide_staged(a, b, plane_b, &mut exact_signs);
    Decision {
        meet,
        stage,
        exact_signs,
    }
}

#[inline]
fn decide_staged(
    a: &[DVec3; 3],
    b: &[DVec3; 3],
    plane_b: &Plane,
    exact: &mut u32,
) -> (bool, Stage) {
    let a_sides = plane_b.sides(*a, exact);
    if strictly_one_side(a_sides) {
        return (false, Stage::PlaneOfB);
    }
    let b_sides = Plane::through(*a).sides(*b, exact);
    if strictly_one_side(b_sides) {
        return (false, Stage::PlaneOfA);
    }
    // A triangle of zero area has no plane: every point gets the sign zero against it. So unless some sign differs
    // from zero both ways, the triangles share a plane or one of them has zero area.
    match (Spokes::of(a_sides), Spokes::of(b_sides)) {
        (Some(a_spokes), Some(b_spokes)) => {
            let Spokes { hub, ends } = a_spokes;
            let first = order_on_line((a, hub, ends[0]), (b, b_spokes), exact);
            let meet = !strictly_one_side(first) || {
                let second = order_on_line((a, hub, ends[1]), (b, b_spokes), exact);
                !strictly_one_side([first[0], second[0], second[1]])
            };
            (meet, Stage::Line)
        }
        _ => (coplanar_or_degenerate_meet(a, b), Stage::Degenerate),
    }
}

/// Two edges of a triangle, from a common vertex strictly off the other triangle's plane, that end on that plane or
/// beyond it: where they meet the plane, the triangle's part of the plane ends.
///
/// If only one vertex lies in the plane and none beyond, both edges are the same.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spokes {
    pub(crate) hub: usize,
    pub(crate) ends: [usize; 2],
}

impl Spokes {
    /// From the sides of the vertices, which must not all be strictly the same; none if all are zero.
    pub(crate) fn of(sides: [Sign; 3]) -> Option<Self> {
        // A hub alone on its side is best.
        let lone = (0..3).find(|&i| {
            sides[i] != Sign::Zero
                && sides[(i + 1) % 3] != sides[i]
                && sides[(i + 2) % 3] != sides[i]
        });
        if let Some(hub) = lone {
            return Some(Self {
                hub,
                ends: [(hub + 1) % 3, (hub + 2) % 3],
            });
        }
        let hub = sides.iter().position(|&side| side != Sign::Zero)?;
        let end = sides.iter().position(|&side| side == Sign::Zero)?;
        Some(Self {
            hub,
            ends: [end, end],
        })
    }

    /// Whether the triangle touches the plane in one vertex only.
    pub(crate) fn is_point(self) -> bool {
        self.ends[0] == self.ends[1]
    }
}

/// The order, on the line where two planes meet, of the ends of the triangles' parts of it: the signs of q_j - p_i
/// along the line for the ends p_1, p_2 of A and q_1, q_2 of B, all four up to one common sign.
///
/// Let p be where the spoke a0 a1 of A meets the plane of B, and q where the spoke b0 b1 of B meets the plane of A; both
/// lie on the line. Since a1 = a0 + s (p - a0) and b1 = b0 + t (q - b0) with s, t >= 1,
///
/// ```text
/// det(a1 - a0, b0 - a0, b1 - a0) = s t det(p - a0, b0 - a0, q - a0)
/// ```
///
/// (what is left out is a multiple of b0 - a0): six times the volume of the tetrahedron a0 p b0 q. Its corner a0 is not
/// in B's plane, which holds b0 and the line; and b0 is not on the line. So it vanishes iff p = q, and its sign is that
/// of q - p times one that depends on a0 and b0 alone.
///
/// These are the two signs of one spoke of A against both of B.
#[inline]
fn order_on_line(
    (a, a_hub, a_end): (&[DVec3; 3], usize, usize),
    (b, b_spokes): (&[DVec3; 3], Spokes),
    exact: &mut u32,
) -> [Sign; 2] {
    let b_ends = b_spokes.ends.map(|end| b[end]);
    Plane::through([a[a_hub], a[a_end], b[b_spokes.hub]]).sides(b_ends, exact)
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
    !strictly_both_sides(passes)
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
