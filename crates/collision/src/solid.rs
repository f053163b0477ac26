//! The inside of closed meshes.

use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use crate::bounds::{Bounds, lanes};
use crate::bvh::Bvh;
use crate::error::QueryError;
use crate::exact::triangles_intersect;
use crate::mesh::TriangleMesh;
use crate::operand::Operand;
use crate::parallel;
use crate::places::Places;
use crate::predicates::{Sign, orient2d, orient3d};
use crate::query::Query;
use crate::transform::RelativePose;
use crate::traverse::Tree;

/// Coordinates of points smaller than this count as zero \[m].
const NEGLIGIBLE: f64 = f64::from_bits((1023 - 401) << 52);

/// No mesh reaches this far \[m].
const FARTHEST: f64 = f64::from_bits((1023 + 131) << 52);

/// Where a point is against a closed surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Location {
    /// Rays from it pass the surface an odd number of times.
    Inside,
    /// On a triangle.
    OnSurface,
    /// Rays from it pass the surface an even number of times.
    Outside,
}

/// A closed mesh and its inside.
///
/// Closed means that every side belongs to an even number of triangles, where vertices of equal position are the same;
/// then the inside is what rays leave by an odd number of passages. No orientation is asked for. All answers are exact.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use vertebra_collision::{Location, RelativePose, Solid, TriangleMesh};
///
/// let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
/// let faces = vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
/// let tetrahedron = TriangleMesh::new(corners, faces)?;
/// let solid = Solid::new(&tetrahedron)?;
/// assert_eq!(solid.locate(DVec3::splat(0.25))?, Location::Inside);
/// assert_eq!(solid.locate(DVec3::ZERO)?, Location::OnSurface);
/// assert_eq!(solid.locate(DVec3::ONE)?, Location::Outside);
///
/// let small = tetrahedron.vertices().iter().map(|&v| v * 0.2 + Vec3::splat(0.1)).collect();
/// let small = TriangleMesh::new(small, tetrahedron.triangles().to_vec())?;
/// assert!(solid.contains(&small, &RelativePose::IDENTITY)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Solid<'a> {
    operand: Operand<'a>,
    tree: Tree<'a>,
    threads: usize,
}

impl<'a> Solid<'a> {
    /// The solid in a [`TriangleMesh`] or a [`Collider`](crate::Collider), which saves building a hierarchy.
    ///
    /// # Errors
    ///
    /// [`QueryError::NotClosed`] with a side that belongs to an odd number of triangles.
    pub fn new(mesh: impl Into<Operand<'a>>) -> Result<Self, QueryError> {
        let operand = mesh.into();
        check_closed(operand.mesh())?;
        let everything = Bounds::of(operand.mesh().vertices());
        let tree = operand.tree(&everything, 1);
        Ok(Self {
            operand,
            tree,
            threads: 1,
        })
    }

    /// Uses at most this many threads of the current rayon pool for many points and for meshes; 0 uses all of them, and
    /// one is the default.
    #[must_use]
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// Where each of many points is, in their order: as [`locate`](Self::locate) says of one.
    ///
    /// # Errors
    ///
    /// [`QueryError::NonFinitePoint`] with the first such point.
    pub fn locate_all(&self, points: &[DVec3]) -> Result<Vec<Location>, QueryError> {
        let threads = parallel::available(self.threads);
        let locate = |index: usize| self.locate(points[index]);
        parallel::map(threads, points.len(), locate)
            .into_iter()
            .collect()
    }

    /// Where a point is, in the frame of the mesh \[m]. Coordinates below 2^-401 in magnitude count as zero.
    ///
    /// The ray goes up, along z, from the point moved by (e, e^2, 0) for an e smaller than any positive number. So it
    /// passes no side and no vertex, and the orientation signs of its projection are never zero, unless two corners
    /// project to one point. A point in the plane of a triangle is on the triangle or beside its moved ray.
    ///
    /// # Errors
    ///
    /// [`QueryError::NonFinitePoint`].
    pub fn locate(&self, point: DVec3) -> Result<Location, QueryError> {
        if !point.is_finite() {
            return Err(QueryError::NonFinitePoint {
                point: point.to_array(),
            });
        }
        if point.abs().max_element() >= FARTHEST {
            return Ok(Location::Outside);
        }
        let clean = |x: f64| if x.abs() < NEGLIGIBLE { 0.0 } else { x };
        let point = DVec3::from(point.to_array().map(clean));
        let mut ray = Bounds::around(&[point; 3]);
        ray.max[2] = f32::INFINITY;
        let mut passages = 0_u32;
        let on_surface = search(&self.tree.bvh, &ray, &mut |triangle| {
            let corners = self.tree.mesh.wide_triangle(triangle);
            let [a, b, c] = corners;
            match orient3d(a, b, c, point) {
                Sign::Zero if triangles_intersect(&[point; 3], &corners) => {
                    return ControlFlow::Break(());
                }
                Sign::Zero => {}
                side => {
                    let turns = [(a, b), (b, c), (c, a)].map(|(u, v)| moved_side(u, v, point));
                    let surrounded = turns[0] == turns[1] && turns[1] == turns[2];
                    // Counter-clockwise from above, the triangle has what is below it on its negative side.
                    if surrounded && side == turns[0].opposite() {
                        passages += 1;
                    }
                }
            }
            ControlFlow::Continue(())
        });
        Ok(match on_surface {
            ControlFlow::Break(()) => Location::OnSurface,
            ControlFlow::Continue(()) if passages % 2 == 1 => Location::Inside,
            ControlFlow::Continue(()) => Location::Outside,
        })
    }

