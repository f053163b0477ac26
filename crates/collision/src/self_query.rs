//! One mesh with itself.

use std::borrow::Cow;
use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use crate::all_pairs::ExactTest;
use crate::bounds::Bounds;
use crate::classify::classify;
use crate::criterion::Criterion;
use crate::culling::Culling;
use crate::curves::{Builder, Corners, Curves};
use crate::exact::Decision;
use crate::meeting::{Meeting, Simplex, corners};
use crate::mesh::TriangleMesh;
use crate::operand::Operand;
use crate::parallel;
use crate::predicates::{Axis, Plane, Sign, orient2d, strictly_one_side};
use crate::query::ClassifiedPair;
use crate::sink::{Any, Count, Mask, Pairs, Sink, Statistics, run};
use crate::transform::RelativePose;
use crate::traverse::TreeTest;

/// A question about the triangles of one mesh that meet each other where they should not.
///
/// Triangles that share corners always meet, in these corners or in the side between them; they count as a pair only if
/// they meet beyond: if a neighbour is folded onto its neighbour, or passes through it. Corners are shared if they have
/// the same position, whether or not they have the same index. Everything is decided exactly, on the mesh's own
/// vertices.
///
/// ```
/// use glam::Vec3;
/// use vertebra_collision::{SelfQuery, TriangleMesh};
///
/// let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0), Vec3::splat(0.25)];
/// // A square of two triangles, and a flap on its diagonal: they only share sides.
/// let square = TriangleMesh::new(corners.clone(), vec![[0, 1, 2], [3, 2, 1], [1, 2, 4]])?;
/// assert!(!SelfQuery::new(&square).any());
/// // The flap folded flat.
/// let mut folded = corners;
/// folded[4].z = 0.0;
/// let folded = TriangleMesh::new(folded, square.triangles().to_vec())?;
/// assert_eq!(SelfQuery::new(&folded).pairs(), [[0, 2]]);
/// # Ok::<(), vertebra_collision::MeshError>(())
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct SelfQuery<'a> {
    operand: Operand<'a>,
    culling: Culling,
    threads: usize,
}

impl<'a> SelfQuery<'a> {
    /// A query over a [`TriangleMesh`] or a [`Collider`](crate::Collider).
    pub fn new(mesh: impl Into<Operand<'a>>) -> Self {
        Self {
            operand: mesh.into(),
            culling: Culling::default(),
            threads: 1,
        }
    }

    /// Chooses how pairs are culled.
    pub fn culling(mut self, culling: Culling) -> Self {
        self.culling = culling;
        self
    }

    /// Uses at most this many threads of the current rayon pool; 0 uses all of them. Without the feature `rayon` there
    /// is one.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// Whether any two triangles meet; stops at the first pair found.
    #[must_use]
    pub fn any(&self) -> bool {
        self.run(Any::default).iter().any(|found| found.0)
    }

