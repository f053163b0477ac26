//! Kernels of triangle collision: pairs of blocks whose boxes overlap, the certified test of their
//! triangles, and the boxes.
//!
//! What they are for, and how they fit together, stands in `vertebra-collision`, which records them.

mod layout;

use vertebra_gpu::{Binding, Kernel, STATUS};

pub use layout::{
    Bodies, COUNTERS, EXPANDED_A_ROUND, FIT, HILBERT_BITS, Job, LEVELS, Levels, MOLLER_TILE, Mesh,
    NONE, PAIRS_A_ROUND, POSE, Places, RECORD, SCALE, Sizes, Split, TILE, Tolerance, Tree, WIDTH,
};

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
const SIZES: &str = include_str!("../wgsl/collision/sizes.wgsl");
const JOB_OF: &str = include_str!("../wgsl/collision/job_of.wgsl");
const LEVELS_PART: &str = include_str!("../wgsl/collision/levels.wgsl");
const VERDICTS: &str = include_str!("../wgsl/collision/verdicts.wgsl");
const PLACES: &str = include_str!("../wgsl/collision/places.wgsl");
const COUNTS: &str = include_str!("../wgsl/collision/counts.wgsl");
const SPLIT_PART: &str = include_str!("../wgsl/collision/split.wgsl");
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

/// What kernels that find pairs of nodes are given; the last only those that read pairs too.
const PAIR_BINDINGS: [Binding; 7] = [
    Binding::uniform::<Sizes>("sizes"),
    Binding::read::<Job>("jobs"),
    Binding::read::<[f32; 4]>("boxes_a"),
    Binding::read::<[f32; 4]>("boxes_b"),
    Binding::read_write::<u32>("queue"),
    Binding::read_write::<u32>("counts"),
    Binding::read::<u32>("parents"),
];

/// Pairs of nodes of a level whose boxes overlap, from every node of A against every node of B.
pub const BLOCK_PAIRS: Kernel = Kernel::new(
    "block_pairs",
    &[
        include_str!("../wgsl/collision/block_pairs.wgsl"),
        QUEUE,
        SIZES,
        JOB_OF,
        LEVELS_PART,
        BOX_POSE,
        MESH,
        COUNTS,
    ],
    PAIR_BINDINGS.split_at(6).0,
    [64, 1, 1],
)
.workgroup_memory_of(2 * TILE * VECTOR);

/// The pairs of a level from those of the level above.
pub const EXPAND_PAIRS: Kernel = Kernel::new(
    "expand_pairs",
    &[
        include_str!("../wgsl/collision/expand_pairs.wgsl"),
        QUEUE,
        SIZES,
        LEVELS_PART,
        BOX_POSE,
        MESH,
        COUNTS,
    ],
    &PAIR_BINDINGS,
    [64, 1, 1],
)
.workgroup_memory_of(2 * 64 * VECTOR + 12);

/// Needs an answer, and a judge.
const NARROW: Kernel = Kernel::new(
    "narrow",
    &[
        include_str!("../wgsl/collision/narrow.wgsl"),
        include_str!("../wgsl/collision/decide.wgsl"),
        VERDICTS,
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
        Binding::read_write::<u32>("found"),
        Binding::read_write::<u32>("undecided"),
    ],
    [64, 1, 1],
)
// Names; boxes and corners; edges of B and their errors; the list; two counters.
.workgroup_memory_of(4 * 64 + 5 * 64 * VECTOR + 32 * (2 * VECTOR + 8) + 4 * 256 + 8);

/// Needs an answer.
const SETTLE: Kernel = Kernel::new(
    "settle",
    &[
        include_str!("../wgsl/collision/settle.wgsl"),
        include_str!("../wgsl/collision/integers.wgsl"),
        VERDICTS,
        PLACES,
        MESH,
        COUNTS,
    ],
    &[
        Binding::uniform::<Places>("places"),
        Binding::read::<Job>("jobs"),
        Binding::read::<u32>("records"),
        Binding::read_write::<u32>("found"),
        Binding::read_write::<u32>("left"),
    ],
    [64, 1, 1],
)
.workgroup_memory_of(4);

/// Decides in integers what [`narrow`] left undecided, where nothing is posed; the rest is left to the host. The constant
/// `LEAVE_HITS` leaves pairs that meet to it too.
#[must_use]
pub fn settle(answer: Answer) -> Kernel {
    SETTLE.with(answer.part())
}

/// Decides the pairs of triangles of the queued pairs of blocks; of a mesh and itself, each pair once
/// and neighbours only where they meet beyond their common corners. The constant `LEAVE_HITS` lists
/// pairs that meet like the undecided.
#[must_use]
pub fn narrow(answer: Answer, itself: bool) -> Kernel {
    let judge = if itself {
        include_str!("../wgsl/collision/judge_self.wgsl")
    } else {
        include_str!("../wgsl/collision/judge_pair.wgsl")
    };
    NARROW.with(answer.part()).with(judge)
}

/// Needs an answer.
const MOLLER: Kernel = Kernel::new(
    "moller",
    &[
        include_str!("../wgsl/collision/moller.wgsl"),
        SIZES,
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
pub const HILBERT: Kernel = Kernel::new(
    "hilbert",
    &[include_str!("../wgsl/collision/hilbert.wgsl"), MESH],
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

const SPLIT_BINDINGS: &[Binding] = &[
    Binding::uniform::<Split>("split"),
    Binding::read_write::<u32>("first"),
    Binding::read_write::<u32>("second"),
    Binding::read_write::<u32>("found"),
];

/// Lays a list of pairs out in two columns, to be sorted by either.
pub const SPLIT_PAIRS: Kernel = Kernel::new(
    "split_pairs",
    &[
        include_str!("../wgsl/collision/split_pairs.wgsl"),
        SPLIT_PART,
        COUNTS,
    ],
    SPLIT_BINDINGS,
    [256, 1, 1],
);

/// Makes a list of pairs of two columns.
pub const JOIN_PAIRS: Kernel = Kernel::new(
    "join_pairs",
    &[
        include_str!("../wgsl/collision/join_pairs.wgsl"),
        SPLIT_PART,
        COUNTS,
    ],
    SPLIT_BINDINGS,
    [256, 1, 1],
);

/// Every kernel as it can be dispatched, with what it is.
pub(crate) fn kernels() -> Vec<(String, Kernel)> {
    let plain = [
        PLACE_BODIES,
        BLOCK_PAIRS,
        EXPAND_PAIRS,
        FIT_LEAVES,
        FIT_NODES,
        HILBERT,
        ARRANGE,
        QUALITY,
        SPLIT_PAIRS,
        JOIN_PAIRS,
    ];
    let mut kernels: Vec<_> = plain
        .into_iter()
        .map(|kernel| (kernel.name().to_owned(), kernel))
        .collect();
    for answer in Answer::ALL {
        kernels.push((format!("moller {answer:?}"), moller(answer)));
        kernels.push((format!("settle {answer:?}"), settle(answer)));
        for itself in [false, true] {
            let of = if itself { "one mesh" } else { "two meshes" };
            kernels.push((format!("narrow {answer:?} of {of}"), narrow(answer, itself)));
        }
    }
    kernels
}
