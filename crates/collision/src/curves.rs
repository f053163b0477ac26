//! Where two surfaces meet, as polylines.
//!
//! Every pair of triangles that meet shares a point, a segment or an area. The ends of segments and the corners of
//! areas are named by the faces whose only common point they are ([`crate::meeting`]): a side of A and a triangle of B,
//! say. Neighbours share sides, hence names; so points are computed once for each name, and segments are joined where
//! their names are the same. No distance decides.
//!
//! Segments inside a region that the surfaces share belong to two pairs of coplanar triangles, those around it to one.

use glam::DVec3;

use crate::construct::{Computed, of_sides, through_plane};
use crate::meeting::{Face, Meeting, SIDES, Simplex, corners, hull};
use crate::places::Places;

/// A point where two surfaces meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Where it is, in the frame of A \[m].
    pub position: DVec3,
    /// How far from there the exact point can be \[m]; 0 for points that are vertices.
    pub error: f64,
}

/// A polyline: indices of its points, in order along it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Curve {
    /// The points, each once.
    pub points: Vec<u32>,
    /// Whether a segment leads from the last point back to the first.
    pub closed: bool,
}

/// Where two surfaces meet: points, and the polylines through them.
///
/// * Where they pass through each other or touch along lines, the curves are those lines. Between manifold meshes
///   without boundary, in general position, all are closed.
/// * Where they share an area, the curves run around it.
/// * Where they touch in a point that belongs to neither, there is a curve of this one point.
///
/// Curves end where more or fewer than two segments meet in a point. A point is defined by the vertices of the side and
/// of the triangle that make it, or of the two sides, or by a vertex. Triangles that share these get the same
/// bits; vertices of equal position count as shared, whatever their indices. A triangle of zero area joins the points
/// that its sides make. Where triangles meet without sharing vertices (a vertex inside a neighbour's side), points of
/// the same position are different points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    points: Vec<CurvePoint>,
    curves: Vec<Curve>,
}

impl Curves {
    /// All points, each once.
    #[must_use]
    pub fn points(&self) -> &[CurvePoint] {
        &self.points
    }

    /// The polylines.
    #[must_use]
    pub fn curves(&self) -> &[Curve] {
        &self.curves
    }

    /// The positions along one of the polylines \[m].
    pub fn positions<'a>(&'a self, curve: &'a Curve) -> impl Iterator<Item = DVec3> + 'a {
        let position = |&i: &u32| self.points.get(i as usize).map(|point| point.position);
        curve.points.iter().filter_map(position)
    }
}

/// The corners of the triangles that are in pairs, and which have the same place.
pub(crate) struct Corners {
    triangles: Vec<u32>,
    /// Of all three corners of each.
    list: Vec<DVec3>,
    places: Places,
}

impl Corners {
    /// Of these triangles, in any order, with repetitions.
    pub(crate) fn new(
        triangles: impl Iterator<Item = u32>,
        points: impl Fn(u32) -> [DVec3; 3],
    ) -> Self {
        let mut triangles: Vec<u32> = triangles.collect();
        triangles.sort_unstable();
        triangles.dedup();
        let list: Vec<DVec3> = triangles.iter().flat_map(|&t| points(t)).collect();
        Self {
            places: Places::of(&list),
            triangles,
            list,
        }
    }

    fn of(&self, triangle: u32) -> Option<([DVec3; 3], [u32; 3])> {
        let first = 3 * self.triangles.binary_search(&triangle).ok()?;
        let points = self.list.get(first..)?.first_chunk()?;
        let numbers = self.places.numbers.get(first..)?.first_chunk()?;
        Some((*points, *numbers))
    }

    fn positions(&self, name: FaceName) -> impl Iterator<Item = DVec3> {
        name.into_iter()
            .filter_map(|number| self.places.points.get(number as usize).copied())
    }
}

/// A face by the places of its corners, in order; [`NONE`] for those that it does not have.
type FaceName = [u32; 3];

