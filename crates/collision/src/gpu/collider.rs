//! Meshes on a device.

use std::sync::{Arc, Mutex, PoisonError};

use glam::Vec3;
use vertebra_gpu::{Buffer, Device, Pending, Program, Recording, Slot, workgroups};
use vertebra_shaders::Sort;
use vertebra_shaders::collision::{
    ARRANGE, FIT, FIT_LEAVES, FIT_NODES, HILBERT, HILBERT_BITS, LEVELS, Levels, Mesh, NONE, Tree,
    WIDTH,
};

use super::error::Error;
use super::quality::Quality;
use crate::error::MeshError;
use crate::mesh::TriangleMesh;

/// A mesh on a device, with its tree.
///
/// The tree is made on the device: triangles along a Hilbert curve, eight in a row a block, eight blocks in a row a
/// node above, and so on.
///
/// Queries share it in any poses, and see its vertices where they are when they are asked. Vertices may be moved from
/// the host ([`set_vertices`](Self::set_vertices)), or by a kernel of the caller's on the device, which writes
/// [`vertices`](Self::vertices) and is followed by [`refit`](Self::refit).
#[derive(Debug)]
pub struct Collider {
    mesh: TriangleMesh,
    resident: Arc<Resident>,
    quality: Quality,
    /// The measure when the tree was built.
    built: f64,
}

/// What queries need of a mesh.
#[derive(Debug)]
pub(super) struct Resident {
    pub(super) device: Device,
    pub(super) vertices: Buffer<f32>,
    /// In the order of the tree.
    pub(super) leaves: Buffer<[u32; 4]>,
    /// In the order of the mesh.
    given: Buffer<[u32; 4]>,
    pub(super) boxes: Buffer<[f32; 4]>,
    pub(super) triangles: u32,
    /// Number of nodes of each level, blocks first.
    pub(super) levels: Vec<u32>,
    fit: Program,
    /// The last refit, whose outcome is not known yet, or is known to be a failure.
    refit: Mutex<Refit>,
}

#[derive(Debug)]
enum Refit {
    Fine,
    UnderWay(Pending),
    Failed(Error),
}

impl Collider {
    /// Prepares a mesh on a device.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`]; [`Error::Device`].
    pub fn new(device: &Device, mesh: TriangleMesh) -> Result<Self, Error> {
        let resident = Resident::new(device, &coordinates(&mesh), &leaves(&mesh), mesh.len())?;
        resident.rebuild()?;
        let above = resident.levels.iter().skip(1).sum();
        let quality = Quality::new(device, &resident.tree(), &resident.boxes, above)?;
        Ok(Self {
            mesh,
            built: quality.measure()?,
            quality,
            resident: Arc::new(resident),
        })
    }

    /// The mesh, as the host has set it.
    #[must_use]
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Gives the mesh back, as the host has set it.
    #[must_use]
    pub fn into_mesh(self) -> TriangleMesh {
        self.mesh
    }

    /// The coordinates of the vertices on the device, three words each \[m].
    #[must_use]
    pub fn vertices(&self) -> &Buffer<f32> {
        &self.resident.vertices
    }

    /// Moves the vertices \[m], as many as there are, and fits the boxes to them.
    ///
    /// # Errors
    ///
    /// Another number of vertices, or a coordinate that is not finite; then nothing changes. [`Error::Device`].
    pub fn set_vertices(&mut self, vertices: Vec<Vec3>) -> Result<(), Error> {
        self.mesh.set_vertices(vertices)?;
        let written = self.resident.vertices.write(&coordinates(&self.mesh));
        written.map_err(|error| self.resident.fail(error.into()))?;
        self.refit()
    }

    /// Fits the boxes to where the vertices are on the device, without waiting for it.
    ///
    /// If a coordinate is not finite, questions answer with [`MeshError::NonFiniteVertex`] until the vertices are
    /// moved again.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn refit(&mut self) -> Result<(), Error> {
        self.resident.refit()
    }

    /// Puts the triangles in order again, for where the vertices are now on the device. Worth it when triangles
    /// that were near each other have gone far apart; answers do not depend on it.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn rebuild(&mut self) -> Result<(), Error> {
        let rebuilt = self.resident.rebuild();
        rebuilt.map_err(|error| self.resident.fail(error))?;
        self.resident.check()?;
        self.built = self.quality.measure()?;
        Ok(())
    }

    /// How much worse the refitted tree sorts out than when it was built \[1]; waits for the device. Beyond 1.5 it pays to
    /// [`rebuild`](Self::rebuild): see [`crate::Collider::degradation`].
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn degradation(&self) -> Result<f64, Error> {
        Ok(self.quality.measure()? / self.built)
    }

    pub(super) fn resident(&self) -> &Arc<Resident> {
        &self.resident
    }
}

