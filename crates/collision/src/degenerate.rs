//! Triangles of zero area: the segments and points that they are.

use glam::{DVec2, DVec3};

use crate::predicates::{Axis, Sign, orient2d_counted, orient3d_counted, strictly_one_side};

/// A closed segment; a point if both ends coincide.
///
/// The ends are in lexicographic order of their coordinates, which is an order along any line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) start: DVec3,
    pub(crate) end: DVec3,
}

impl Segment {
    /// The hull of three collinear points.
    pub(crate) fn spanned_by(points: &[DVec3; 3]) -> Self {
        let [first, rest @ ..] = *points;
        let mut hull = Self {
            start: first,
            end: first,
        };
        for p in rest {
            if precedes(p, hull.start) {
                hull.start = p;
            }
            if precedes(hull.end, p) {
                hull.end = p;
            }
        }
        hull
    }
}

/// Whether `p` comes strictly before `q` in the lexicographic order of coordinates.
pub(crate) fn precedes(p: DVec3, q: DVec3) -> bool {
    p.to_array() < q.to_array()
}

/// Whether two closed segments, possibly points, share a point. Counts in `exact` the signs left to expansions.
pub(crate) fn segments_meet(a: Segment, b: Segment, exact: &mut u32) -> bool {
    let (p, q, r, s) = (a.start, a.end, b.start, b.end);
    if orient3d_counted([p, q, r, s], exact) != Sign::Zero {
        return false;
    }
    // If these triples are collinear then so are all four points: p != q puts r and s on the line pq; p == q puts p
    // on the line rs.
    let axis = [[p, q, r], [p, q, s], [p, r, s]]
        .iter()
        .find_map(|points| Axis::of_plane_counted(points, exact));
    let Some(axis) = axis else {
        return !precedes(q, r) && !precedes(s, p);
    };
    // In a common plane, not on one line: disjoint iff the line of one has the other strictly on one side. (A point
    // has no line, but then the other segment's line misses it.)
    let [p, q, r, s] = [p, q, r, s].map(|point| axis.project(point));
    let mut sides = |u, v, ends: [DVec2; 2]| ends.map(|end| orient2d_counted([u, v, end], exact));
    !strictly_one_side(sides(p, q, [r, s])) && !strictly_one_side(sides(r, s, [p, q]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hull_of_collinear_points_in_any_order() {
        let points = [DVec3::ZERO, DVec3::NEG_ONE, DVec3::ONE];
        for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let hull = Segment::spanned_by(&order.map(|i: usize| points[i]));
            assert_eq!((hull.start, hull.end), (DVec3::NEG_ONE, DVec3::ONE));
        }
    }
}
