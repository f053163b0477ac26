//! Kernels for many states of one model: the articulated-body algorithm, integrators, poses.

use bytemuck::{Pod, Zeroable};
use vertebra_gpu::{Binding, Kernel};

use crate::Precision;
use crate::parts::{CHOLESKY, JOINT, ROTATION, SPATIAL};

/// Sizes of a batch and of a run, which its kernels read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct BatchPlan {
    /// Workgroups of [`BATCH_ITEMS`] items.
    pub groups: u32,
    /// Items with padding: the distance of components in arrays.
    pub stride: u32,
    /// Bodies that a lane does at most; to [`batch_poses`] their number.
    pub levels: u32,
    /// Steps to take.
    pub steps: u32,
    /// Steps taken before.
    pub done: u32,
    /// Which half of the state is the current one.
    pub half: u32,
    /// Length of q.
    pub positions: u32,
    /// Length of qd.
    pub dofs: u32,
}

/// A body and its joint, as the kernels of a batch read it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct BatchLink {
    /// Kind of the joint, as in [`JOINT`]; 5 for none.
    pub kind: u32,
    /// Slot of the parent, [`u32::MAX`] for the world.
    pub parent: u32,
    /// First row of q.
    pub position: u32,
    /// First row of qd.
    pub dof: u32,
    /// 1 if the same lane did the parent just before; 2 if other bodies read what this one finds.
    pub flags: u32,
    /// Where it leaves what it hands on.
    pub handoff: u32,
    /// The first place where a child left something.
    pub first: u32,
    /// How many did.
    pub gathered: u32,
    /// Which of the bodies with forces it is, [`u32::MAX`] for none.
    pub pushed: u32,
}

/// Items of a workgroup.
pub const BATCH_ITEMS: u32 = 32;

/// Numbers of lanes among which the bodies of an item may be shared out.
pub const BATCH_LANES: [u32; 4] = [1, 2, 4, 8];

/// What a batch does with joint accelerations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BatchFinish {
    /// Gives them.
    Accelerations,
    /// Takes steps of the semi-implicit Euler method.
    Euler,
    /// Takes steps of the classical Runge-Kutta method.
    RungeKutta,
}

/// What a model has and others may not: kernels are compiled without the rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchFeatures {
    /// Prismatic joints.
    pub prismatic: bool,
    /// Spherical joints.
    pub spherical: bool,
    /// Free joints.
    pub free: bool,
    /// Forces on bodies.
    pub forces: bool,
}

impl BatchFeatures {
    /// Everything.
    pub const ALL: Self = Self {
        prismatic: true,
        spherical: true,
        free: true,
        forces: true,
    };

    /// Places of four numbers that a body takes in the scratch.
    #[must_use]
    pub fn record(self) -> u32 {
        4 + u32::from(self.spherical) + 3 * u32::from(self.forces)
    }
}

/// Places of four numbers that what a body hands on takes in the scratch.
pub const BATCH_HANDOFF: u32 = 8;

const PLAN: &str = include_str!("../wgsl/batch/plan.wgsl");
const ADVANCE: &str = include_str!("../wgsl/batch/advance.wgsl");

const BINDINGS: &[Binding] = &[
    Binding::uniform::<BatchPlan>("plan"),
    Binding::read::<BatchLink>("links"),
    Binding::read::<[f32; 4]>("constants"),
    Binding::read::<f32>("forces"),
    Binding::read_write::<f32>("state"),
    Binding::read_write::<f32>("result"),
    Binding::read_write::<[f32; 4]>("scratch"),
    Binding::read_write::<u32>("status"),
];

/// Needs the precision's parts, lanes, and a way to finish.
const fn batch_for(workgroup: [u32; 3]) -> Kernel {
    Kernel::new(
        "batch",
        &[
            include_str!("../wgsl/batch/batch.wgsl"),
            include_str!("../wgsl/batch/memory.wgsl"),
            include_str!("../wgsl/batch/look.wgsl"),
            include_str!("../wgsl/batch/descend.wgsl"),
            include_str!("../wgsl/batch/ascend.wgsl"),
            include_str!("../wgsl/batch/respond.wgsl"),
            PLAN,
            SPATIAL,
            CHOLESKY,
            ROTATION,
            JOINT,
        ],
        BINDINGS,
        workgroup,
    )
}

