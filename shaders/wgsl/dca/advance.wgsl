// Joint coordinates on their way from step to step; integrate.rs of the dynamics has the formulas. Numbers of
// a joint of one freedom are the first of a motion's angular part.

// Where a joint of one freedom was at the start of the step, and its rate.
struct Begun {
    position: real,
    rate: real,
}

fn begun_at(spot: Spot) -> Begun {
    return Begun(real(state[spot.q]), real(state[sizes.positions + spot.v]));
}

// A joint's rates at the start of the step.
fn rates_before(v: u32, kind: u32, begun: Begun) -> Motion {
    if kind == REVOLUTE || kind == PRISMATIC || kind == SCREW {
        return Motion(vec3<real>(begun.rate, 0.0, 0.0), zero3());
    }
    return joint_motion(sizes.positions + v, kind);
}

fn accelerations_at() -> u32 { return 2u * (sizes.positions + sizes.dofs); }

// The numbers of a joint in an array with one for each freedom.
fn joint_motion(at: u32, kind: u32) -> Motion {
    switch kind {
        case REVOLUTE, PRISMATIC, SCREW: {
            return Motion(vec3<real>(real(state[at]), 0.0, 0.0), zero3());
        }
        case SPHERICAL: { return Motion(state3(at), zero3()); }
        case FREE: { return Motion(state3(at), state3(at + 3u)); }
        default: { return motion_zero(); }
    }
}

fn put_joint_motion(at: u32, kind: u32, m: Motion) {
    switch kind {
        case REVOLUTE, PRISMATIC, SCREW: { state[at] = chunk_real(m.angular.x); }
        case SPHERICAL: { put_state3(at, m.angular); }
        case FREE: {
            put_state3(at, m.angular);
            put_state3(at + 3u, m.linear);
        }
        default: {}
    }
}

fn state3(at: u32) -> vec3<real> {
    return vec3<real>(real(state[at]), real(state[at + 1u]), real(state[at + 2u]));
}

fn put_state3(at: u32, v: vec3<real>) {
    state[at] = chunk_real(v.x);
    state[at + 1u] = chunk_real(v.y);
    state[at + 2u] = chunk_real(v.z);
}

fn state4(at: u32) -> vec4<real> { return vec4<real>(state3(at), real(state[at + 3u])); }

fn put_state4(at: u32, v: vec4<real>) {
    put_state3(at, v.xyz);
    state[at + 3u] = chunk_real(v.w);
}

fn is_finite4(v: vec4<real>) -> bool { return is_finite3(v.xyz) && is_finite(v.w); }

fn motion_scaled(m: Motion, factor: real) -> Motion {
    return Motion(m.angular * factor, m.linear * factor);
}

// From the child's axes to the parent's, in which free joints' positions are; `q` is the orientation.
fn to_displacement_axes(kind: u32, q: u32, m: Motion) -> Motion {
    if kind != FREE {
        return m;
    }
    let axes = quaternion_normalized(state4(q + 3u));
    return Motion(m.angular, quaternion_turned(axes, m.linear));
}

// The state worked on: positions at the start of the step moved by `u`, and these rates. An angle out of the
// range of sine and cosine counts as overflow.
fn put_moved(slot: u32, kind: u32, u: Motion, rates: Motion, begun: Begun) {
    let q = position_of(slot);
    let to = work_q() + q;
    var is_sound = is_finite3(rates.angular) && is_finite3(rates.linear);
    switch kind {
        case REVOLUTE, SCREW: {
            let angle: real = begun.position + u.angular.x;
            is_sound = is_sound && is_finite(angle) && abs(0.5 * angle) <= LARGEST_ANGLE;
            state[to] = chunk_real(angle);
        }
        case PRISMATIC: {
            let at: real = begun.position + u.angular.x;
            is_sound = is_sound && is_finite(at);
            state[to] = chunk_real(at);
        }
        case SPHERICAL: {
            let turned = quaternion_integrated(state4(q), u.angular);
            is_sound = is_sound && is_finite4(turned);
            put_state4(to, turned);
        }
        case FREE: {
            let at = state3(q) + u.linear;
            let turned = quaternion_integrated(state4(q + 3u), u.angular);
            is_sound = is_sound && is_finite3(at) && is_finite4(turned);
            put_state3(to, at);
            put_state4(to + 3u, turned);
        }
        default: {}
    }
    if !is_sound {
        fail(OVERFLOW, slot);
    }
    put_joint_motion(work_qd() + dof_of(slot), kind, rates);
}
