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

// What accelerates a body so, less what pushes it, about its handle point.
fn taken_by(slot: u32, flags: u32, placed: Placed, axes: mat3x3<real>, a: Motion, are_pushed: bool) -> Force {
    let n = sizes.slots;
    let l2 = vec4<real>(links[2u * n + slot]);
    let l3 = vec4<real>(links[3u * n + slot]);
    let mass: real = vec4<real>(links[n + slot]).w;
    let rotational = Sym3(
        vec3<real>(l2.w, l3.x, l3.y),
        vec3<real>(l3.z, l3.w, vec4<real>(links[4u * n + slot]).x),
    );
    // Turning in the body's axes.
    let spin = placed.spin * axes;
    let turning = sym_mul(rotational, a.angular * axes) + cross3(spin, sym_mul(rotational, spin));
    var force = Force(axes * turning, a.linear * mass);
    if (flags & AT_CENTER) == 0u {
        let moment = axes * l2.xyz;
        force.angular += cross3(moment, a.linear);
        force.linear += cross3(a.angular, moment) + cross3(placed.spin, cross3(placed.spin, moment));
    }
    if are_pushed {
        return force_sub(force, pushed(slot, axes));
    }
    return force;
}

// The force that is missing along a joint's freedoms: S (S'S)^-1 (tau - E qdd - S'f).
fn missing(f: Force, spot: Spot, axes: mat3x3<real>, qdd: Motion) -> Force {
    let wanted = driven(spot, qdd);
    switch kind_of(spot.flags) {
        case REVOLUTE, SCREW: {
            let pitch = pitch_of(spot.slot);
            let s = turning_axis(spot.slot, axes[2]);
            let rest: real = (wanted.angular.z - motion_dot(s, f)) / (1.0 + pitch * pitch);
            return Force(s.angular * rest, s.linear * rest);
        }
        case PRISMATIC: {
            return Force(zero3(), axes[2] * (wanted.linear.z - dot(axes[2], f.linear)));
        }
        case SPHERICAL: { return Force(axes * wanted.angular - f.angular, zero3()); }
        case FREE: { return force_sub(Force(axes * wanted.angular, axes * wanted.linear), f); }
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

fn let_one_go_again(change: Change, s: Motion, v: u32) -> Change {
    let at = freedoms_at() + v;
    let record = get4(at, sizes.dofs);
    let rest = fetch(at + 3u * sizes.dofs);
    let drive: real = -motion_dot(s, change.bias);
    let response: real = drive * rest.y;
    put(at + 3u * sizes.dofs, vec4<real>(drive, rest.yzw));
    return Change(
        change.whole,
        force_add(change.bias, force_scaled(Force(record.a, record.b), response)),
        force_add(change.drift, force_scaled(Force(record.c, record.d), response)),
    );
}

fn let_go_again(change: Change, spot: Spot, axes: mat3x3<real>) -> Change {
    switch kind_of(spot.flags) {
        case REVOLUTE, SCREW: {
            return let_one_go_again(change, turning_axis(spot.slot, axes[2]), spot.v);
        }
        case PRISMATIC: {
            return let_one_go_again(change, Motion(zero3(), axes[2]), spot.v);
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
    var change = Change(force_zero(), force_zero(), force_zero());
    if after != NONE {
        change.whole = force_at(after);
    }
    var on_leaf = force_zero();
    for (var i = 0u; i < slots.length; i++) {
        let place = slots.length - 1u - i;
        let slot = slot_at(slots, place);
        let spot = spot_of(slot);
        let placed = get_placed(slot);
        let axes = quaternion_matrix(placed.rotation);
        let arm = axes * arm_of(slot, spot.flags);
        let is_last = i == 0u;
        let share: real = select(real(1.0), last_share, is_last);
        let a = motion_add(motion_shifted(solved(slot), arm), centripetal(placed.spin, arm));
        var taken = taken_by(slot, spot.flags, placed, axes, a, are_pushed);
        taken = force_add(taken, taken_onto(slot, spot.flags));
        change.whole = force_add(change.whole, force_scaled(taken, share));
        change.bias = force_add(change.bias, added_onto(slot, spot.flags, share));
        change = changed_back(change, arm);
        let qdd = joint_motion(accelerations_at() + spot.v, kind_of(spot.flags));
        let load = missing(change.whole, spot, axes, qdd);
        change.whole = force_add(change.whole, load);
        change.bias = force_sub(change.bias, load);
        if has_leaf && is_last {
            // Its own, put to use when the rest has been gathered.
            on_leaf = change.bias;
            change.bias = force_zero();
        } else {
            change = let_go_again(change, spot, axes);
        }
        if is_inner || place > 0u {
            change = changed_back(change, placed.offset);
        }
    }
    if is_inner {
        let flags = flags_of(cut);
        let placed = get_placed(cut);
        let axes = quaternion_matrix(placed.rotation);
        var taken = taken_by(cut, flags, placed, axes, end_at(before, OUTBOARD), are_pushed);
        taken = force_add(taken, taken_apart(cut, flags, before));
        // What is missing on this half.
        let half: real = 0.5;
        let inertial = force_scaled(taken, half);
        let load = force_sub(force_sub(force_at(before), inertial), change.whole);
        let bias = force_sub(force_add(change.bias, added_onto(cut, flags, half)), load);
        var inverse = get_inverse(inner);
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
