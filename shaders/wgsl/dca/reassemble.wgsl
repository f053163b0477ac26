// A chunk in a correction, from its outboard end inwards: what its bodies' own equations leave, and how that changes
// the bias force and the tip's acceleration; correct.rs of the dynamics' tree has the formulas.
//
// What a joint transmits is added up from the chunk's end, of inertia and bias of the bodies beyond, of what side
// branches take and of the force at the tip; along the joint's freedoms it is tau - E qdd, and what of the sum is not
// is a load on the body beyond. So no sum is longer than a chunk, nothing grows with the condition of the whole, and
// nothing has to be kept of the inertias between joints.

struct Change {
    // What is transmitted, of all solutions.
    whole: Force,
    bias: Force,
    drift: Force,
}

// What a body weighs: its mass, its moment or where its centre of mass is, its inertia, in joint axes.
struct Weight {
    mass: real,
    first: vec3<real>,
    rotational: Sym3,
}

fn weight_of(slot: u32) -> Weight {
    let n = sizes.slots;
    let l2 = vec4<real>(links[2u * n + slot]);
    let l3 = vec4<real>(links[3u * n + slot]);
    return Weight(
        vec4<real>(links[n + slot]).w,
        l2.xyz,
        Sym3(
            vec3<real>(l2.w, l3.x, l3.y),
            vec3<real>(l3.z, l3.w, vec4<real>(links[4u * n + slot]).x),
        ),
    );
}

// What accelerates a body so, less what pushes it, about its handle point.
fn taken_by(
    slot: u32,
    flags: u32,
    weight: Weight,
    placed: Placed,
    axes: mat3x3<real>,
    a: Motion,
    are_pushed: bool,
) -> Force {
    // Turning in the body's axes.
    let spin = placed.spin * axes;
    let rotational = weight.rotational;
    let turning = sym_mul(rotational, a.angular * axes) + cross3(spin, sym_mul(rotational, spin));
    var force = Force(axes * turning, a.linear * weight.mass);
    if (flags & AT_CENTER) == 0u {
        let moment = axes * weight.first;
        force.angular += cross3(moment, a.linear);
        force.linear += cross3(a.angular, moment) + cross3(placed.spin, cross3(placed.spin, moment));
    }
    if are_pushed {
        return force_sub(force, pushed(slot, axes));
    }
    return force;
}

// What is read of a body, a place ahead: of joints of several freedoms not their records.
struct Listed {
    spot: Spot,
    placed: Placed,
    weight: Weight,
    a: Motion,
    record: Four,
    rest: vec4<real>,
    qdd: real,
    tau: real,
}

fn listed(slot: u32) -> Listed {
    let spot = spot_of(slot);
    let at = freedoms_at() + spot.v;
    return Listed(
        spot,
        get_placed(slot),
        weight_of(slot),
        solved(slot),
        get4(at, sizes.dofs),
        fetch(at + 3u * sizes.dofs),
        real(state[accelerations_at() + spot.v]),
        joint_force(spot.v),
    );
}

// The force that is missing along a joint's freedoms: S (S'S)^-1 (tau - E qdd - S'f).
fn missing(f: Force, body: Listed, axes: mat3x3<real>) -> Force {
    let spot = body.spot;
    let kind = kind_of(spot.flags);
    var wanted: real = 0.0;
    if kind == REVOLUTE || kind == PRISMATIC || kind == SCREW {
        wanted = driven_one(spot, body.tau, body.qdd);
    }
    switch kind {
        case REVOLUTE, SCREW: {
            let pitch = pitch_of(spot.slot);
            let s = turning_axis(spot.slot, axes[2]);
            let rest: real = (wanted - motion_dot(s, f)) / (1.0 + pitch * pitch);
            return Force(s.angular * rest, s.linear * rest);
        }
        case PRISMATIC: { return Force(zero3(), axes[2] * (wanted - dot(axes[2], f.linear))); }
        case SPHERICAL: {
            let qdd = joint_motion(accelerations_at() + spot.v, SPHERICAL);
            return Force(axes * driven(spot, qdd).angular - f.angular, zero3());
        }
        case FREE: {
            let qdd = joint_motion(accelerations_at() + spot.v, FREE);
            let whole = driven(spot, qdd);
            return force_sub(Force(axes * whole.angular, axes * whole.linear), f);
        }
        default: { return force_zero(); }
    }
}

// S qdd
fn across_joint(spot: Spot, axes: mat3x3<real>, qdd: Motion) -> Motion {
    switch kind_of(spot.flags) {
        case REVOLUTE, SCREW: {
            return motion_scaled(turning_axis(spot.slot, axes[2]), qdd.angular.x);
        }
        case PRISMATIC: { return Motion(zero3(), axes[2] * qdd.angular.x); }
        default: { return Motion(axes * qdd.angular, axes * qdd.linear); }
    }
}