    /// Whether another mesh, in that pose seen from this one, lies wholly inside: it has no triangle that meets one of
    /// this surface, and every connected part of it is inside.
    ///
    /// # Errors
    ///
    /// What [`Query::any`] says; nothing for the poses that [`RelativePose::between`] gives.
    pub fn contains<'b>(
        &'b self,
        other: impl Into<Operand<'b>>,
        pose: &RelativePose,
    ) -> Result<bool, QueryError> {
        let other = other.into();
        let query = Query::new(self.operand, other).relative(*pose);
        if query.threads(self.threads).any()? {
            return Ok(false);
        }
        for vertex in one_vertex_a_part(other.mesh()) {
            let point = pose.apply(other.mesh().vertices()[vertex as usize]);
            if self.locate(point)? != Location::Inside {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// On which side of the line from u to v, all projected along z, the moved point lies.
///
/// The sign of orient2d(u, v, p), or else that of its change with x, which is -(v.y - u.y), or else with y.
fn moved_side(u: DVec3, v: DVec3, p: DVec3) -> Sign {
    let flat = |p: DVec3| DVec2::new(p.x, p.y);
    match orient2d(flat(u), flat(v), flat(p)) {
        Sign::Zero if u.y != v.y => Sign::Positive.times(u.y > v.y),
        Sign::Zero if u.x != v.x => Sign::Positive.times(v.x > u.x),
        side => side,
    }
}

/// Hands over the triangles whose boxes share a point with the region, until it breaks.
fn search(
    bvh: &Bvh,
    region: &Bounds,
    found: &mut impl FnMut(u32) -> ControlFlow<()>,
) -> ControlFlow<()> {
    fn visit(
        bvh: &Bvh,
        region: &Bounds,
        (level, node): (usize, usize),
        found: &mut impl FnMut(u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mask = bvh.level(level)[node].overlaps(region) & bvh.children(level, node);
        for lane in lanes(mask) {
            if level == 0 {
                found(bvh.leaf(node)[lane])?;
            } else {
                visit(
                    bvh,
                    region,
                    (level - 1, node * crate::bounds::LANES + lane),
                    found,
                )?;
            }
        }
        ControlFlow::Continue(())
    }
    visit(bvh, region, (bvh.top(), 0), found)
}

/// Every side must belong to an even number of triangles.
fn check_closed(mesh: &TriangleMesh) -> Result<(), QueryError> {
    let points: Vec<DVec3> = mesh.vertices().iter().map(|v| v.as_dvec3()).collect();
    let places = Places::of(&points).numbers;
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * mesh.len());
    for (triangle, corners) in (0..).zip(mesh.triangles()) {
        for side in [[0, 1], [1, 2], [2, 0]] {
            let mut ends = side.map(|corner: usize| places[corners[corner] as usize]);
            ends.sort_unstable();
            if ends[0] != ends[1] {
                sides.push((ends, triangle));
            }
        }
    }
    sides.sort_unstable();
    let odd = sides
        .chunk_by(|left, right| left.0 == right.0)
        .find(|same| same.len() % 2 == 1);
    match odd.and_then(|same| same.first()) {
        None => Ok(()),
        Some(&(ends, triangle)) => {
            let corners = mesh.triangles()[triangle as usize];
            let own = |end: u32| corners.into_iter().find(|&v| places[v as usize] == end);
            Err(QueryError::NotClosed {
                triangle,
                side: ends.map(|end| own(end).unwrap_or(end)),
            })
        }
    }
}

/// A vertex of each part of a mesh whose triangles are connected by common vertices.
fn one_vertex_a_part(mesh: &TriangleMesh) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..).zip(mesh.vertices()).map(|(index, _)| index).collect();
    // The first vertex of a part, halving the way there.
    fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
        while parents[vertex as usize] != vertex {
            let above = parents[parents[vertex as usize] as usize];
            parents[vertex as usize] = above;
            vertex = above;
        }
        vertex
    }
    for &[a, b, c] in mesh.triangles() {
        for other in [b, c] {
            let (one, other) = (root(&mut parents, a), root(&mut parents, other));
            parents[one.max(other) as usize] = one.min(other);
        }
    }
    let mut roots: Vec<u32> = mesh
        .triangles()
        .iter()
        .map(|&[a, ..]| root(&mut parents, a))
        .collect();
    roots.sort_unstable();
    roots.dedup();
    roots
}