const NONE: u32 = u32::MAX;

fn name_of(face: Face, numbers: [u32; 3]) -> FaceName {
    let mut name = [NONE; 3];
    for corner in corners(face) {
        name[corner] = numbers[corner];
    }
    name.sort_unstable();
    name
}

/// A point by the faces whose only common point it is, of A and of B; of one mesh with itself, the lesser one first.
type PointName = [FaceName; 2];

/// A segment by its ends, the lesser one first.
type Segment<P> = [P; 2];

/// Collects what pairs of triangles meet in.
pub(crate) struct Builder<'a> {
    a: &'a Corners,
    /// None if that is A itself.
    b: Option<&'a Corners>,
    points: Vec<PointName>,
    /// Segments, and whether they are sides of an area.
    segments: Vec<(Segment<PointName>, bool)>,
}

impl<'a> Builder<'a> {
    pub(crate) fn new(a: &'a Corners, b: Option<&'a Corners>) -> Self {
        Self {
            a,
            b,
            points: Vec::new(),
            segments: Vec::new(),
        }
    }

    /// Adds what a pair meets in.
    pub(crate) fn add(&mut self, [i, j]: [u32; 2]) {
        let (Some((a, numbers_a)), Some((b, numbers_b))) =
            (self.a.of(i), self.b.unwrap_or(self.a).of(j))
        else {
            return;
        };
        let name = |[face_a, face_b]: [Face; 2]| {
            let mut name = [name_of(face_a, numbers_a), name_of(face_b, numbers_b)];
            if self.b.is_none() {
                name.sort_unstable();
            }
            name
        };
        let meeting = Meeting::of(Simplex::hull_of(&a), Simplex::hull_of(&b));
        let mut names: Vec<PointName> = meeting.points().iter().map(|&faces| name(faces)).collect();
        let in_area = names.len() > 2;
        if names.len() == 1 {
            // The sides of a triangle of zero area meet the other one in the same point, each by another name.
            for face_a in parts(&a) {
                for face_b in parts(&b) {
                    let meeting = Meeting::of(Simplex::new(&a, face_a), Simplex::new(&b, face_b));
                    names.extend(meeting.points().iter().map(|&faces| name(faces)));
                }
            }
            names.sort_unstable();
            names.dedup();
            let links = names.windows(2).map(|link| ([link[0], link[1]], false));
            self.segments.extend(links);
        }
        let sides = meeting.sides().map(|side| {
            let mut ends = side.map(|end| names[end]);
            ends.sort_unstable();
            (ends, in_area)
        });
        self.segments.extend(sides);
        self.points.extend(names);
    }

