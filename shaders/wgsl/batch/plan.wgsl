// What the kernels of a batch read of the model and of the run: a body and its joint, and the sizes.

const NONE: u32 = 0xffffffffu;

struct BatchPlan {
    // Workgroups.
    groups: u32,
    // Items with padding: distance of components.
    stride: u32,
    // Bodies that a lane does at most.
    levels: u32,
    steps: u32,
    // Steps before these.
    done: u32,
    // Which half of the state is the current one.
    half: u32,
    positions: u32,
    dofs: u32,
}

struct BatchLink {
    kind: u32,
    // Slot of the parent.
    parent: u32,
    // First rows of q and qd.
    position: u32,
    dof: u32,
    flags: u32,
    // Where it leaves what it hands on, unless the parent follows in registers.
    handoff: u32,
    // What its children left: the first, and how many.
    first: u32,
    gathered: u32,
    // Which of the bodies with forces it is.
    pushed: u32,
}
