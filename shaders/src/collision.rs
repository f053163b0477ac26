//! Kernels of triangle collision: pairs of blocks whose boxes overlap, the certified test of their
//! triangles, and the boxes.
//!
//! What they are for, and how they fit together, stands in `vertebra-collision`, which records them.

use bytemuck::{Pod, Zeroable};
use vertebra_gpu::{Binding, Kernel, STATUS};

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

/// What [`BLOCK_PAIRS`] works on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Sizes {
    /// Number of jobs.
    pub jobs: u32,
    /// Workgroups of all jobs.
    pub groups: u32,
    /// Places in the queue.
    pub queue: u32,
}

/// What [`narrow`] has room for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Places {
    /// Places in the queue.
    pub queue: u32,
    /// Places for hits.
    pub hits: u32,
    /// Places for undecided pairs.
    pub undecided: u32,
    /// The word at which undecided pairs begin.
    pub undecided_at: u32,
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

/// The tree that [`TREE_PAIRS`] descends.
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

/// What [`MORTON`] and [`ARRANGE`] work on.
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

/// What becomes of the pairs that meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Whether there is one: a word a job.
    Any,
    /// How many: a word a job.
    Count,
    /// Which triangles are in one: a bit a triangle.
    Mask,
    /// All: three words each.
    Pairs,
    /// A bit for each pair of triangles, of some rows.
    Matrix,
}

impl Answer {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Any,
        Self::Count,
        Self::Mask,
        Self::Pairs,
        Self::Matrix,
    ];

    fn part(self) -> &'static str {
        match self {
            Self::Any => include_str!("../wgsl/collision/hit_any.wgsl"),
            Self::Count => include_str!("../wgsl/collision/hit_count.wgsl"),
            Self::Mask => include_str!("../wgsl/collision/hit_mask.wgsl"),
            Self::Pairs => include_str!("../wgsl/collision/hit_pairs.wgsl"),
            Self::Matrix => include_str!("../wgsl/collision/hit_matrix.wgsl"),
        }
    }
}

const MESH: &str = include_str!("../wgsl/collision/mesh.wgsl");
const TREE: &str = include_str!("../wgsl/collision/tree.wgsl");
const QUEUE: &str = include_str!("../wgsl/collision/queue.wgsl");
const BOX_POSE: &str = include_str!("../wgsl/collision/box_pose.wgsl");
const JOB_OF: &str = include_str!("../wgsl/collision/job_of.wgsl");
const PLACES: &str = include_str!("../wgsl/collision/places.wgsl");
const COUNTS: &str = include_str!("../wgsl/collision/counts.wgsl");
const FIT_PART: &str = include_str!("../wgsl/collision/fit.wgsl");

/// Bytes of a vector of three in workgroup memory.
const VECTOR: u32 = 16;

/// Places the bodies of each job as their poses in a buffer say.
pub const PLACE_BODIES: Kernel = Kernel::new(
    "place_bodies",
    &[include_str!("../wgsl/collision/place_bodies.wgsl"), MESH],
    &[
        Binding::uniform::<Bodies>("bodies"),
        Binding::read::<f32>("poses"),
        Binding::read_write::<Job>("jobs"),
    ],
    [64, 1, 1],
);

/// Pairs of blocks whose boxes overlap, from every block of A against every block of B.
pub const BLOCK_PAIRS: Kernel = Kernel::new(
    "block_pairs",
    &[
        include_str!("../wgsl/collision/block_pairs.wgsl"),
        QUEUE,
        JOB_OF,
        BOX_POSE,
        MESH,
        COUNTS,
    ],
    &[
        Binding::uniform::<Sizes>("sizes"),
        Binding::read::<Job>("jobs"),
        Binding::read::<[f32; 4]>("boxes_a"),
        Binding::read::<[f32; 4]>("boxes_b"),
        Binding::read_write::<u32>("queue"),
        Binding::read_write::<u32>("counts"),
    ],
    [64, 1, 1],
)
.workgroup_memory_of(2 * TILE * VECTOR);

/// The same pairs from every block of B down the tree of A.
pub const TREE_PAIRS: Kernel = Kernel::new(
    "tree_pairs",
    &[
        include_str!("../wgsl/collision/tree_pairs.wgsl"),
        TREE,
        QUEUE,
        JOB_OF,
        BOX_POSE,
        MESH,
        COUNTS,
    ],
    &[
        Binding::uniform::<Sizes>("sizes"),
        Binding::read::<Job>("jobs"),
        Binding::read::<[f32; 4]>("boxes_a"),
        Binding::read::<[f32; 4]>("boxes_b"),
        Binding::read_write::<u32>("queue"),
        Binding::read_write::<u32>("counts"),
        Binding::uniform::<Tree>("tree"),
    ],
    [64, 1, 1],
);

/// Needs an answer, and a judge.
const NARROW: Kernel = Kernel::new(
    "narrow",
    &[
        include_str!("../wgsl/collision/narrow.wgsl"),
        include_str!("../wgsl/collision/decide.wgsl"),
        PLACES,
        MESH,
        COUNTS,
    ],
    &[
        Binding::uniform::<Places>("places"),
        Binding::read::<Job>("jobs"),
        Binding::read::<u32>("queue"),
        Binding::read::<u32>("vertices_a"),
        Binding::read::<[u32; 4]>("leaves_a"),
        Binding::read::<u32>("vertices_b"),
        Binding::read::<[u32; 4]>("leaves_b"),
        Binding::read_write::<u32>("counts"),
        Binding::read_write::<u32>("found"),
    ],
    [64, 1, 1],
)
// Names; boxes and corners; edges of B and their errors; the list; two counters.
.workgroup_memory_of(4 * 64 + 5 * 64 * VECTOR + 32 * (2 * VECTOR + 8) + 4 * 256 + 8);