    /// Joins the segments.
    pub(crate) fn finish(mut self) -> Curves {
        self.points.sort_unstable();
        self.points.dedup();
        let mut segments: Vec<(Segment<u32>, bool)> = self
            .segments
            .iter()
            .map(|(ends, in_area)| (ends.each_ref().map(|end| self.index(end)), *in_area))
            .collect();
        segments.sort_unstable();
        // Points of no curve of more than one point, until one is found.
        let mut lonely = vec![true; self.points.len()];
        for end in segments.iter().flat_map(|(ends, _)| ends) {
            lonely[*end as usize] = false;
        }
        let kept: Vec<Segment<u32>> = segments
            .chunk_by(|left, right| left.0 == right.0)
            .filter_map(|same| {
                // Around an area run the sides that belong to it an odd number of times.
                let areas = same.iter().filter(|(_, in_area)| *in_area).count();
                let (ends, _) = same.first()?;
                (areas == 0 || areas % 2 == 1).then_some(*ends)
            })
            .collect();
        let mut curves = trace(self.points.len(), &kept);
        curves.extend(
            (0_u32..)
                .zip(&lonely)
                .filter(|(_, lonely)| **lonely)
                .map(|(point, _)| Curve {
                    points: vec![point],
                    closed: false,
                }),
        );
        self.number(curves)
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "four thousand million points, of 48 bytes, are beyond any pair list that led here"
    )]
    fn index(&self, name: &PointName) -> u32 {
        self.points.binary_search(name).unwrap_or_default() as u32
    }

    /// Computes the points that are on curves, and numbers them in the order in which the curves name them.
    fn number(&self, mut curves: Vec<Curve>) -> Curves {
        let mut numbers = vec![NONE; self.points.len()];
        let mut points = Vec::new();
        let mut next = 0..NONE;
        for point in curves.iter_mut().flat_map(|curve| &mut curve.points) {
            let number = &mut numbers[*point as usize];
            if *number == NONE {
                *number = next.next().unwrap_or(NONE);
                let (position, error) = self.compute(self.points[*point as usize]);
                points.push(CurvePoint { position, error });
            }
            *point = *number;
        }
        Curves { points, curves }
    }

    /// The position of a point, from nothing but its name.
    fn compute(&self, [a, b]: PointName) -> Computed {
        let a: Vec<DVec3> = self.a.positions(a).collect();
        let b: Vec<DVec3> = self.b.unwrap_or(self.a).positions(b).collect();
        match (a.as_slice(), b.as_slice()) {
            (&[vertex], _) | (_, &[vertex]) => (vertex, 0.0),
            (&[p, q], &[r, s]) => of_sides([p, q], [r, s]),
            (&[p, q], &[a, b, c]) | (&[a, b, c], &[p, q]) => through_plane([p, q], [a, b, c]),
            // No other faces have exactly one point in common.
            _ => (DVec3::ZERO, f64::INFINITY),
        }
    }
}

/// The closed faces whose union's outline a triangle is: itself, or of one of zero area the sides, and the hull.
fn parts(triangle: &[DVec3; 3]) -> impl Iterator<Item = Face> {
    let hull = hull(triangle);
    let is_segment = hull.count_ones() == 2;
    let differ = |side: Face| {
        let mut ends = corners(side).map(|corner| triangle[corner]);
        ends.next() != ends.next()
    };
    let sides = SIDES.map(|side| (is_segment && side != hull && differ(side)).then_some(side));
    std::iter::once(hull).chain(sides.into_iter().flatten())
}

/// Polylines from one point that has not exactly two segments to the next, and then the loops that are left.
fn trace(points: usize, segments: &[Segment<u32>]) -> Vec<Curve> {
    // The segments at each point: those from starts[point] to starts[point + 1].
    let mut starts = vec![0; points + 1];
    for end in segments.iter().flatten() {
        starts[*end as usize + 1] += 1;
    }
    for point in 0..points {
        starts[point + 1] += starts[point];
    }
    let mut filled = starts.clone();
    let mut at = vec![0; 2 * segments.len()];
    for (segment, ends) in segments.iter().enumerate() {
        for end in ends {
            let next = &mut filled[*end as usize];
            at[*next] = segment;
            *next += 1;
        }
    }
    let segments_at = |point: u32| &at[starts[point as usize]..starts[point as usize + 1]];
    let mut done = vec![false; segments.len()];
    let mut curves = Vec::new();
    for loops in [false, true] {
        for (point, _) in (0_u32..).zip(0..points) {
            if !loops && segments_at(point).len() == 2 {
                continue;
            }
            while let Some(first) = segments_at(point).iter().find(|&&s| !done[s]) {
                let mut curve = vec![point];
                let mut segment = Some(*first);
                while let Some(current) = segment {
                    done[current] = true;
                    let [start, end] = segments[current];
                    let here = curve.last().copied();
                    let next = if here == Some(start) { end } else { start };
                    curve.push(next);
                    let onward = segments_at(next);
                    segment = (onward.len() == 2)
                        .then(|| onward.iter().copied().find(|&s| !done[s]))
                        .flatten();
                }
                let closed = curve.last() == Some(&point);
                if closed {
                    curve.pop();
                }
                curves.push(Curve {
                    points: curve,
                    closed,
                });
            }
        }
    }
    curves
}