fn let_one_go_again(change: Change, s: Motion, body: Listed) -> Change {
    let record = body.record;
    let rest = body.rest;
    let drive: real = -motion_dot(s, change.bias);
    let response: real = drive * rest.y;
    put(freedoms_at() + body.spot.v + 3u * sizes.dofs, vec4<real>(drive, rest.yzw));
    return Change(
        change.whole,
        force_add(change.bias, force_scaled(Force(record.a, record.b), response)),
        force_add(change.drift, force_scaled(Force(record.c, record.d), response)),
    );
}

fn let_go_again(change: Change, body: Listed, axes: mat3x3<real>) -> Change {
    let spot = body.spot;
    switch kind_of(spot.flags) {
        case REVOLUTE, SCREW: {
            return let_one_go_again(change, turning_axis(spot.slot, axes[2]), body);
        }
        case PRISMATIC: {
            return let_one_go_again(change, Motion(zero3(), axes[2]), body);
        }
        case SPHERICAL: { return let_turning_go_again(change, spot.v); }
        case FREE: { return let_all_go_again(change, spot.v); }
        default: { return change; }
    }
}

fn changed_back(change: Change, r: vec3<real>) -> Change {
    return Change(
        force_shifted_back(change.whole, r),
        force_shifted_back(change.bias, r),
        change.drift,
    );
}

fn reassemble_chunk(chunk: u32) {
    let slots = slots_of(chunk);
    let ends = chunk_word(chunk, ENDS);
    let cut = chunk_word(chunk, INBOARD);
    let inner = chunk_word(chunk, INNER);
    let leaf = chunk_word(chunk, LEAF);
    let rake = chunk_word(chunk, RAKE);
    let index = chunk_word(chunk, NODE);
    let before = chunk_word(chunk, BEFORE);
    let after = chunk_word(chunk, AFTER);
    let are_pushed = control[PUSHED] != 0u;
    let is_inner = (ends & FROM_CUT) != 0u;
    let has_leaf = HAS_LEAVES && (ends & TO_LEAF) != 0u;
    let last_share: real = select(real(1.0), real(0.5), (ends & IS_HALVED) != 0u);
    var next = listed(slot_at(slots, slots.length - 1u));
    var ahead = slot_ahead(slots, slots.length - 2u);
    var change = Change(force_zero(), force_zero(), force_zero());
    if after != NONE {
        change.whole = force_at(after);
    }
    var on_leaf = force_zero();
    for (var i = 0u; i < slots.length; i++) {
        let place = slots.length - 1u - i;
        let body = next;
        next = listed(ahead);
        ahead = slot_ahead(slots, place - 2u);
        let slot = body.spot.slot;
        let flags = body.spot.flags;
        let placed = body.placed;
        let axes = quaternion_matrix(placed.rotation);
        let arm = select(zero3(), axes * body.weight.first, (flags & AT_CENTER) != 0u);
        let is_last = i == 0u;
        let share: real = select(real(1.0), last_share, is_last);
        let a = motion_add(motion_shifted(body.a, arm), centripetal(placed.spin, arm));
        var taken = taken_by(slot, flags, body.weight, placed, axes, a, are_pushed);
        taken = force_add(taken, taken_onto(slot, flags));
        change.whole = force_add(change.whole, force_scaled(taken, share));
        change.bias = force_add(change.bias, added_onto(slot, flags, share));
        change = changed_back(change, arm);
        let load = missing(change.whole, body, axes);
        change.whole = force_add(change.whole, load);
        change.bias = force_sub(change.bias, load);
        if has_leaf && is_last {
            // Its own, put to use when the rest has been gathered.
            on_leaf = change.bias;
            change.bias = force_zero();
        } else {
            change = let_go_again(change, body, axes);
        }
        if is_inner || place > 0u {
            change = changed_back(change, placed.offset);
        }
    }
    if is_inner {
        let flags = flags_of(cut);
        let placed = get_placed(cut);
        let weight = weight_of(cut);
        let end = end_at(before, OUTBOARD);
        let force = force_at(before);
        var inverse = get_inverse(inner);
        let axes = quaternion_matrix(placed.rotation);
        var taken = taken_by(cut, flags, weight, placed, axes, end, are_pushed);
        taken = force_add(taken, taken_apart(cut, flags, before));
        // What is missing on this half.
        let half: real = 0.5;
        let inertial = force_scaled(taken, half);
        let load = force_sub(force_sub(force, inertial), change.whole);
        let bias = force_sub(force_add(change.bias, added_onto(cut, flags, half)), load);
        inverse.bias = lower6(inverse.factor, bias);
        put_inverse(inner, inverse);
        change.bias = force_scaled(upper6(inverse.factor, inverse.bias), -1.0);
        change.drift = force_sub(
            change.drift,
            matrix6_transpose_mul(inverse.far, inverse.bias),
        );
    }
    if has_leaf {
        change = with_leaf_again(chunk, slots, change, on_leaf);
    }
    if index != NONE {
        let at = change_at(index);
        let b1 = change.bias;
        let b2 = change.drift;
        tree_put_vectors(at, b1.angular, b1.linear, b2.angular, b2.linear);
    } else if rake != NONE {
        put_added(rake, change.bias);
    }
    if rake != NONE {
        put_taken(rake, change.whole);
    }
}