/// The kernel that computes what `finish` says, the bodies of an item shared out among so many of
/// [`BATCH_LANES`]; one lane for another number.
#[must_use]
pub fn batch(
    precision: Precision,
    finish: BatchFinish,
    features: BatchFeatures,
    lanes: u32,
) -> Kernel {
    let (kernel, lanes_part) = match lanes {
        2 => (batch_for([BATCH_ITEMS, 2, 1]), "const LANES: u32 = 2u;"),
        4 => (batch_for([BATCH_ITEMS, 4, 1]), "const LANES: u32 = 4u;"),
        8 => (batch_for([BATCH_ITEMS, 8, 1]), "const LANES: u32 = 8u;"),
        _ => (batch_for([BATCH_ITEMS, 1, 1]), "const LANES: u32 = 1u;"),
    };
    let kernel = in_precision(kernel, precision, &["forces", "state", "result"])
        .stride("scratch", 4 * precision.bytes())
        .with(lanes_part)
        .constant("HAS_PRISMATIC", u32::from(features.prismatic))
        .constant("HAS_SPHERICAL", u32::from(features.spherical))
        .constant("HAS_FREE", u32::from(features.free))
        .constant("HAS_FORCES", u32::from(features.forces))
        .constant("FLOOR", 4.0 * precision.epsilon());
    match finish {
        BatchFinish::Accelerations => kernel.with(include_str!("../wgsl/batch/accelerations.wgsl")),
        BatchFinish::Euler => kernel
            .with(ADVANCE)
            .with(include_str!("../wgsl/batch/euler.wgsl")),
        BatchFinish::RungeKutta => kernel
            .with(ADVANCE)
            .with(include_str!("../wgsl/batch/runge_kutta.wgsl")),
    }
}

/// The kernel that gives the poses of all bodies, component-major over the items.
#[must_use]
pub fn batch_poses(precision: Precision) -> Kernel {
    const POSES: Kernel = Kernel::new(
        "batch_poses",
        &[
            include_str!("../wgsl/batch/poses.wgsl"),
            PLAN,
            SPATIAL,
            ROTATION,
            JOINT,
        ],
        &[
            Binding::uniform::<BatchPlan>("plan"),
            Binding::read::<BatchLink>("links"),
            Binding::read::<[f32; 4]>("constants"),
            Binding::read::<f32>("state"),
            Binding::read_write::<[f32; 8]>("poses"),
        ],
        [64, 1, 1],
    );
    in_precision(POSES, precision, &["state"]).stride("poses", 8 * precision.bytes())
}

/// The precision's parts; `numbers` are bindings of single numbers, `constants` has four each.
fn in_precision(kernel: Kernel, precision: Precision, numbers: &[&str]) -> Kernel {
    let kernel = kernel
        .requires(precision.features())
        .with(precision.part())
        .with(precision.trigonometry())
        .stride("constants", 4 * precision.bytes());
    numbers.iter().fold(kernel, |kernel, binding| {
        kernel.stride(binding, precision.bytes())
    })
}

/// Every kernel of this file, with what it is.
pub(crate) fn all() -> Vec<(String, Kernel)> {
    let mut kernels = Vec::new();
    for precision in [Precision::F32, Precision::F64] {
        let poses = batch_poses(precision);
        kernels.push((format!("{} {precision:?}", poses.name()), poses));
        for finish in [
            BatchFinish::Accelerations,
            BatchFinish::Euler,
            BatchFinish::RungeKutta,
        ] {
            for lanes in BATCH_LANES {
                let kernel = batch(precision, finish, BatchFeatures::ALL, lanes);
                let name = format!("{} {finish:?} {precision:?} x {lanes}", kernel.name());
                kernels.push((name, kernel));
            }
        }
    }
    kernels
}
