//! What the kernels of triangle collision and the host both read.

use bytemuck::{Pod, Zeroable};

#[expect(unused_imports, reason = "the documentation names them")]
use super::{
    ARRANGE, BLOCK_PAIRS, EXPAND_PAIRS, FIT_LEAVES, FIT_NODES, HILBERT, JOIN_PAIRS, PLACE_BODIES,
    QUALITY, SPLIT_PAIRS, moller, narrow, settle,
};

/// Triangles of a block, and children of a node.
pub const WIDTH: usize = 8;

/// The index of a triangle that fills up the last block.
pub const NONE: u32 = u32::MAX;

/// Coordinates are multiplied by this on the device.
pub const SCALE: f32 = 0.031_25;

/// Words of the record of an undecided pair: triangle of A, triangle of B, job, and the coordinates
/// of the corners.
pub const RECORD: usize = 21;

/// Pairs of blocks that a workgroup of [`narrow`] takes at a time.
pub const PAIRS_A_ROUND: u32 = 4;

/// Blocks of A, and of B, that a workgroup of [`BLOCK_PAIRS`] takes.
pub const TILE: u32 = 64;

/// Pairs of nodes that a workgroup of [`EXPAND_PAIRS`] takes at a time.
pub const EXPANDED_A_ROUND: u32 = 8;

/// Words before an answer: the numbers of hits, of pairs of blocks, of undecided pairs and of those left to the host, then of
/// pairs of nodes for each level above.
pub const COUNTERS: usize = 4 + LEVELS;

/// Children that a workgroup of [`FIT_LEAVES`] and [`FIT_NODES`] takes.
pub const FIT: u32 = 256;

/// A question about two meshes: where B stands, seen from A, and which blocks they have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Job {
    /// Row k: the matrix entries of coordinate k, and the translation in units of the device.
    pub rows: [[f32; 4]; 3],
    /// Error of a posed coordinate, in units of the sum of magnitudes.
    pub coordinate_error: f32,
    /// Error of a rotated edge, in units of the sum of magnitudes.
    pub edge_error: f32,
    /// The first workgroup of this job in a dispatch over the blocks of all.
    pub first_group: u32,
    /// 1 if the meshes are one, and a triangle is paired with those behind it.
    pub itself: u32,
    /// First block of A.
    pub a_first: u32,
    /// Number of blocks of A.
    pub a_blocks: u32,
    /// First block of B.
    pub b_first: u32,
    /// Number of blocks of B.
    pub b_blocks: u32,
    /// The pose of A, where poses come from a buffer.
    pub a_pose: u32,
    /// The pose of B.
    pub b_pose: u32,
    /// Fills up the alignment.
    pub unused: [u32; 2],
}

/// What [`BLOCK_PAIRS`] and [`EXPAND_PAIRS`] work on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Sizes {
    /// Number of jobs.
    pub jobs: u32,
    /// Workgroups of all jobs.
    pub groups: u32,
    /// Places in the queue.
    pub queue: u32,
    /// The level of the nodes that are compared.
    pub level: u32,
    /// Where it begins among the boxes of A.
    pub a_at: u32,
    /// Where it begins among the boxes of B.
    pub b_at: u32,
}

/// What [`narrow`], [`settle`] and [`moller`] have room for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Places {
    /// Places in the queue.
    pub queue: u32,
    /// Places for hits.
    pub hits: u32,
    /// Places for undecided pairs.
    pub undecided: u32,
    /// Places for those of them that are left to the host.
    pub left: u32,
    /// Words of an answer for one job, or of a row of the matrix.
    pub answer: u32,
    /// Words of the part of it that is about A.
    pub answer_a: u32,
    /// First row of the matrix.
    pub row: u32,
    /// Number of its rows.
    pub rows: u32,
}

/// The levels that one dispatch of [`FIT_LEAVES`] or [`FIT_NODES`] is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Levels {
    /// Number of children.
    pub children: u32,
    /// The first child.
    pub children_at: u32,
    /// Number of parents.
    pub parents: u32,
    /// The first parent.
    pub parents_at: u32,
    /// Number of grandparents; none are written if it is zero.
    pub grandparents: u32,
    /// The first grandparent.
    pub grandparents_at: u32,
}

/// Levels that a [`Tree`] can have, blocks included: enough for 2^32 triangles.
pub const LEVELS: usize = 12;

/// The tree that [`QUALITY`] measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Tree {
    /// The level of the root.
    pub top: u32,
    /// Fills up the alignment.
    pub unused: [u32; 3],
    /// Where each level begins, how many nodes it has, and two words more.
    pub levels: [[u32; 4]; LEVELS],
}

/// What [`HILBERT`] and [`ARRANGE`] work on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Mesh {
    /// Number of triangles.
    pub triangles: u32,
    /// The node whose box is that of the mesh.
    pub root: u32,
}

/// What [`PLACE_BODIES`] works on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Bodies {
    /// Number of jobs.
    pub jobs: u32,
}

/// Words of a pose that [`PLACE_BODIES`] reads: quaternion x, y, z, w; translation; one that does not
/// count.
pub const POSE: usize = 8;

/// Triangles of A, and of B, that a workgroup of [`moller`] takes.
pub const MOLLER_TILE: [usize; 2] = [64, 512];

/// What [`SPLIT_PAIRS`] and [`JOIN_PAIRS`] work on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Split {
    /// Places in the list.
    pub pairs: u32,
    /// 1 if the lesser triangle of a pair comes first.
    pub ordered: u32,
}

/// What [`moller`] takes as zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Tolerance {
    /// Distances times twice the area below this.
    pub epsilon: f32,
}

/// Bits of the keys of [`HILBERT`].
pub const HILBERT_BITS: u32 = 30;
