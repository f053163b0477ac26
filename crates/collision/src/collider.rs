//! A mesh prepared for many queries.

use std::sync::OnceLock;

use glam::Vec3;

use crate::bvh::Bvh;
use crate::error::MeshError;
use crate::mesh::TriangleMesh;
use crate::parallel;
use crate::places::Places;

/// A mesh with its bounding volume hierarchy, so that queries need not build one.
///
/// The hierarchy is in the mesh's own frame: any number of queries in any poses share it. Vertices may move; then it is
/// refitted, and when they have moved far apart, built again. Answers do not depend on it, only their speed.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use vertebra_collision::{Collider, Query, TriangleMesh};
/// use vertebra_spatial::Pose;
///
/// let tile = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let mut tile = Collider::new(tile);
/// let fixed = tile.clone();
/// let above = Pose::from_translation(DVec3::Z);
/// assert!(!Query::new(&fixed, &tile).pose_b(above)?.any()?);
/// // Bent down until a corner touches.
/// tile.set_vertices(vec![Vec3::NEG_Z, Vec3::X, Vec3::Y])?;
/// assert!(Query::new(&fixed, &tile).pose_b(above)?.any()?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Collider {
    mesh: TriangleMesh,
    bvh: Bvh,
    /// What the hierarchy cost when built.
    built_cost: f64,
    /// The place of each vertex, once asked for.
    places: OnceLock<Vec<u32>>,
}

impl Collider {
    /// Prepares a mesh, on one thread.
    #[must_use]
    pub fn new(mesh: TriangleMesh) -> Self {
        Self::on_threads(mesh, 1)
    }

    /// Prepares a mesh on at most this many threads of the current rayon pool; 0 uses all of them.
    #[must_use]
    pub fn on_threads(mesh: TriangleMesh, threads: usize) -> Self {
        let bvh = Bvh::new(&mesh, None, parallel::available(threads));
        let built_cost = bvh.cost();
        Self {
            mesh,
            bvh,
            built_cost,
            places: OnceLock::new(),
        }
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Gives the mesh back.
    #[must_use]
    pub fn into_mesh(self) -> TriangleMesh {
        self.mesh
    }

    /// Takes another mesh, whatever its vertices and triangles, and builds its hierarchy on one thread.
    ///
    /// For bodies that break or are cut: references to the collider stay, triangle indices are those of the new mesh.
    pub fn replace(&mut self, mesh: TriangleMesh) {
        *self = Self::new(mesh);
    }

    /// Moves the vertices \[m], as many as there are, and refits the hierarchy to them.
    ///
    /// # Errors
    ///
    /// Another number of vertices, or a coordinate that is not finite; then nothing changes.
    pub fn set_vertices(&mut self, vertices: Vec<Vec3>) -> Result<(), MeshError> {
        self.mesh.set_vertices(vertices)?;
        self.bvh.refit(&self.mesh, 1);
        self.places.take();
        Ok(())
    }

    /// What a query costs with the refitted hierarchy relative to when it was built: the surface of all boxes, in units
    /// of that of the whole, divided by what it was \[1].
    ///
    /// Beyond 1.5 to 2 it pays to [`rebuild`](Self::rebuild).
    #[must_use]
    pub fn degradation(&self) -> f64 {
        self.bvh.cost() / self.built_cost
    }

    /// Builds the hierarchy again, for where the vertices are now.
    pub fn rebuild(&mut self) {
        self.bvh = Bvh::new(&self.mesh, None, 1);
        self.built_cost = self.bvh.cost();
    }

    pub(crate) fn places(&self) -> &[u32] {
        self.places.get_or_init(|| Places::of_vertices(&self.mesh))
    }

    pub(crate) fn bvh(&self) -> &Bvh {
        &self.bvh
    }
}
