// For models no chunk of which ends with a leaf.

const HAS_LEAVES = false;

fn with_leaf(is_head: bool, a: Node, slot: u32, share: real, index: u32) -> Node { return a; }

fn leaf_force(slot: u32, index: u32, x: Force, f2: Force) -> Force { return force_zero(); }

fn respond_leaf(
    index: u32,
    slot: u32,
    spin: vec3<real>,
    arm: vec3<real>,
    kind: u32,
    axes: mat3x3<real>,
    f2: Force,
    force: Force,
    given: Motion,
) -> Response {
    return Response(given, motion_zero());
}