    /// How many pairs of triangles meet.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.run(Count::default).iter().map(|count| count.0).sum()
    }

    /// Which triangles meet some other.
    #[must_use]
    pub fn mask(&self) -> Vec<bool> {
        let count = self.operand.mesh().len();
        let masks = self.run(|| Mask::new(count, count)).into_iter();
        let Mask { mut a, b } = masks.fold(Mask::new(count, count), |all, mask| all.merge(&mask));
        for (a, b) in a.iter_mut().zip(b) {
            *a |= b;
        }
        a
    }

    /// All pairs of triangles that meet, the lesser index first, in lexicographic order.
    #[must_use]
    pub fn pairs(&self) -> Vec<[u32; 2]> {
        Pairs::sorted(self.run(Pairs::default))
    }

    /// All pairs of triangles that meet, the lesser index first, in lexicographic order, each with what it meets in. Of
    /// neighbours that includes their common corners: if one is folded onto the other, an area.
    #[must_use]
    pub fn classified(&self) -> Vec<ClassifiedPair> {
        let (mesh, pairs) = (self.operand.mesh(), self.pairs());
        let class = |index: usize| {
            let [a, b] = pairs[index];
            let class = classify(&mesh.wide_triangle(a), &mesh.wide_triangle(b))?;
            Some(ClassifiedPair { a, b, class })
        };
        let threads = parallel::available(self.threads);
        let classes = parallel::map(threads, pairs.len(), class);
        classes.into_iter().flatten().collect()
    }

    /// Where the surface meets itself, as polylines, in the mesh's own frame.
    #[must_use]
    pub fn curves(&self) -> Curves {
        let (mesh, pairs) = (self.operand.mesh(), self.pairs());
        let corners = Corners::new(pairs.iter().flatten().copied(), |i| mesh.wide_triangle(i));
        let mut builder = Builder::new(&corners, None);
        for pair in pairs {
            builder.add(pair);
        }
        builder.finish()
    }

    /// How often each stage of the exact test decides, over the pairs that [`count`](Self::count) looks at. Neighbours
    /// that meet in their common corners only are settled before, and are not among them.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        let parts = self.run(Statistics::default).into_iter();
        parts.fold(Statistics::default(), |sum, part| sum.merge(&part))
    }

    fn run<S: Sink>(&self, new_sink: impl Fn() -> S + Send + Sync) -> Vec<S> {
        let threads = parallel::available(self.threads);
        let mesh = self.operand.mesh();
        let neighbours = Neighbours {
            mesh,
            places: self.operand.places(),
        };
        let new_sink = || Beyond {
            sink: new_sink(),
            neighbours: &neighbours,
        };
        let sizes = [mesh.len(); 2];
        let sinks = if self.culling.uses_bvh(sizes, self.operand.unprepared()) {
            let everything = Bounds::of(mesh.vertices());
            let tree = self.operand.tree(&everything, threads);
            run(&TreeTest::of_itself(&tree, threads), threads, new_sink)
        } else {
            let test = ExactTest::new(mesh, mesh, &RelativePose::IDENTITY, Criterion::Meet);
            run(&test, threads, new_sink)
        };
        sinks.into_iter().map(|beyond| beyond.sink).collect()
    }
}

/// Wants neighbours only if they meet beyond their common corners.
struct Beyond<'a, S> {
    sink: S,
    neighbours: &'a Neighbours<'a>,
}

impl<S: Sink> Sink for Beyond<'_, S> {
    fn wants(&self, pair: [u32; 2]) -> bool {
        pair[0] < pair[1] && self.sink.wants(pair) && self.neighbours.may_count(pair)
    }

    fn decided(&mut self, decision: &Decision) {
        self.sink.decided(decision);
    }

    fn hit(&mut self, pair: [u32; 2]) -> ControlFlow<()> {
        self.sink.hit(pair)
    }
}

/// Which triangles share which corners.
struct Neighbours<'a> {
    mesh: &'a TriangleMesh,
    /// The place of each vertex.
    places: Cow<'a, [u32]>,
}

impl Neighbours<'_> {
    /// Whether two triangles share no corner, or meet beyond those they share.
    fn may_count(&self, [i, j]: [u32; 2]) -> bool {
        let corners = |t: u32| self.mesh.triangles()[t as usize].map(|v| self.places[v as usize]);
        let (a, b) = (corners(i), corners(j));
        let shared = a.iter().any(|corner| b.contains(corner));
        let points = |t: u32| self.mesh.wide_triangle(t);
        !shared || meet_beyond((&points(i), a), (&points(j), b))
    }
}

