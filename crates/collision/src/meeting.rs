//! Where exactly two triangles meet: the corners of their intersection, each named by what makes it.
//!
//! The intersection of two convex sets is convex, so its extreme points tell it: one for a point, two for a segment,
//! three to six for an area. Let s and t be the faces (corner, open side, or open inside) of the two simplices in which
//! a point x lies. Then
//!
//! * if x is extreme, s and t share nothing else: s n t is relatively open, so x would lie inside a segment of it;
//! * if s and t share only x, it is extreme: a segment of the intersection around x would lie in s and in t.
//!
//! So extreme points are in one-to-one correspondence with the pairs of faces that meet in exactly one point, and
//! orientation signs tell which do. Such a pair names the point without computing it, and the name is the same in every
//! pair of triangles that has these faces.

use glam::DVec3;

use crate::degenerate::{Segment, precedes};
use crate::predicates::{Axis, Plane, Sign, orient2d, orient3d};

/// A face of a triangle: a bit for each corner that spans it, corner 0 lowest.
pub(crate) type Face = u8;

/// All corners: the inside of a triangle that has one.
pub(crate) const WHOLE: Face = 0b111;

/// The sides of a triangle.
pub(crate) const SIDES: [Face; 3] = [0b011, 0b110, 0b101];

/// Extreme points that two triangles can have in common.
const MOST: usize = 6;

/// The corners that span a face.
pub(crate) fn corners(face: Face) -> impl Iterator<Item = usize> {
    (0..3).filter(move |corner| face >> corner & 1 == 1)
}

/// The corners of a triangle that span its hull: two of them, or one, if it has zero area.
pub(crate) fn hull(triangle: &[DVec3; 3]) -> Face {
    if Axis::of_plane(triangle).is_some() {
        return WHOLE;
    }
    let Segment { start, end } = Segment::spanned_by(triangle);
    let corner = |p: DVec3| (0..3).find(|&i| triangle[i] == p).unwrap_or(0);
    1 << corner(start) | 1 << corner(end)
}

/// The part of a triangle that one of its faces closes over: independent points.
#[derive(Clone, Copy)]
pub(crate) struct Simplex<'a> {
    points: &'a [DVec3; 3],
    face: Face,
}

impl<'a> Simplex<'a> {
    /// The corners of the face must be independent: two that differ, or three not on a line.
    pub(crate) fn new(points: &'a [DVec3; 3], face: Face) -> Self {
        Self { points, face }
    }

    pub(crate) fn hull_of(points: &'a [DVec3; 3]) -> Self {
        Self::new(points, hull(points))
    }

    fn sides(self) -> impl Iterator<Item = (Face, [DVec3; 2])> {
        SIDES.into_iter().filter_map(move |side| {
            let mut ends = corners(side).map(|corner| self.points[corner]);
            let inside = side & !self.face == 0;
            Some((side, [ends.next()?, ends.next()?])).filter(|_| inside)
        })
    }

    /// On which sides of another's plane the corners lie; none has a side if that has no plane.
    fn sides_of(self, other: Self) -> [Sign; 3] {
        if other.face == WHOLE {
            let plane = Plane::through(*other.points);
            self.points.map(|p| plane.side(p, &mut 0))
        } else {
            [Sign::Zero; 3]
        }
    }

    /// The face in whose relative inside a point lies; if there is a plane, the point must be in it.
    fn locate(self, p: DVec3) -> Option<Face> {
        if let Some(corner) = corners(self.face).find(|&corner| self.points[corner] == p) {
            return Some(1 << corner);
        }
        if self.face != WHOLE {
            let on_side = |[u, v]: [DVec3; 2]| {
                let between =
                    (precedes(u, p) && precedes(p, v)) || (precedes(v, p) && precedes(p, u));
                between && Axis::of_plane(&[u, v, p]).is_none()
            };
            return self
                .sides()
                .find_map(|(side, ends)| on_side(ends).then_some(side));
        }
        let axis = Axis::of_plane(self.points)?;
        let [a, b, c] = self.points.map(|point| axis.project(point));
        let p = axis.project(p);
        let inside = orient2d(a, b, c);
        let mut face = WHOLE;
        // On the line of a side the corner opposite does not count.
        for (u, v, opposite) in [(a, b, 2), (b, c, 0), (c, a, 1)] {
            match orient2d(u, v, p) {
                Sign::Zero => face &= !(1 << opposite),
                side if side == inside => {}
                _ => return None,
            }
        }
        Some(face)
    }
}

/// The extreme points of an intersection, each by the faces of A and of B whose only common point it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meeting {
    points: [[Face; 2]; MOST],
    count: usize,
}

impl Meeting {
    /// Decided as [`triangles_intersect`](crate::exact::triangles_intersect) decides, and exact for the same points.
    pub(crate) fn of(a: Simplex<'_>, b: Simplex<'_>) -> Self {
        let mut meeting = Self {
            points: [[0; 2]; MOST],
            count: 0,
        };
        let (signs_a, signs_b) = (a.sides_of(b), b.sides_of(a));
        for corner in corners(a.face).filter(|&corner| signs_a[corner] == Sign::Zero) {
            if let Some(face) = b.locate(a.points[corner]) {
                meeting.push([1 << corner, face]);
            }
        }
        for corner in corners(b.face).filter(|&corner| signs_b[corner] == Sign::Zero) {
            // Common corners are there already.
            if let Some(face) = a.locate(b.points[corner]).filter(|f| f.count_ones() > 1) {
                meeting.push([face, 1 << corner]);
            }
        }
        for (side_a, ends_a) in a.sides().filter(|(side, _)| reaches(*side, signs_a)) {
            for (side_b, ends_b) in b.sides().filter(|(side, _)| reaches(*side, signs_b)) {
                if cross(ends_a, ends_b) {
                    meeting.push([side_a, side_b]);
                }
            }
            if passes(side_a, signs_a) && pierces(ends_a, b.points) {
                meeting.push([side_a, WHOLE]);
            }
        }
        for (side_b, ends_b) in b.sides() {
            if passes(side_b, signs_b) && pierces(ends_b, a.points) {
                meeting.push([WHOLE, side_b]);
            }
        }
        meeting
    }

