// What acts in joints beyond the forces given, and inertia of the freedoms' own: of D = S'U + E. It is made of the
// state at the start of a step, or of the state at hand where forces act as they are (`layer.attempt`).

const HAS_OWN = true;

// Rows of numbers by slots behind those of the bodies.
const ELEMENTS_ROW: u32 = 6u;
// Arrays of numbers by freedoms behind the joint forces.
const OWN: u32 = 1u;
const PUSH: u32 = 2u;
const POSITION: u32 = 3u;
const GAIN: u32 = 4u;
const DAMPER: u32 = 5u;
const LIMIT: u32 = 6u;

fn element_row(slot: u32, row: u32) -> vec4<real> {
    return vec4<real>(links[(ELEMENTS_ROW + row) * sizes.slots + slot]);
}

fn given_number(which: u32, v: u32) -> real {
    return real(forces[JOINT_FORCES + which * sizes.dofs + v]);
}

fn given_numbers3(which: u32, v: u32) -> vec3<real> {
    return vec3<real>(
        given_number(which, v),
        given_number(which, v + 1u),
        given_number(which, v + 2u),
    );
}

fn elements_of(slot: u32, v: u32) -> Elements {
    let a = element_row(slot, 0u);
    let b = element_row(slot, 1u);
    let c = element_row(slot, 2u);
    return Elements(
        a.x,
        a.y,
        a.z,
        a.w,
        b.x,
        Stopped(b.y, b.z, b.w, c.xy, u32(i32(c.z))),
        given_number(PUSH, v),
        given_number(POSITION, v),
        given_number(GAIN, v),
        given_number(DAMPER, v),
        given_number(LIMIT, v),
    );
}

fn ball_of(slot: u32) -> Ball {
    let a = element_row(slot, 0u);
    return Ball(element_row(slot, 1u), a.x, a.z, a.w);
}

// The length of the step that elements are implicit in.
fn step_ahead() -> real {
    if layer.attempt == 0u {
        return 0.0;
    }
    return real(forces[STEP_SIZE]);
}

fn position_now(q: u32) -> u32 { return select(q, work_q() + q, layer.attempt == 0u); }

fn rate_now(v: u32) -> u32 { return select(sizes.positions + v, work_qd() + v, layer.attempt == 0u); }

fn moment_of(q: u32, v: u32) -> Moment {
    return Moment(real(state[position_now(q)]), real(state[rate_now(v)]), step_ahead());
}

// The last row of a freedom's record ends with the parts that its laws are on and its own inertia.
fn last_row(v: u32) -> u32 { return freedoms_at() + 3u * sizes.dofs + v; }

fn parts_in(row: vec4<real>) -> u32 { return u32(i32(row.z)); }

struct One {
    force: real,
    parts: real,
    own: real,
}

fn load_one(slot: u32, q: u32, v: u32, tau: real) -> One {
    let e = elements_of(slot, v);
    let now = moment_of(q, v);
    let laws = laws_of(e, now);
    var parts = parts_in(fetch(last_row(v)));
    if now.h != 0.0 {
        parts = parts_begun(laws, parts);
    }
    let load = elements_load(e, laws, parts, now);
    return One(tau + load.x, real(parts), load.y + given_number(OWN, v));
}

// Along a joint's axes, where those of one freedom have z. Spherical joints have their own (turning*.wgsl).
struct Load {
    force: Force,
    own: Force,
}

fn load_all(v: u32) -> Load {
    return Load(
        Force(joint_forces3(v), joint_forces3(v + 3u)),
        Force(given_numbers3(OWN, v), given_numbers3(OWN, v + 3u)),
    );
}

fn is_held3(own: vec3<real>) -> bool { return own.x != 0.0 || own.y != 0.0 || own.z != 0.0; }

fn is_held(own: Force) -> bool { return is_held3(own.angular) || is_held3(own.linear); }

// D of freedoms that have inertia of their own.
fn with_own(d: real, own: real) -> real { return d + own; }

fn with_own3(s: Sym3, own: vec3<real>, axes: mat3x3<real>) -> Sym3 {
    return sym_add(s, sym_rotated(Sym3(own, zero3()), axes));
}

// What is left of the force a freedom is wanted to exert if its own inertia takes its part.
fn less_own(wanted: real, own: real, qdd: real) -> real { return wanted - own * qdd; }

