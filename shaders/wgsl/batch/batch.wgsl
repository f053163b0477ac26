// The articulated-body algorithm for many states of one model (Featherstone; RBDA section 7.3), in body
// axes: what does not depend on the state is then the same for all items, U of a joint about z is a column
// of IA, and of what a joint lets go nothing has to be turned.
//
// A workgroup has 32 items; its lanes x are items, its lanes y share the bodies of each out among
// themselves: in level k lane y of all items does the body in slot k LANES + y, so that lanes side by
// side always do the same, and arrays are component-major over the items. A body whose parent is the
// body that its lane did before finds it in registers; others find it in the scratch.
//
// Down: w, c, from R' = the turn from child to parent axes. Up: IA, pA; with W = U / D,
// Ia = IA - U W', pa = pA + Ia c + W u. Down: of the joint's own components, a = D^-1 u - W'a' without
// those components, qdd = a - a'. Nothing that cancels is ever added to a.

override HAS_PRISMATIC: u32 = 1u;
override HAS_SPHERICAL: u32 = 1u;
override HAS_FREE: u32 = 1u;
// Whether forces act on bodies.
override HAS_FORCES: u32 = 1u;
// A pivot that is not above this part of the inertia let go before is rounding.
override FLOOR: f32 = 0.0;

const ITEMS: u32 = 32u;
// No body in this slot.
const IDLE: u32 = 5u;
// The parent is the body that this lane did before.
const FOLLOWS: u32 = 1u;
// Some child is not done by this lane next.
const KEPT: u32 = 2u;

const SINGULAR: u32 = 1u;
const WILD_ACCELERATION: u32 = 2u;
const WILD_STATE: u32 = 3u;
const LARGE_ANGLE: u32 = 4u;

@group(0) @binding(0) var<uniform> plan: BatchPlan;
@group(0) @binding(1) var<storage, read> links: array<BatchLink>;
// Minus gravity and the step; then of each slot six: joint axes on the parent by columns with the
// origin's coordinates, first moment and mass, rotational inertia.
@group(0) @binding(2) var<storage, read> constants: array<vec4<real>>;
// Joint forces by freedoms, then 21 numbers of each body with forces.
@group(0) @binding(3) var<storage, read> forces: array<real>;
// q and qd, twice.
@group(0) @binding(4) var<storage, read_write> state: array<real>;
@group(0) @binding(5) var<storage, read_write> result: array<real>;
@group(0) @binding(6) var<storage, read_write> scratch: array<vec4<real>>;
// Of each item the complement of 8 slot + why, for the first that failed, and in which step.
@group(0) @binding(7) var<storage, read_write> status: array<atomic<u32>>;

// Accelerations of the state at `source`, each handed to `finish`.
fn forward_dynamics(lane: u32) {
    if plan.levels == 0u {
        return;
    }
    var turning: Turning;
    var ahead = look(0u, lane, DESCEND);
    for (var level = 0u; level < plan.levels; level++) {
        let seen = ahead;
        ahead = look(level + 1u, lane, DESCEND);
        if seen.link.kind != IDLE {
            turning = descend(level * LANES + lane, seen, turning);
        }
        meet();
    }
    var passed = nothing_passed();
    let last = plan.levels - 1u;
    ahead = look(last, lane, ASCEND);
    for (var k = 0u; k < plan.levels; k++) {
        let level = last - k;
        let seen = ahead;
        ahead = look(max(level, 1u) - 1u, lane, ASCEND);
        let link = seen.link;
        if link.kind != IDLE {
            passed = ascend(level * LANES + lane, seen, passed);
            if (link.flags & FOLLOWS) == 0u {
                if link.parent != NONE {
                    leave(record(plan.levels * LANES) + 8u * link.handoff, passed);
                }
                passed = nothing_passed();
            }
        }
        meet();
    }
    var a = motion_zero();
    ahead = look(0u, lane, RESPOND);
    for (var level = 0u; level < plan.levels; level++) {
        let seen = ahead;
        ahead = look(level + 1u, lane, RESPOND);
        if seen.link.kind != IDLE {
            a = respond(level * LANES + lane, seen, a);
        }
        meet();
    }
}

@compute @workgroup_size(32, LANES)
fn main(
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let group = group_id.y * groups.x + group_id.x;
    if group >= plan.groups {
        return;
    }
    item = group * ITEMS + local.x;
    let lane = local.y;
    let half = plan.positions + plan.dofs;
    start = plan.half * half;
    next = (1u - plan.half) * half;
    halted = atomicLoad(&status[2u * item]) != 0u;
    for (var i = 0u; i < plan.steps; i++) {
        step_number = i;
        for (var k = 0u; k < STAGES; k++) {
            stage = k;
            source = select(next, start, stage == 0u);
            forward_dynamics(lane);
        }
        halted = atomicLoad(&status[2u * item]) != 0u;
        for (var level = 0u; level < plan.levels; level++) {
            let slot = level * LANES + lane;
            if links[slot].kind != IDLE {
                commit(links[slot]);
            }
        }
        meet();
        let swapped = start;
        start = next;
        next = swapped;
    }
}
