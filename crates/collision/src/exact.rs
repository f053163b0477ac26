//! The exact test of one pair of triangles.
//!
//! Orientation signs decide: on which side of each triangle's plane the other's vertices lie (6), and, on the line
//! where the planes meet, how the ends of the two triangles' parts of it are ordered (2). All are signs of polynomials
//! of degree three, so exact signs (`predicates.rs`) make an exact test: that of Guigue & Devillers (Fast and robust
//! triangle-triangle overlap test using orientation predicates, Journal of Graphics Tools 8(1), 2003), with the choice
//! of the corners read off the signs instead of permuted through a tree of cases.

use glam::DVec3;

use crate::classify::PairClass;
pub use crate::classify::classify;
use crate::degenerate::{Segment, segments_meet};
use crate::predicates::{
    Axis, Plane, Sides, Sign, orient2d_counted, orient3d_counted, strictly_one_side,
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
    /// The class of a pair that meets, if decided on the line; others take more than the decision.
    pub(crate) class: Option<PairClass>,
    pub(crate) stage: Stage,
    /// Orientation signs that the filter left to expansions.
    pub(crate) exact_signs: u32,
}

/// Decides a pair, given the plane of B.
#[inline]
pub(crate) fn decide(a: &[DVec3; 3], b: &[DVec3; 3], plane_b: &Plane) -> Decision {
    let mut exact_signs = 0;
    let (meet, class, stage) = decide_staged(a, b, plane_b, &mut exact_signs);
    Decision {
        meet,
        class,
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
) -> (bool, Option<PairClass>, Stage) {
    let a_sides = plane_b.sides(a, exact);
    if a_sides.strictly_one() {
        return (false, None, Stage::PlaneOfB);
    }
    let b_sides = Plane::through(*a).sides(b, exact);
    if b_sides.strictly_one() {
        return (false, None, Stage::PlaneOfA);
    }
    // A triangle of zero area has no plane: every point gets the sign zero against it. So unless some sign differs
    // from zero both ways, the triangles share a plane or one of them has zero area.
    match (Part::of(a_sides), Part::of(b_sides)) {
        (Some(part_a), Some(part_b)) => {
            let order = |reversed, exact: &mut u32| {
                end_after_start((a, part_a), (b, part_b), reversed, exact)
            };
            let first = order(false, exact);
            if first == Sign::Negative {
                return (false, None, Stage::Line);
            }
            let second = order(true, exact);
            if second == Sign::Negative {
                return (false, None, Stage::Line);
            }
            let end_to_end = first == Sign::Zero || second == Sign::Zero;
            let class = if end_to_end || part_a.is_point() || part_b.is_point() {
                PairClass::Point
            } else if a_sides.strictly_both() && b_sides.strictly_both() {
                PairClass::Crossing
            } else {
                PairClass::Touching
            };
            (true, Some(class), Stage::Line)
        }
        _ => {
            let meet = coplanar_or_degenerate_meet(a, b, exact);
            (meet, None, Stage::Degenerate)
        }
    }
}

/// The part of a triangle in the plane of the other, a segment or a point of the line where the planes meet: it ends
/// where two edges from a hub, a corner off the other plane, reach that plane.
///
/// With the normals n_A and n_B by the order of the corners, let the line run along d = n_A x n_B. Let p be where the
/// edge a0 a1 of A from its hub reaches the plane of B, q where b0 b1 of B reaches that of A, and q = p + m d. Since
/// a1 = a0 + s (p - a0) and b1 = b0 + t (q - b0) with s, t >= 1,
///
/// ```text
/// det(a1 - a0, b0 - a0, b1 - a0) = s t det(p - a0, b0 - p, q - p)
///                                = s t m (n_A x n_B) . ((p - a0) x (b0 - p))
///                                = s t m (n_A . (b0 - p)) (n_B . (a0 - p))
/// ```
///
/// (as n_A is normal to p - a0, and n_B to b0 - p). So that sign is the order of p and q along d times the sides of the
/// two hubs. And of the ends p1 and p2 on the edges to the next and the last but one corner, p2 - p1 is l d with
/// 0 < n_A . ((p1 - a0) x (p2 - p1)) = l |n_A|^2 (n_B . (p1 - a0)): A's part runs along d, from p1 to p2, iff its hub is
/// on the negative side of B's plane; B's, for which d is -(n_B x n_A), iff its hub is on the positive side of A's.
#[derive(Clone, Copy, Debug)]
struct Part {
    hub: usize,
    hub_is_positive: bool,
    /// The far ends of the edges, the next corner first. Both are the one corner in the plane if none is beyond.
    ends: [usize; 2],
}

impl Part {
    /// From the sides of the corners, not all strictly the same; none if all are zero.
    #[inline]
    fn of(Sides { positive, negative }: Sides) -> Option<Self> {
        let strict = positive | negative;
        let lone = if positive.count_ones() == 1 {
            positive
        } else {
            negative
        };
        let (hub, ends) = if lone.count_ones() == 1 {
            let hub = lone.trailing_zeros() as usize;
            (hub, [(hub + 1) % 3, (hub + 2) % 3])
        } else if strict != 0 {
            // Two on one side and one in the plane.
            let end = (!strict).trailing_zeros() as usize;
            (strict.trailing_zeros() as usize, [end; 2])
        } else {
            return None;
        };
        Some(Self {
            hub,
            hub_is_positive: positive >> hub & 1 == 1,
            ends,
        })
    }

    fn is_point(self) -> bool {
        self.ends[0] == self.ends[1]
    }
}

/// The sign of q2 - p1, for the start p1 of A's part along d and the end q2 of B's; or with d `reversed`, which makes
/// that p2 - q1.
#[inline]
fn end_after_start(
    (a, part_a): (&[DVec3; 3], Part),
    (b, part_b): (&[DVec3; 3], Part),
    reversed: bool,
    exact: &mut u32,
) -> Sign {
    let start = part_a.ends[usize::from(part_a.hub_is_positive != reversed)];
    let end = part_b.ends[usize::from(part_b.hub_is_positive != reversed)];
    let same = part_a.hub_is_positive == part_b.hub_is_positive;
    Plane::through([a[part_a.hub], a[start], b[part_b.hub]])
        .side(b[end], exact)
        .times(same != reversed)
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
fn segment_meets(segment: Segment, triangle: &[DVec3; 3], exact: &mut u32) -> bool {
    let Segment { start, end } = segment;
    let [a, b, c] = *triangle;
    let ends = [start, end].map(|p| orient3d_counted([a, b, c, p], exact));
    let passes = [(a, b), (b, c), (c, a)].map(|(u, v)| orient3d_counted([start, end, u, v], exact));
    edge_meets(ends, passes, || {
        in_plane_segment_meets(start, end, triangle, exact)
    })
}

/// Whether a segment, possibly a point, in the plane of a triangle meets it; never if the triangle has zero area.
///
/// Two convex polygons of a plane are disjoint iff an edge of their Minkowski difference separates it from the origin;
/// its edges are parallel to theirs. For a segment and a triangle that leaves the outer sides of the triangle's edges
/// and both sides of the segment.
fn in_plane_segment_meets(
    start: DVec3,
    end: DVec3,
    triangle: &[DVec3; 3],
    exact: &mut u32,
) -> bool {
    let Some(axis) = Axis::of_plane_counted(triangle, exact) else {
        return false;
    };
    if beyond_an_edge(axis, triangle, &[start, end], exact) {
        return false;
    }
    let [start, end] = [start, end].map(|p| axis.project(p));
    let sides = triangle.map(|p| orient2d_counted([start, end, axis.project(p)], exact));
    !strictly_one_side(sides)
}

fn coplanar_or_degenerate_meet(a: &[DVec3; 3], b: &[DVec3; 3], exact: &mut u32) -> bool {
    let axes = [a, b].map(|triangle| Axis::of_plane_counted(triangle, exact));
    match axes {
        [Some(axis), Some(_)] => {
            !beyond_an_edge(axis, a, b, exact) && !beyond_an_edge(axis, b, a, exact)
        }
        [Some(_), None] => segment_meets(Segment::spanned_by(b), a, exact),
        [None, Some(_)] => segment_meets(Segment::spanned_by(a), b, exact),
        [None, None] => segments_meet(Segment::spanned_by(a), Segment::spanned_by(b), exact),
    }
}

/// Whether `points` lie strictly beyond one edge of a coplanar triangle, whose plane projects one to one along `axis`.
fn beyond_an_edge(axis: Axis, triangle: &[DVec3; 3], points: &[DVec3], exact: &mut u32) -> bool {
    let corners = triangle.map(|p| axis.project(p));
    let outside = orient2d_counted(corners, exact).opposite();
    (0..3).any(|i| {
        let (u, v) = (corners[i], corners[(i + 1) % 3]);
        points
            .iter()
            .all(|&p| orient2d_counted([u, v, axis.project(p)], exact) == outside)
    })
}