// Inertia of their own of so many freedoms, as it was kept.
fn own_kept(v: u32, i: u32) -> real { return fetch(last_row(v + i)).w; }

fn own_kept3(v: u32) -> vec3<real> {
    return vec3<real>(own_kept(v, 0u), own_kept(v, 1u), own_kept(v, 2u));
}

fn keep_own(v: u32, i: u32, own: real) {
    let at = last_row(v + i);
    put(at, vec4<real>(fetch(at).xyz, own));
}

fn keep_own3(v: u32, own: vec3<real>) {
    keep_own(v, 0u, own.x);
    keep_own(v, 1u, own.y);
    keep_own(v, 2u, own.z);
}

// What a leaf's joint transmits along its freedoms: tau where these have no inertia of their own, tau - E qdd
// where they have, of which 1/E and tau/E belong to its join.
struct Drive {
    force: Force,
    compliance: Force,
    held: Force,
}

fn load_of(slot: u32, kind: u32, q: u32, v: u32) -> Load {
    switch kind {
        case REVOLUTE, SCREW: {
            let one = load_one(slot, q, v, joint_force(v));
            put(last_row(v), vec4<real>(0.0, 0.0, one.parts, one.own));
            return Load(
                Force(vec3<real>(0.0, 0.0, one.force), zero3()),
                Force(vec3<real>(0.0, 0.0, one.own), zero3()),
            );
        }
        case PRISMATIC: {
            let one = load_one(slot, q, v, joint_force(v));
            put(last_row(v), vec4<real>(0.0, 0.0, one.parts, one.own));
            return Load(
                Force(zero3(), vec3<real>(0.0, 0.0, one.force)),
                Force(zero3(), vec3<real>(0.0, 0.0, one.own)),
            );
        }
        case FREE: { return load_all(v); }
        default: { return Load(force_zero(), force_zero()); }
    }
}

fn split3(force: vec3<real>, own: vec3<real>) -> Drive {
    let none: vec3<real> = vec3<real>(1.0, 1.0, 1.0);
    let has = own != zero3();
    let inverse: vec3<real> = select(zero3(), none / select(none, own, has), has);
    return Drive(
        Force(select(force, zero3(), has), zero3()),
        Force(inverse, zero3()),
        Force(force * inverse, zero3()),
    );
}

fn drive_of(slot: u32, kind: u32) -> Drive {
    let q = position_of(slot);
    let v = dof_of(slot);
    if kind == SPHERICAL {
        return drive_turning(load_turning(slot, q, v));
    }
    let load = load_of(slot, kind, q, v);
    let a = split3(load.force.angular, load.own.angular);
    let l = split3(load.force.linear, load.own.linear);
    return Drive(
        Force(a.force.angular, l.force.angular),
        Force(a.compliance.angular, l.compliance.angular),
        Force(a.held.angular, l.held.angular),
    );
}

// What a joint that accelerates so is to transmit along its one freedom, or along its several freedoms in joint axes:
// tau - E qdd.
fn driven_one(spot: Spot, tau: real, qdd: real) -> real {
    let one = load_one(spot.slot, spot.q, spot.v, tau);
    return one.force - one.own * qdd;
}

fn driven(spot: Spot, qdd: Motion) -> Force {
    let v = spot.v;
    var load: Load;
    switch kind_of(spot.flags) {
        case SPHERICAL: {
            let turning = load_turning(spot.slot, spot.q, v);
            return Force(turning.force - moments_times(turning.own, qdd.angular), zero3());
        }
        case FREE: { load = load_all(v); }
        default: { return force_zero(); }
    }
    return Force(
        load.force.angular - load.own.angular * qdd.angular,
        load.force.linear - load.own.linear * qdd.linear,
    );
}

fn compliant(g: Inertia, drive: Drive) -> Inertia {
    var sum = g;
    sum.angular.diagonal += drive.compliance.angular;
    sum.linear.diagonal += drive.compliance.linear;
    return sum;
}

fn with_held(rows: Force, drive: Drive) -> Force { return force_add(rows, drive.held); }

// 1 where a freedom has inertia of its own.
fn holding(drive: Drive) -> Force {
    let none: vec3<real> = vec3<real>(1.0, 1.0, 1.0);
    return Force(
        select(zero3(), none, drive.compliance.angular != zero3()),
        select(zero3(), none, drive.compliance.linear != zero3()),
    );
}