impl Resident {
    /// Triangles of a block.
    pub(super) const WIDTH: usize = WIDTH;

    /// From the coordinates of all vertices, and corners and index of each triangle, block by block.
    pub(super) fn new(
        device: &Device,
        coordinates: &[f32],
        given_leaves: &[[u32; 4]],
        triangles: usize,
    ) -> Result<Self, Error> {
        fits(device, "vertices", coordinates.len() / 3, 12)?;
        fits(device, "triangles", given_leaves.len(), 16)?;
        let mut levels = vec![count(given_leaves.len() / WIDTH)];
        while let Some(&last @ 2..) = levels.last() {
            levels.push(last.div_ceil(count(WIDTH)));
        }
        let nodes: u32 = levels.iter().sum();
        let vertices = device.buffer_from("vertices", coordinates)?;
        let given = device.buffer_from("triangles", given_leaves)?;
        let leaves = device.buffer_from("leaves", given_leaves)?;
        let boxes = device.buffer("boxes", 2 * nodes as usize)?;
        let mut recording = Recording::new("fit");
        let slots = Slots {
            vertices: recording.shared("vertices", vertices.len()),
            leaves: recording.shared("leaves", leaves.len()),
            boxes: recording.shared("boxes", boxes.len()),
        };
        record_fit(&mut recording, &slots, &levels);
        let shared = [
            slots.vertices.is(&vertices),
            slots.leaves.is(&leaves),
            slots.boxes.is(&boxes),
        ];
        Ok(Self {
            fit: device.prepare_with(&recording, &shared)?,
            device: device.clone(),
            vertices,
            leaves,
            given,
            boxes,
            triangles: count(triangles),
            levels,
            refit: Mutex::new(Refit::Fine),
        })
    }

    /// Fills up the last block.
    pub(super) fn fill_up(leaves: &mut Vec<[u32; 4]>) {
        leaves.resize(leaves.len().next_multiple_of(WIDTH), [0, 0, 0, NONE]);
    }

    /// Finds the box of the mesh, sorts its triangles, and fits the boxes.
    fn rebuild(&self) -> Result<(), Error> {
        self.refit()?;
        let mut recording = Recording::new("tree");
        let triangles = self.triangles as usize;
        let vertices = recording.shared("vertices", self.vertices.len());
        let given = recording.shared("triangles", self.given.len());
        let leaves = recording.shared("leaves", self.leaves.len());
        let boxes = recording.shared("boxes", self.boxes.len());
        let keys = recording.buffer::<u32>("keys", triangles);
        let order = recording.buffer::<u32>("order", triangles);
        let mesh = Mesh {
            triangles: self.triangles,
            root: self.levels.iter().sum::<u32>().saturating_sub(1),
        };
        let mesh = recording.buffer_from("mesh", &[mesh]);
        let groups = workgroups(self.triangles, 256);
        let buffers = [
            mesh.any(),
            vertices.any(),
            given.any(),
            boxes.any(),
            keys.any(),
            order.any(),
        ];
        recording.dispatch(&HILBERT, &buffers, groups);
        Sort::on(&self.device).record(&mut recording, keys, order, HILBERT_BITS);
        let buffers = [mesh.any(), given.any(), order.any(), leaves.any()];
        recording.dispatch(&ARRANGE, &buffers, groups);
        let shared = [
            vertices.is(&self.vertices),
            given.is(&self.given),
            leaves.is(&self.leaves),
            boxes.is(&self.boxes),
        ];
        let program = self.device.prepare_with(&recording, &shared)?;
        program.run()?.wait()?;
        self.refit()
    }

    pub(super) fn refit(&self) -> Result<(), Error> {
        let pending = self.fit.run().map_err(|error| self.fail(error.into()))?;
        *self.refit.lock().unwrap_or_else(PoisonError::into_inner) = Refit::UnderWay(pending);
        Ok(())
    }

    /// Boxes that may not be those of the triangles would hide pairs: until they are fitted again, questions answer
    /// with what went wrong.
    fn fail(&self, error: Error) -> Error {
        *self.refit.lock().unwrap_or_else(PoisonError::into_inner) = Refit::Failed(error.clone());
        error
    }

    /// The tree.
    pub(super) fn tree(&self) -> Tree {
        tree(&self.levels)
    }

    /// Number of blocks.
    pub(super) fn blocks(&self) -> u32 {
        self.levels.first().copied().unwrap_or(0)
    }

