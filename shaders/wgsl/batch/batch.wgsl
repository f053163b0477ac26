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

var<private> item: u32;
var<private> step_number: u32;
var<private> stage: u32;
// Rows where the step starts and where it ends, and those of the state at hand.
var<private> start: u32;
var<private> next: u32;
var<private> source: u32;
// Whether this item failed in an earlier step.
var<private> halted: bool;

fn state_at(row: u32) -> real {
    return state[row * plan.stride + item];
}

fn set_state(row: u32, value: real) {
    state[row * plan.stride + item] = value;
}

fn force_at(row: u32) -> real {
    return forces[row * plan.stride + item];
}

fn state3(row: u32) -> vec3<real> {
    return vec3<real>(state_at(row), state_at(row + 1u), state_at(row + 2u));
}

fn force3(row: u32) -> vec3<real> {
    return vec3<real>(force_at(row), force_at(row + 1u), force_at(row + 2u));
}

fn quaternion_at(row: u32) -> vec4<real> {
    return vec4<real>(state3(row), state_at(row + 3u));
}

fn rates(link: BatchLink) -> u32 {
    return source + plan.positions + link.dof;
}

// A slot's records: [w, sine] and [c.linear, cosine], later the acceleration; then W and what is added
// to it; then the axes in the world.
fn record(slot: u32) -> u32 {
    return slot * (4u + HAS_SPHERICAL + 3u * HAS_FORCES);
}

fn scratch_at(place: u32) -> vec4<real> {
    return scratch[place * plan.stride + item];
}

fn set_scratch(place: u32, value: vec4<real>) {
    scratch[place * plan.stride + item] = value;
}

fn fail(slot: u32, why: u32) {
    if !halted {
        atomicMax(&status[2u * item], ~(8u * slot + why));
        atomicStore(&status[2u * item + 1u], plan.done + step_number);
    }
}

// What lanes of an item wrote is seen by all of them.
fn meet() {
    if LANES > 1u {
        storageBarrier();
    }
}

const DESCEND: u32 = 0u;
const ASCEND: u32 = 1u;
const RESPOND: u32 = 2u;

// What a sweep reads of a body that no other lane writes. It is read a level ahead, since few warps run
// at once and nothing else would hide the latency.
struct Seen {
    link: BatchLink,
    // Joint axes on the parent by columns, with the origin's coordinates.
    x: vec4<real>,
    y: vec4<real>,
    z: vec4<real>,
    // The first rate.
    rate: real,
    // The first coordinate on the way down, the first joint force on the way up.
    other: real,
    // The body's records.
    first: vec4<real>,
    second: vec4<real>,
    third: vec4<real>,
    fourth: vec4<real>,
}

fn look(level: u32, lane: u32, sweep: u32) -> Seen {
    // The level after the last is read again instead.
    let slot = min(level, plan.levels - 1u) * LANES + lane;
    let at = 1u + 6u * slot;
    var seen: Seen;
    seen.link = links[slot];
    seen.x = constants[at];
    seen.y = constants[at + 1u];
    seen.z = constants[at + 2u];
    seen.rate = state_at(rates(seen.link));
    let place = record(slot);
    if sweep == DESCEND {
        seen.other = state_at(source + seen.link.position);
    } else {
        seen.first = scratch_at(place);
        seen.second = scratch_at(place + 1u);
    }
    if sweep == ASCEND {
        seen.other = force_at(seen.link.dof);
    }
    if sweep == RESPOND {
        seen.third = scratch_at(place + 2u);
        seen.fourth = scratch_at(place + 3u);
    }
    return seen;
}

// Where a joint's child is against its parent: its axes by columns, and its origin.
struct Placement {
    axes: mat3x3<real>,
    origin: vec3<real>,
}

fn placement(seen: Seen, turn: vec2<real>) -> Placement {
    let link = seen.link;
    let x = seen.x;
    let y = seen.y;
    let z = seen.z;
    let axes = mat3x3<real>(x.xyz, y.xyz, z.xyz);
    let origin = vec3<real>(x.w, y.w, z.w);
    let row = source + link.position;
    if HAS_PRISMATIC != 0u && link.kind == PRISMATIC {
        return Placement(axes, origin + z.xyz * state_at(row));
    }
    if HAS_SPHERICAL != 0u && link.kind == SPHERICAL {
        return Placement(axes * quaternion_matrix(quaternion_normalized(quaternion_at(row))), origin);
    }
    if HAS_FREE != 0u && link.kind == FREE {
        return Placement(
            axes * quaternion_matrix(quaternion_normalized(quaternion_at(row + 3u))),
            origin + axes * state3(row),
        );
    }
    return Placement(turned_about_z(axes, turn.x, turn.y), origin);
}