/// Whether two triangles, given by the positions and the places of their corners, meet in more than the hull of their
/// common corners, of which there is one at least.
///
/// Their intersection contains that hull, which is a face of both; so it is no more if all its extreme points are
/// common corners, unless it is an area: two triangles in the same place count.
pub(crate) fn meet_beyond(
    (points_a, a): (&[DVec3; 3], [u32; 3]),
    (points_b, b): (&[DVec3; 3], [u32; 3]),
) -> bool {
    if apart_beyond((points_a, a), (points_b, b)) {
        return false;
    }
    let meeting = Meeting::of(Simplex::hull_of(points_a), Simplex::hull_of(points_b));
    let common_corner = |face: u8, own: &[u32; 3], other: &[u32; 3]| {
        face.count_ones() == 1 && corners(face).all(|corner| other.contains(&own[corner]))
    };
    let points = meeting.points();
    points.len() > 2
        || points
            .iter()
            .any(|&[in_a, in_b]| !common_corner(in_a, &a, &b) && !common_corner(in_b, &b, &a))
}

/// What settles nearly all neighbours: that a line through the common corners, in a projection along an axis, or the
/// plane of one triangle has the other corners strictly apart. Then they meet in the hull of the common corners only.
fn apart_beyond((a, ids_a): (&[DVec3; 3], [u32; 3]), (b, ids_b): (&[DVec3; 3], [u32; 3])) -> bool {
    let (own_a, a) = own_first(a, ids_a, ids_b);
    let (own_b, b) = own_first(b, ids_b, ids_a);
    if own_a != own_b || own_a == 0 {
        return false;
    }
    let axis = Axis::most_along((a[1] - a[0]).cross(a[2] - a[0]));
    let flat = |[a, b, c]: [DVec3; 3]| [axis.project(a), axis.project(b), axis.project(c)];
    let (flat_a, flat_b) = (flat(a), flat(b));
    let apart = if own_a == 1 {
        apart_across_side(flat_a, flat_b)
    } else {
        apart_around_corner(flat_a, flat_b)
    };
    let one_side = |of: &[DVec3; 3], plane: &[DVec3; 3]| {
        let plane = Plane::through(*plane);
        strictly_one_side([0, own_a - 1].map(|i| plane.side(of[i], &mut 0)))
    };
    apart || one_side(&a, &b) || one_side(&b, &a)
}

/// The number of corners that only this triangle has, and the corners turned so that those come first.
fn own_first(points: &[DVec3; 3], ids: [u32; 3], other: [u32; 3]) -> (usize, [DVec3; 3]) {
    let own = ids.map(|id| !other.contains(&id));
    let [a, b, c] = *points;
    let turned = match own {
        [false, true, _] => [b, c, a],
        [_, false, true] => [c, a, b],
        _ => [a, b, c],
    };
    (own.into_iter().filter(|&own| own).count(), turned)
}

/// Whether the line of the common side, corners 1 and 2, has corner 0 of each triangle strictly on its own side.
///
/// Beyond the line there is only one of the triangles, and above it nothing but the side: also in space, whatever the
/// projection.
fn apart_across_side(a: [DVec2; 3], b: [DVec2; 3]) -> bool {
    let side = |p| orient2d(a[1], a[2], p);
    let (side_a, side_b) = (side(a[0]), side(b[0]));
    side_a != Sign::Zero && side_b == side_a.opposite()
}

/// Whether the angles that two triangles have at the common corner, corner 2, share nothing else; then nor do the
/// triangles, also in space.
///
/// If two angles below a half turn share more, then a side of one lies in the other.
fn apart_around_corner(a: [DVec2; 3], b: [DVec2; 3]) -> bool {
    let turn = |p, q| orient2d(p, q, a[2]);
    let (within_a, within_b) = (turn(a[0], a[1]), turn(b[0], b[1]));
    if within_a == Sign::Zero || within_b == Sign::Zero {
        return false;
    }
    // Written out, for want of a map over arrays that compiles to as little.
    let across = [
        [turn(a[0], b[0]), turn(a[0], b[1])],
        [turn(a[1], b[0]), turn(a[1], b[1])],
    ];
    (0..2).all(|k| {
        let b_outside = across[0][k] == within_a.opposite() || across[1][k] == within_a;
        let a_outside = across[k][0] == within_b || across[k][1] == within_b.opposite();
        b_outside && a_outside
    })
}
