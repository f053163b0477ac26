//! What queries are asked about.

use std::borrow::Cow;

use crate::bounds::Bounds;
use crate::bvh::Bvh;
use crate::collider::Collider;
use crate::mesh::TriangleMesh;
use crate::places::Places;
use crate::traverse::Tree;

/// A mesh as a query takes it: as it is, or prepared.
#[derive(Clone, Copy, Debug)]
pub enum Operand<'a> {
    /// A mesh without hierarchy; each query builds what it needs.
    Mesh(&'a TriangleMesh),
    /// A mesh with one.
    Collider(&'a Collider),
}

impl<'a> Operand<'a> {
    pub(crate) fn mesh(self) -> &'a TriangleMesh {
        match self {
            Self::Mesh(mesh) => mesh,
            Self::Collider(collider) => collider.mesh(),
        }
    }

    /// The number of triangles that are in no hierarchy yet.
    pub(crate) fn unprepared(self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.len(),
            Self::Collider(_) => 0,
        }
    }

    pub(crate) fn bounds(self) -> Bounds {
        match self {
            Self::Mesh(mesh) => Bounds::of(mesh.vertices()),
            Self::Collider(collider) => collider.bvh().bounds(),
        }
    }

    /// The place of each vertex; a prepared mesh keeps them.
    pub(crate) fn places(self) -> Cow<'a, [u32]> {
        match self {
            Self::Mesh(mesh) => Cow::Owned(Places::of_vertices(mesh)),
            Self::Collider(collider) => Cow::Borrowed(collider.places()),
        }
    }

    /// A tree over at least the triangles that reach into the region.
    pub(crate) fn tree(self, region: &Bounds, threads: usize) -> Tree<'a> {
        let mesh = self.mesh();
        let bvh = match self {
            Self::Mesh(mesh) => Cow::Owned(Bvh::new(mesh, Some(region), threads)),
            Self::Collider(collider) => Cow::Borrowed(collider.bvh()),
        };
        Tree { mesh, bvh }
    }
}

impl<'a> From<&'a TriangleMesh> for Operand<'a> {
    fn from(mesh: &'a TriangleMesh) -> Self {
        Self::Mesh(mesh)
    }
}

impl<'a> From<&'a Collider> for Operand<'a> {
    fn from(collider: &'a Collider) -> Self {
        Self::Collider(collider)
    }
}