// Velocity across a joint, in the child's axes.
fn joint_velocity(seen: Seen) -> Motion {
    let link = seen.link;
    let row = rates(link);
    if HAS_PRISMATIC != 0u && link.kind == PRISMATIC {
        return Motion(zero3(), vec3<real>(0.0, 0.0, seen.rate));
    }
    if HAS_SPHERICAL != 0u && link.kind == SPHERICAL {
        return Motion(state3(row), zero3());
    }
    if HAS_FREE != 0u && link.kind == FREE {
        return Motion(state3(row), state3(row + 3u));
    }
    return Motion(vec3<real>(0.0, 0.0, seen.rate), zero3());
}

// Angular velocity and, where forces act, axes in the world.
struct Turning {
    w: vec3<real>,
    axes: mat3x3<real>,
}

// Rotations and velocity products, from the parent's turning.
fn descend(slot: u32, seen: Seen, before: Turning) -> Turning {
    let link = seen.link;
    let to = record(slot);
    var parent = before;
    if link.parent == NONE {
        parent.w = zero3();
        parent.axes = mat3x3<real>(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    } else if (link.flags & FOLLOWS) == 0u {
        let above = record(link.parent);
        parent.w = scratch_at(above).xyz;
        if HAS_FORCES != 0u {
            let axes = above + 4u + HAS_SPHERICAL;
            parent.axes = mat3x3<real>(
                scratch_at(axes).xyz,
                scratch_at(axes + 1u).xyz,
                scratch_at(axes + 2u).xyz,
            );
        }
    }
    var turn: vec2<real> = vec2<real>(0.0, 1.0);
    if link.kind == REVOLUTE {
        let angle = seen.other;
        if abs(angle) > LARGEST_ANGLE {
            fail(slot, LARGE_ANGLE);
        }
        turn = sin_cos(clamp(angle, -LARGEST_ANGLE, LARGEST_ANGLE));
    }
    let child = placement(seen, turn);
    let w = parent.w * child.axes;
    let across = joint_velocity(seen);
    let c = velocity_product(link.kind, w, child.origin * child.axes, across);
    let turning = w + across.angular;
    set_scratch(to, vec4<real>(turning, turn.x));
    set_scratch(to + 1u, vec4<real>(c.linear, turn.y));
    var axes = child.axes;
    if HAS_FORCES != 0u {
        axes = parent.axes * child.axes;
        let place = to + 4u + HAS_SPHERICAL;
        set_scratch(place, vec4<real>(axes[0], 0.0));
        set_scratch(place + 1u, vec4<real>(axes[1], 0.0));
        set_scratch(place + 2u, vec4<real>(axes[2], 0.0));
    }
    return Turning(turning, axes);
}

// The forces on a body about its joint's origin, in its axes: a wrench in these axes; force f and torque
// in world axes, and the sum T of point f' over the points where they act. The moment of R'f at the
// points is the axial vector of T R.
fn external_force(slot: u32, link: BatchLink) -> Force {
    if link.pushed == NONE {
        return force_zero();
    }
    let place = record(slot) + 4u + HAS_SPHERICAL;
    let x = scratch_at(place).xyz;
    let y = scratch_at(place + 1u).xyz;
    let z = scratch_at(place + 2u).xyz;
    let axes = mat3x3<real>(x, y, z);
    let row = plan.dofs + 21u * link.pushed;
    let tx = force3(row + 12u);
    let ty = force3(row + 15u);
    let tz = force3(row + 18u);
    let moment = vec3<real>(dot(ty, z) - dot(tz, y), dot(tz, x) - dot(tx, z), dot(tx, y) - dot(ty, x));
    return Force(
        force3(row) + force3(row + 9u) * axes + moment,
        force3(row + 3u) + force3(row + 6u) * axes,
    );
}

// What a body hands to its parent, about the parent's origin and in its axes; and traces of what arrives
// before the joint lets go, a bound of its rounding.
struct Passed {
    inertia: Inertia,
    bias: Force,
    carried: vec2<real>,
}

fn nothing_passed() -> Passed {
    return Passed(inertia_zero(), force_zero(), vec2<real>(0.0, 0.0));
}

fn passed_add(a: Passed, b: Passed) -> Passed {
    return Passed(inertia_add(a.inertia, b.inertia), force_add(a.bias, b.bias), a.carried + b.carried);
}

fn leave(place: u32, passed: Passed) {
    let inertia = passed.inertia;
    let bias = passed.bias;
    set_scratch(place, vec4<real>(inertia.angular.diagonal, passed.carried.x));
    set_scratch(place + 1u, vec4<real>(inertia.angular.off, passed.carried.y));
    set_scratch(place + 2u, vec4<real>(inertia.coupling[0], bias.angular.x));
    set_scratch(place + 3u, vec4<real>(inertia.coupling[1], bias.angular.y));
    set_scratch(place + 4u, vec4<real>(inertia.coupling[2], bias.angular.z));
    set_scratch(place + 5u, vec4<real>(inertia.linear.diagonal, bias.linear.x));
    set_scratch(place + 6u, vec4<real>(inertia.linear.off, bias.linear.y));
    set_scratch(place + 7u, vec4<real>(bias.linear.z, 0.0, 0.0, 0.0));
}

fn found(place: u32) -> Passed {
    let a = scratch_at(place);
    let b = scratch_at(place + 1u);
    let hx = scratch_at(place + 2u);
    let hy = scratch_at(place + 3u);
    let hz = scratch_at(place + 4u);
    let c = scratch_at(place + 5u);
    let d = scratch_at(place + 6u);
    return Passed(
        Inertia(Sym3(a.xyz, b.xyz), mat3x3<real>(hx.xyz, hy.xyz, hz.xyz), Sym3(c.xyz, d.xyz)),
        Force(vec3<real>(hx.w, hy.w, hz.w), vec3<real>(c.w, d.w, scratch_at(place + 7u).x)),
        vec2<real>(a.w, b.w),
    );
}

// Ia and pa in the parent's axes of a joint about z: of Ia nothing is left about z, of pa the joint force.
fn pass_revolute(
    inertia: Inertia,
    bias: Force,
    w_force: Force,
    u_force: Force,
    force_along: real,
    c: Motion,
    u: real,
    axes: mat3x3<real>,
) -> Passed {
    let a = inertia.angular;
    let wa = w_force.angular;
    let xx = a.diagonal.x - u_force.angular.x * wa.x;
    let yy = a.diagonal.y - u_force.angular.y * wa.y;
    let xy = a.off.z - u_force.angular.x * wa.y;
    let hx = inertia.coupling[0] - u_force.linear * wa.x;
    let hy = inertia.coupling[1] - u_force.linear * wa.y;
    let ul = u_force.linear;
    let wl = w_force.linear;
    let linear = Sym3(
        inertia.linear.diagonal - ul * wl,
        inertia.linear.off - ul.yzx * wl.zxy,
    );
    let force = Force(
        vec3<real>(
            bias.angular.x + xx * c.angular.x + xy * c.angular.y + dot(hx, c.linear) + wa.x * u,
            bias.angular.y + xy * c.angular.x + yy * c.angular.y + dot(hy, c.linear) + wa.y * u,
            force_along,
        ),
        bias.linear + hx * c.angular.x + hy * c.angular.y + sym_mul(linear, c.linear) + wl * u,
    );
    let x = axes[0];
    let y = axes[1];
    let p = x * xx + y * xy;
    let q = x * xy + y * yy;
    let turned_x = axes * hx;
    let turned_y = axes * hy;
    return Passed(
        Inertia(
            Sym3(p * x + q * y, p.yzx * x.zxy + q.yzx * y.zxy),
            mat3x3<real>(
                turned_x * x.x + turned_y * y.x,
                turned_x * x.y + turned_y * y.y,
                turned_x * x.z + turned_y * y.z,
            ),
            sym_rotated(linear, axes),
        ),
        Force(axes * force.angular, axes * force.linear),
        vec2<real>(0.0, 0.0),
    );
}

// The articulated inertia and bias force of a body, and what its joint passes on.
fn ascend(slot: u32, seen: Seen, arriving: Passed) -> Passed {
    let link = seen.link;
    let at = record(slot);
    let w = seen.first.xyz;
    let child = placement(seen, vec2<real>(seen.first.w, seen.second.w));
    let across = joint_velocity(seen);
    // w_parent x w_J, of which w_J x w_J is nothing.
    let c = Motion(cross3(w, across.angular), seen.second.xyz);

    let constant = 4u + 6u * slot;
    let body = constants[constant];
    let rotational = Sym3(constants[constant + 1u].xyz, constants[constant + 2u].xyz);
    var here: Passed = passed_add(
        arriving,
        Passed(
            inertia_rigid(rotational, body.xyz, body.w),
            turning_force(rotational, body.xyz, w),
            vec2<real>(sym_trace(rotational), 3.0 * body.w),
        ),
    );
    if HAS_FORCES != 0u {
        here.bias = force_sub(here.bias, external_force(slot, link));
    }
    let handoffs = record(plan.levels * LANES);
    for (var k = 0u; k < link.gathered; k++) {
        here = passed_add(here, found(handoffs + 8u * (link.first + k)));
    }
    let inertia = here.inertia;
    let bias = here.bias;
    let floor = here.carried * real(FLOOR);
    let carried = vec2<real>(
        sym_trace(inertia.angular) + dot(child.origin, child.origin) * sym_trace(inertia.linear),
        sym_trace(inertia.linear),
    );

    var passed: Passed;
    let row = link.dof;
    if HAS_FREE != 0u && link.kind == FREE {
        // Everything is let go but what drives the joint: a = IA^-1 (tau - pA).
        let driven = Force(force3(row), force3(row + 3u));
        let factor = cholesky6(inertia, floor.x, floor.y);
        if !factor.positive {
            fail(slot, SINGULAR);
        }
        let a = cholesky6_solve(factor, force_sub(driven, bias));
        set_scratch(at + 2u, vec4<real>(a.angular, 0.0));
        set_scratch(at + 3u, vec4<real>(a.linear, 0.0));
        passed.inertia = inertia_zero();
        passed.bias = Force(child.axes * driven.angular, child.axes * driven.linear);
    } else if HAS_SPHERICAL != 0u && link.kind == SPHERICAL {
        // D = A, U = [A; H]: of Ia only C - H A^-1 H' is left, of the moment the joint's.
        let driven = force3(row);
        let factor = cholesky3(inertia.angular, floor.x);
        if !factor.positive {
            fail(slot, SINGULAR);
        }
        let rows = transpose(inertia.coupling);
        let lower_x = cholesky3_lower(factor, rows[0]);
        let lower_y = cholesky3_lower(factor, rows[1]);
        let lower_z = cholesky3_lower(factor, rows[2]);
        let response = cholesky3_solve(factor, driven - bias.angular);
        set_scratch(at + 2u, vec4<real>(cholesky3_upper(factor, lower_x), response.x));
        set_scratch(at + 3u, vec4<real>(cholesky3_upper(factor, lower_y), response.y));
        set_scratch(at + 4u, vec4<real>(cholesky3_upper(factor, lower_z), response.z));
        let linear = Sym3(
            inertia.linear.diagonal
                - vec3<real>(dot(lower_x, lower_x), dot(lower_y, lower_y), dot(lower_z, lower_z)),
            inertia.linear.off
                - vec3<real>(dot(lower_y, lower_z), dot(lower_x, lower_z), dot(lower_x, lower_y)),
        );
        let force = bias.linear + inertia.coupling * response + sym_mul(linear, c.linear);
        passed.inertia = inertia_zero();
        passed.inertia.linear = sym_rotated(linear, child.axes);
        passed.bias = Force(child.axes * driven, child.axes * force);
    } else if HAS_PRISMATIC != 0u && link.kind == PRISMATIC {
        let h = inertia.coupling;
        let u_force = Force(vec3<real>(h[0].z, h[1].z, h[2].z), sym_column_z(inertia.linear));
        let d: real = inertia.linear.diagonal.z;
        let is_firm = d > floor.y;
        if !is_firm {
            fail(slot, SINGULAR);
        }
        let d_inverse: real = 1.0 / select(real(1.0), d, is_firm);
        let along: real = seen.other;
        let u = along - bias.linear.z;
        let w_force = force_scaled(u_force, d_inverse);
        set_scratch(at + 2u, vec4<real>(w_force.angular, u * d_inverse));
        set_scratch(at + 3u, vec4<real>(w_force.linear, 0.0));
        var left = inertia_less_outer(inertia, u_force, d_inverse);
        left.linear.diagonal.z = 0.0;
        left.linear.off.x = 0.0;
        left.linear.off.y = 0.0;
        left.coupling[0].z = 0.0;
        left.coupling[1].z = 0.0;
        left.coupling[2].z = 0.0;
        var force = force_add(force_add(bias, inertia_mul(left, c)), force_scaled(w_force, u));
        force.linear.z = along;
        passed.inertia = inertia_rotated(left, child.axes);
        passed.bias = Force(child.axes * force.angular, child.axes * force.linear);
    } else {
        let u_force = Force(sym_column_z(inertia.angular), inertia.coupling[2]);
        let d: real = inertia.angular.diagonal.z;
        let is_firm = d > floor.x;
        if !is_firm && link.kind == REVOLUTE {
            fail(slot, SINGULAR);
        }
        let d_inverse: real = 1.0 / select(real(1.0), d, is_firm);
        let along: real = seen.other;
        let u = along - bias.angular.z;
        let w_force = force_scaled(u_force, d_inverse);
        set_scratch(at + 2u, vec4<real>(w_force.angular, u * d_inverse));
        set_scratch(at + 3u, vec4<real>(w_force.linear, 0.0));
        passed = pass_revolute(inertia, bias, w_force, u_force, along, c, u, child.axes);
    }
    return Passed(
        inertia_shifted_back(passed.inertia, child.origin),
        force_shifted_back(passed.bias, child.origin),
        carried,
    );
}

// The acceleration of a body from that of the one its lane did before, or its parent's.
fn respond(slot: u32, seen: Seen, before: Motion) -> Motion {
    let link = seen.link;
    let at = record(slot);
    let child = placement(seen, vec2<real>(seen.first.w, seen.second.w));
    var parent = before;
    if link.parent == NONE {
        parent = Motion(zero3(), constants[0].xyz);
    } else if (link.flags & FOLLOWS) == 0u {
        let above = record(link.parent);
        parent = Motion(scratch_at(above).xyz, scratch_at(above + 1u).xyz);
    }
    let across = joint_velocity(seen);
    let shifted = motion_shifted(parent, child.origin);
    var a = Motion(
        shifted.angular * child.axes + cross3(seen.first.xyz, across.angular),
        shifted.linear * child.axes + seen.second.xyz,
    );
    let w_angular = seen.third;
    let w_linear = seen.fourth;
    if HAS_FREE != 0u && link.kind == FREE {
        let free = Motion(w_angular.xyz, w_linear.xyz);
        finish_several(slot, link, motion_sub(free, a));
        a = free;
    } else if HAS_SPHERICAL != 0u && link.kind == SPHERICAL {
        let last = scratch_at(at + 4u);
        let angular = vec3<real>(w_angular.w, w_linear.w, last.w)
            - w_angular.xyz * a.linear.x - w_linear.xyz * a.linear.y - last.xyz * a.linear.z;
        finish_several(slot, link, Motion(angular - a.angular, zero3()));
        a.angular = angular;
    } else if HAS_PRISMATIC != 0u && link.kind == PRISMATIC {
        let along: real = w_angular.w - dot(w_angular.xyz, a.angular)
            - w_linear.x * a.linear.x - w_linear.y * a.linear.y;
        finish_one(slot, link, along - a.linear.z);
        a.linear.z = along;
    } else {
        let about: real = w_angular.w - w_angular.x * a.angular.x - w_angular.y * a.angular.y
            - dot(w_linear.xyz, a.linear);
        finish_one(slot, link, about - a.angular.z);
        a.angular.z = about;
    }
    if (link.flags & KEPT) != 0u {
        set_scratch(at, vec4<real>(a.angular, 0.0));
        set_scratch(at + 1u, vec4<real>(a.linear, 0.0));
    }
    return a;
}

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
