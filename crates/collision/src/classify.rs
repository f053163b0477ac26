//! In what two triangles meet: a point, a segment or an area.

use glam::{DVec2, DVec3};

use crate::degenerate::{Segment, precedes};
use crate::exact::{Stage, decide};
use crate::predicates::{Axis, Plane, Sign, orient2d, orient3d};

/// What the intersection of two triangles is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PairClass {
    /// One point.
    Point,
    /// A segment, but the triangles do not pass through each other: an edge of one lies in the plane of the other, or a
    /// triangle has zero area.
    Touching,
    /// A segment, and each triangle has corners strictly on both sides of the other's plane.
    Crossing,
    /// A part of the plane in which both triangles lie.
    Area,
}

impl PairClass {
    /// The dimension of the intersection: 0, 1 or 2.
    #[must_use]
    pub fn dimension(self) -> u32 {
        match self {
            Self::Point => 0,
            Self::Touching | Self::Crossing => 1,
            Self::Area => 2,
        }
    }
}

/// The class of two closed triangles, if they meet; exact for the points for which
/// [`triangles_intersect`](crate::exact::triangles_intersect) is.
///
/// ```
/// use glam::DVec3;
/// use vertebra_collision::{PairClass, exact::classify};
///
/// let a = [DVec3::ZERO, DVec3::X, DVec3::Y];
/// assert_eq!(classify(&a, &a), Some(PairClass::Area));
/// // Neighbours share an edge, or a corner.
/// let neighbour = [DVec3::X, DVec3::Y, DVec3::ONE];
/// assert_eq!(classify(&a, &neighbour), Some(PairClass::Touching));
/// assert_eq!(classify(&a, &a.map(|p| p + DVec3::X)), Some(PairClass::Point));
/// assert_eq!(classify(&a, &a.map(|p| p + DVec3::Z)), None);
/// ```
#[must_use]
pub fn classify(a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<PairClass> {
    let decision = decide(a, b, &Plane::through(*b));
    match decision.stage {
        Stage::Degenerate => decision.meet.then(|| class_without_line(a, b)),
        Stage::PlaneOfB | Stage::PlaneOfA | Stage::Line => decision.class,
    }
}

/// The class of two triangles that meet, if they share a plane or one has zero area.
fn class_without_line(a: &[DVec3; 3], b: &[DVec3; 3]) -> PairClass {
    match (Axis::of_plane(a), Axis::of_plane(b)) {
        (Some(axis), Some(_)) => {
            let [a, b] = [a, b].map(|t| t.map(|p| axis.project(p)));
            class_in_plane(&a, &b, PairClass::Area)
        }
        (Some(axis), None) => segment_class(Segment::spanned_by(b), a, axis),
        (None, Some(axis)) => segment_class(Segment::spanned_by(a), b, axis),
        (None, None) => {
            let [a, b] = [a, b].map(Segment::spanned_by);
            // Two lines meet in a point, unless they are one.
            let one_line = [b.start, b.end]
                .iter()
                .all(|&p| Axis::of_plane(&[a.start, a.end, p]).is_none());
            let overlap = [
                (a.start, a.end),
                (a.start, b.end),
                (b.start, a.end),
                (b.start, b.end),
            ]
            .iter()
            .all(|&(start, end)| precedes(start, end));
            if one_line && overlap {
                PairClass::Touching
            } else {
                PairClass::Point
            }
        }
    }
}

/// The class of a segment, possibly a point, and a proper triangle that meet.
fn segment_class(Segment { start, end }: Segment, triangle: &[DVec3; 3], axis: Axis) -> PairClass {
    let [a, b, c] = *triangle;
    let in_plane = [start, end]
        .iter()
        .all(|&p| orient3d(a, b, c, p) == Sign::Zero);
    if start == end || !in_plane {
        return PairClass::Point;
    }
    let segment = [start, end].map(|p| axis.project(p));
    class_in_plane(
        &segment,
        &triangle.map(|p| axis.project(p)),
        PairClass::Touching,
    )
}

/// The class of two convex polygons of a plane that meet, triangles or segments; `proper` if their insides do.
///
/// Their insides are disjoint iff the line of some edge has one polygon on one closed side and the other on the other
/// closed side. Then they meet on that line: in what the edge shares with the other polygon's corners there.
fn class_in_plane(p: &[DVec2], q: &[DVec2], proper: PairClass) -> PairClass {
    for (p, q) in [(p, q), (q, p)] {
        for i in 0..p.len() {
            let (u, v) = (p[i], p[(i + 1) % p.len()]);
            // A segment counts as an edge twice, once in each direction, with its outside to the right.
            let outside = match p {
                &[_, _, _] => orient2d(u, v, p[(i + 2) % 3]).opposite(),
                _ => Sign::Negative,
            };
            let sides = || q.iter().map(|&r| (r, orient2d(u, v, r)));
            if !sides().all(|(_, side)| side == outside || side == Sign::Zero) {
                continue;
            }
            let mut on_line = sides()
                .filter(|&(_, side)| side == Sign::Zero)
                .map(|(r, _)| r);
            return match (on_line.next(), on_line.next()) {
                (Some(r), Some(s)) if overlap_on_line([u, v], [r, s]) => PairClass::Touching,
                _ => PairClass::Point,
            };
        }
    }
    proper
}

/// Whether two segments of a line share more than a point.
fn overlap_on_line(p: [DVec2; 2], q: [DVec2; 2]) -> bool {
    // Lexicographic order is an order along any line.
    let sorted = |ends: [DVec2; 2]| {
        let [first, second] = ends.map(|end| end.to_array());
        if first < second {
            [first, second]
        } else {
            [second, first]
        }
    };
    let ([p_start, p_end], [q_start, q_end]) = (sorted(p), sorted(q));
    p_start < q_end && q_start < p_end && p_start < p_end && q_start < q_end
}
