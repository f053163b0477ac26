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
/// refitted, and [`degradation`](Collider::degradation) says when to call [`rebuild`](Collider::rebuild), which nothing
/// does by itself. Answers do not depend on it, only their speed.
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
    /// The place of each vertex, once asked for.
    places: OnceLock<Vec<u32>>,
    /// How many children of a node queries entered when the hierarchy was built.
    built_entered: f64,
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
        let built_entered = bvh.entered();
        Self {
            mesh,
            bvh,
            places: OnceLock::new(),
            built_entered,
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

    /// How much worse the refitted hierarchy sorts out than when it was built \[1]: of how many children of a node a query
    /// must look, the mean over the nodes, divided by what it was.
    ///
    /// Beyond 1.5 it pays to [`rebuild`](Self::rebuild), unless it is the triangles themselves that have grown into each
    /// other: no order helps against that. No unit of length matters, and no single vertex, however far it has gone.
    #[must_use]
    pub fn degradation(&self) -> f64 {
        self.bvh.entered() / self.built_entered
    }

    /// Builds the hierarchy again, for where the vertices are now.
    pub fn rebuild(&mut self) {
        self.bvh = Bvh::new(&self.mesh, None, 1);
        self.built_entered = self.bvh.entered();
    }

    pub(crate) fn places(&self) -> &[u32] {
        self.places.get_or_init(|| Places::of_vertices(&self.mesh))
    }

    pub(crate) fn bvh(&self) -> &Bvh {
        &self.bvh
    }
}