/// Decides the pairs of triangles of the queued pairs of blocks; of a mesh and itself, each pair once
/// and neighbours only where they meet beyond their common corners. The constant `LEAVE_HITS` leaves
/// pairs that meet to the host like the undecided.
#[must_use]
pub fn narrow(answer: Answer, itself: bool) -> Kernel {
    let judge = if itself {
        include_str!("../wgsl/collision/judge_self.wgsl")
    } else {
        include_str!("../wgsl/collision/judge_pair.wgsl")
    };
    NARROW.with(answer.part()).with(judge)
}

/// Triangles of A, and of B, that a workgroup of [`moller`] takes.
pub const MOLLER_TILE: [usize; 2] = [64, 512];

/// What [`moller`] takes as zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Tolerance {
    /// Distances times twice the area below this.
    pub epsilon: f32,
}

/// Needs an answer.
const MOLLER: Kernel = Kernel::new(
    "moller",
    &[
        include_str!("../wgsl/collision/moller.wgsl"),
        JOB_OF,
        PLACES,
        MESH,
        COUNTS,
    ],
    &[
        Binding::uniform::<Sizes>("sizes"),
        Binding::uniform::<Places>("places"),
        Binding::uniform::<Tolerance>("tolerance"),
        Binding::read::<Job>("jobs"),
        Binding::read::<u32>("vertices_a"),
        Binding::read::<[u32; 4]>("leaves_a"),
        Binding::read::<u32>("vertices_b"),
        Binding::read::<[u32; 4]>("leaves_b"),
        Binding::read_write::<u32>("counts"),
        Binding::read_write::<u32>("found"),
    ],
    [64, 1, 1],
)
.workgroup_memory_of(32 * 80);

/// The interval test of Möller in single precision, every triangle against every other.
#[must_use]
pub fn moller(answer: Answer) -> Kernel {
    MOLLER.with(answer.part())
}

/// Boxes of blocks and of their parents; fails at vertices that are not finite.
pub const FIT_LEAVES: Kernel = Kernel::new(
    "fit_leaves",
    &[
        include_str!("../wgsl/collision/fit_leaves.wgsl"),
        FIT_PART,
        MESH,
        STATUS,
    ],
    &[
        Binding::uniform::<Levels>("levels"),
        Binding::read::<u32>("vertices"),
        Binding::read::<[u32; 4]>("leaves"),
        Binding::read_write::<[f32; 4]>("boxes"),
        Binding::read_write::<u32>("status"),
    ],
    [FIT, 1, 1],
)
.workgroup_memory_of(2 * FIT * VECTOR);

/// Boxes of two further levels.
pub const FIT_NODES: Kernel = Kernel::new(
    "fit_nodes",
    &[
        include_str!("../wgsl/collision/fit_nodes.wgsl"),
        FIT_PART,
        MESH,
    ],
    &[
        Binding::uniform::<Levels>("levels"),
        Binding::read_write::<[f32; 4]>("boxes"),
    ],
    [FIT, 1, 1],
)
.workgroup_memory_of(2 * FIT * VECTOR);

/// Where each triangle comes in the order of the tree, as keys to sort.
pub const MORTON: Kernel = Kernel::new(
    "morton",
    &[include_str!("../wgsl/collision/morton.wgsl"), MESH],
    &[
        Binding::uniform::<Mesh>("mesh"),
        Binding::read::<u32>("vertices"),
        Binding::read::<[u32; 4]>("triangles"),
        Binding::read::<[f32; 4]>("boxes"),
        Binding::read_write::<u32>("keys"),
        Binding::read_write::<u32>("values"),
    ],
    [256, 1, 1],
);

/// Bits of the keys of [`MORTON`].
pub const MORTON_BITS: u32 = 30;

/// Puts the triangles in that order.
pub const ARRANGE: Kernel = Kernel::new(
    "arrange",
    &[include_str!("../wgsl/collision/arrange.wgsl")],
    &[
        Binding::uniform::<Mesh>("mesh"),
        Binding::read::<[u32; 4]>("triangles"),
        Binding::read::<u32>("order"),
        Binding::read_write::<[u32; 4]>("leaves"),
    ],
    [256, 1, 1],
);

/// How well a tree sorts out, node by node.
pub const QUALITY: Kernel = Kernel::new(
    "quality",
    &[include_str!("../wgsl/collision/quality.wgsl"), TREE, MESH],
    &[
        Binding::uniform::<Tree>("tree"),
        Binding::read::<[f32; 4]>("boxes"),
        Binding::read_write::<f32>("entered"),
        Binding::read_write::<f32>("counted"),
    ],
    [256, 1, 1],
);

/// Every kernel as it can be dispatched, with what it is.
pub(crate) fn kernels() -> Vec<(String, Kernel)> {
    let plain = [
        PLACE_BODIES,
        BLOCK_PAIRS,
        TREE_PAIRS,
        FIT_LEAVES,
        FIT_NODES,
        MORTON,
        ARRANGE,
        QUALITY,
    ];
    let mut kernels: Vec<_> = plain
        .into_iter()
        .map(|kernel| (kernel.name().to_owned(), kernel))
        .collect();
    for answer in Answer::ALL {
        kernels.push((format!("moller {answer:?}"), moller(answer)));
        for itself in [false, true] {
            let of = if itself { "one mesh" } else { "two meshes" };
            kernels.push((format!("narrow {answer:?} of {of}"), narrow(answer, itself)));
        }
    }
    kernels
}