    /// The number of levels above the blocks.
    pub(super) fn top(&self) -> u32 {
        count(self.levels.len()).saturating_sub(1)
    }

    /// Where the nodes of a level begin among all.
    pub(super) fn level_at(&self, level: u32) -> u32 {
        self.levels.iter().take(level as usize).sum()
    }

    /// Says whether the last refit found a coordinate that is not finite. Does not wait if asked after a later run.
    pub(super) fn check(&self) -> Result<(), Error> {
        let mut refit = self.refit.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(*refit, Refit::UnderWay(_))
            && let Refit::UnderWay(pending) = std::mem::replace(&mut *refit, Refit::Fine)
            && let Err(error) = pending.wait()
        {
            *refit = Refit::Failed(non_finite(error));
        }
        match &*refit {
            Refit::Failed(error) => Err(error.clone()),
            _ => Ok(()),
        }
    }
}

/// The tree of these numbers of nodes a level.
fn tree(levels: &[u32]) -> Tree {
    let mut tree = Tree {
        top: count(levels.len()).saturating_sub(1),
        ..Tree::default()
    };
    let mut first = 0;
    for (place, &nodes) in tree.levels.iter_mut().zip(levels.iter().take(LEVELS)) {
        *place = [first, nodes, 0, 0];
        first += nodes;
    }
    tree
}

/// A failure of the refit in the words of meshes.
fn non_finite(error: vertebra_gpu::Error) -> Error {
    match error {
        vertebra_gpu::Error::Failed { failures, .. } => MeshError::NonFiniteVertex {
            vertex: failures.first().map_or(0, |first| first.element as usize),
        }
        .into(),
        other => other.into(),
    }
}

/// The buffers of a mesh in a recording.
struct Slots {
    vertices: Slot<f32>,
    leaves: Slot<[u32; 4]>,
    boxes: Slot<[f32; 4]>,
}

/// Two levels a dispatch, from the leaves up.
fn record_fit(recording: &mut Recording, slots: &Slots, levels: &[u32]) {
    let stage = recording.stage("vertices");
    let status = recording.status();
    let mut children = levels.first().map_or(0, |blocks| blocks * count(WIDTH));
    let mut children_at = 0;
    let mut parents_at = 0;
    for (number, pair) in levels.chunks(2).enumerate() {
        let (parents, grandparents) = (pair[0], pair.get(1).copied().unwrap_or(0));
        let fields = Levels {
            children,
            children_at,
            parents,
            parents_at,
            grandparents,
            grandparents_at: parents_at + parents,
        };
        let fields = recording.buffer_from("levels", &[fields]);
        let groups = workgroups(children, FIT);
        if number == 0 {
            let buffers = [
                fields.any(),
                slots.vertices.any(),
                slots.leaves.any(),
                slots.boxes.any(),
                status.any(),
            ];
            let kernel = FIT_LEAVES.constant("STAGE", stage);
            recording.dispatch(&kernel, &buffers, groups);
        } else {
            recording.dispatch(&FIT_NODES, &[fields.any(), slots.boxes.any()], groups);
        }
        children = grandparents;
        children_at = parents_at + parents;
        parents_at = children_at + grandparents;
    }
}

/// Refuses a mesh of more than the device's buffers hold.
fn fits(device: &Device, element: &'static str, count: usize, bytes: u64) -> Result<(), Error> {
    let limits = device.limits();
    let limit = [
        ("max_buffer_size", limits.max_buffer_size),
        (
            "max_storage_buffer_binding_size",
            limits.max_storage_buffer_binding_size,
        ),
    ];
    // Of a block that is not full, some places are filled up.
    let most = |available: u64| (available / bytes).saturating_sub(WIDTH as u64);
    for (limit, available) in limit {
        let fits = most(available);
        if count as u64 > fits {
            return Err(Error::TooLarge {
                element,
                count,
                fits,
                limit,
                available,
            });
        }
    }
    Ok(())
}

fn coordinates(mesh: &TriangleMesh) -> Vec<f32> {
    mesh.vertices().iter().flat_map(Vec3::to_array).collect()
}

/// Corners and index of each triangle, in the order of the mesh, the last block filled up.
fn leaves(mesh: &TriangleMesh) -> Vec<[u32; 4]> {
    let corners = mesh.triangles().iter().zip(0..);
    let mut leaves: Vec<_> = corners.map(|([p, q, r], i)| [*p, *q, *r, i]).collect();
    Resident::fill_up(&mut leaves);
    leaves
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a mesh has at most u32::MAX vertices and triangles"
)]
pub(super) fn count(len: usize) -> u32 {
    len as u32
}