    fn push(&mut self, faces: [Face; 2]) {
        if let Some(slot) = self.points.get_mut(self.count) {
            *slot = faces;
            self.count += 1;
        }
    }

    pub(crate) fn points(&self) -> &[[Face; 2]] {
        &self.points[..self.count]
    }

    /// The sides of the intersection, by the indices of its points.
    ///
    /// A side of an area lies on a side of A or of B, whose line has no other extreme point.
    pub(crate) fn sides(&self) -> impl Iterator<Item = [usize; 2]> {
        let ends = |owner: usize, side: Face| {
            let mut on_side = (0..self.count).filter(|&i| self.points[i][owner] & !side == 0);
            Some([on_side.next()?, on_side.next()?])
        };
        let mut found: [Option<[usize; 2]>; 6] = [None; 6];
        if self.count == 2 {
            found[0] = Some([0, 1]);
        } else {
            for (slot, (owner, side)) in (0..2)
                .flat_map(|owner| SIDES.map(|side| (owner, side)))
                .enumerate()
            {
                found[slot] = ends(owner, side).filter(|ends| !found.contains(&Some(*ends)));
            }
        }
        found.into_iter().flatten()
    }
}

/// Whether a side may share a point with a plane, by the signs of the corners.
fn reaches(side: Face, signs: [Sign; 3]) -> bool {
    let mut ends = corners(side).map(|corner| signs[corner]);
    ends.next() != ends.next() || corners(side).any(|corner| signs[corner] == Sign::Zero)
}

/// Whether a side has its ends strictly on either side of a plane.
fn passes(side: Face, signs: [Sign; 3]) -> bool {
    reaches(side, signs) && corners(side).all(|corner| signs[corner] != Sign::Zero)
}

/// Whether a segment that passes through a triangle's plane does so in its inside.
fn pierces([u, v]: [DVec3; 2], corners: &[DVec3; 3]) -> bool {
    let turn = |i: usize| orient3d(u, v, corners[i], corners[(i + 1) % 3]);
    let first = turn(0);
    first != Sign::Zero && turn(1) == first && turn(2) == first
}

/// Whether two open segments have exactly one point in common.
fn cross([p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> bool {
    if orient3d(p, q, r, s) != Sign::Zero {
        return false;
    }
    // Parallel segments share no point or more than one.
    let Some(axis) = [[p, q, r], [p, q, s]].iter().find_map(Axis::of_plane) else {
        return false;
    };
    let [p, q, r, s] = [p, q, r, s].map(|point| axis.project(point));
    let separates = |p, q, r, s| {
        let side = orient2d(p, q, r);
        side != Sign::Zero && orient2d(p, q, s) == side.opposite()
    };
    separates(p, q, r, s) && separates(r, s, p, q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::classify::classify;

    fn meeting(a: &[DVec3; 3], b: &[DVec3; 3]) -> Meeting {
        Meeting::of(Simplex::hull_of(a), Simplex::hull_of(b))
    }

    /// The number of extreme points says the dimension, which the classes say too, by other means; areas are closed by
    /// as many sides as they have corners.
    #[test]
    fn counts_agree_with_classes() {
        let mut random = oorandom::Rand32::new(5);
        let mut seen = [0; 7];
        for case in 0..40_000 {
            let mut triangle = || {
                [(); 3].map(|()| {
                    let [x, y, z] = [(); 3].map(|()| f64::from(random.rand_range(0..4)));
                    // Every other pair in one oblique plane.
                    DVec3::new(x, y, if case % 2 == 0 { z } else { x - 2.0 * y })
                })
            };
            let (a, b) = (triangle(), triangle());
            let found = meeting(&a, &b);
            let count = found.points().len();
            let dimension = classify(&a, &b).map(|class| class.dimension() as usize);
            let expected = match count {
                0 => None,
                _ => Some(count.min(3) - 1),
            };
            assert_eq!(dimension, expected, "{a:?} {b:?} {found:?}");
            let sides = match count {
                0 | 1 => 0,
                2 => 1,
                _ => count,
            };
            assert_eq!(found.sides().count(), sides, "{a:?} {b:?} {found:?}");
            seen[count] += 1;
        }
        assert!(seen.iter().all(|&count| count > 5), "{seen:?}");
    }

    /// Relabelling moves the names along.
    #[test]
    fn names_follow_the_corners() {
        let a = [DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0];
        let b = [
            DVec3::new(1.0, 1.0, -1.0),
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::new(5.0, -3.0, 0.0),
        ];
        // Along the line x + y = 2: from inside A on the side 0 1 of B to the side 0 1 of A inside B.
        assert_eq!(meeting(&a, &b).points(), [[0b011, WHOLE], [WHOLE, 0b011]]);
        let turned = [b[1], b[2], b[0]];
        assert_eq!(
            meeting(&a, &turned).points(),
            [[0b011, WHOLE], [WHOLE, 0b101]]
        );
        assert_eq!(meeting(&b, &a).points(), [[0b011, WHOLE], [WHOLE, 0b011]]);
    }
}
