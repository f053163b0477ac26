// A chunk, solved from its two ends for the accelerations of its bodies and joints; chunk.rs of the dynamics
// has the formulas. Conditions on joint accelerations are solved twice: the acceleration of the body may be
// much larger than what is to be left of it, and the second solution removes the first one's rounding.

// The acceleration of a body and of its joint, in the axes of its rates.
struct Response {
    body: Motion,
    joint: Motion,
}

fn respond_one(v: u32, s: Motion, f2: Force, given: Motion) -> Response {
    let at = freedoms_at() + v;
    let record = get4(at, sizes.dofs);
    let rest = fetch(at + 3u * sizes.dofs);
    let column = Force(record.a, record.b);
    let wanted: real = rest.x + dot(record.c, f2.angular) + dot(record.d, f2.linear);
    let first: real = (wanted - motion_dot(given, column)) * rest.y;
    let once = Motion(given.angular + s.angular * first, given.linear + s.linear * first);
    let second: real = (wanted - motion_dot(once, column)) * rest.y;
    return Response(
        Motion(once.angular + s.angular * second, once.linear + s.linear * second),
        Motion(vec3<real>(first + second, 0.0, 0.0), zero3()),
    );
}

fn respond_turning(v: u32, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    let a = get_several4(v, 0u);
    let h = get_several4(v, 1u);
    let t = get_several4(v, 2u);
    let factor = Cholesky3(a.d, h.d, true);
    let turning = mat3x3<real>(a.a, a.b, a.c);
    let sliding = mat3x3<real>(h.a, h.b, h.c);
    let wanted = t.d + mat3x3<real>(t.a, t.b, t.c) * f2.angular
        + mat3x3<real>(get_several(v, 0u), get_several(v, 1u), get_several(v, 2u)) * f2.linear
        - sliding * given.linear;
    let first = cholesky3_upper(factor, wanted - turning * given.angular);
    let once = given.angular + first;
    let second = cholesky3_upper(factor, wanted - turning * once);
    return Response(
        Motion(once + second, given.linear),
        Motion((first + second) * axes, zero3()),
    );
}

fn respond_free(v: u32, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    let inverse = get_several_inverse(v);
    let moved = force_sub(matrix6_mul(inverse.far, f2), inverse.bias);
    let a = upper6(inverse.factor, moved);
    return Response(
        Motion(a.angular, a.linear),
        Motion((a.angular - given.angular) * axes, (a.linear - given.linear) * axes),
    );
}

fn respond(slot: u32, kind: u32, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    let v = dof_of(slot);
    switch kind {
        case REVOLUTE: { return respond_one(v, Motion(axes[2], zero3()), f2, given); }
        case PRISMATIC: { return respond_one(v, Motion(zero3(), axes[2]), f2, given); }
        case SPHERICAL: { return respond_turning(v, axes, f2, given); }
        case FREE: { return respond_free(v, axes, f2, given); }
        default: { return Response(given, motion_zero()); }
    }
}

// A leaf, acted on by f2 at its centre of mass and by `force` at its joint, which `given` would accelerate if
// its freedoms stood still: of the accelerations on both sides the difference is S qdd.
fn respond_leaf(
    leaf: Leaf,
    placed: Placed,
    arm: vec3<real>,
    kind: u32,
    axes: mat3x3<real>,
    f2: Force,
    force: Force,
    given: Motion,
) -> Response {
    let total = force_add(f2, force_shifted_back(force, -arm));
    let center = upper6(leaf.own, force_sub(lower6(leaf.own, total), leaf.own_bias));
    let across = motion_add(
        motion_shifted(Motion(center.angular, center.linear), -arm),
        centripetal(placed.spin, -arm),
    );
    let apart = motion_sub(across, given);
    var joint = Motion(apart.angular * axes, apart.linear * axes);
    switch kind {
        case REVOLUTE: { joint = Motion(vec3<real>(joint.angular.z, 0.0, 0.0), zero3()); }
        case PRISMATIC: { joint = Motion(vec3<real>(joint.linear.z, 0.0, 0.0), zero3()); }
        case SPHERICAL: { joint.linear = zero3(); }
        case FREE: {}
        default: { joint = motion_zero(); }
    }
    return Response(across, joint);
}

fn respond_chunk(chunk: u32) {
    let slots = slots_of(chunk);
    let flags_at_ends = chunk_word(chunk, ENDS);
    let is_inner = (flags_at_ends & FROM_CUT) != 0u;
    let has_leaf = (flags_at_ends & TO_LEAF) != 0u;
    let parent = chunk_word(chunk, PARENT);
    var ends = Ends(force_zero(), force_zero());
    if parent != NONE {
        ends = handed(parent);
    }
    if !is_inner {
        var carrier = NONE;
        if (flags_at_ends & FROM_CARRIER) != 0u {
            carrier = chunk_word(chunk, INBOARD);
        }
        ends.x = hanging(slot_at(slots, 0u), carrier);
    }
    // The force that a leaf's joint transmits to it acts on the rest the other way round.
    var tip = ends.f2;
    var on_leaf = force_zero();
    if has_leaf {
        let last = slot_at(slots, slots.length - 1u);
        on_leaf = leaf_force(last, get_leaf(chunk_word(chunk, LEAF)), ends.x, ends.f2);
        tip = force_scaled(on_leaf, -1.0);
    }
    var a = Motion(ends.x.angular, ends.x.linear);
    if is_inner {
        let inverse = get_inverse(chunk_word(chunk, INNER));
        let moved = force_sub(
            force_add(lower6(inverse.factor, ends.x), matrix6_mul(inverse.far, tip)),
            inverse.bias,
        );
        let center = upper6(inverse.factor, moved);
        a = Motion(center.angular, center.linear);
    }
    for (var place = 0u; place < slots.length; place++) {
        let slot = slot_at(slots, place);
        let flags = flags_of(slot);
        let kind = kind_of(flags);
        let placed = get_placed(slot);
        let axes = quaternion_matrix(placed.rotation);
        let arm = axes * arm_of(slot, flags);
        if is_inner || place > 0u {
            a = motion_shifted(a, placed.offset);
        }
        a = motion_add(a, placed.bias_acceleration);
        var response: Response;
        if has_leaf && place + 1u == slots.length {
            let leaf = get_leaf(chunk_word(chunk, LEAF));
            response = respond_leaf(leaf, placed, arm, kind, axes, ends.f2, on_leaf, a);
        } else {
            response = respond(slot, kind, axes, tip, a);
        }
        a = response.body;
        if !(is_finite3(a.angular) && is_finite3(a.linear)) {
            fail(OVERFLOW, slot);
        }
        advance(slot, kind, response.joint);
        if (flags & CARRIES) != 0u {
            let handle = motion_add(motion_shifted(a, arm), centripetal(placed.spin, arm));
            let at = carriers_at() + slot;
            put(at + sizes.slots, vec4<real>(handle.angular, 0.0));
            put(at + 2u * sizes.slots, vec4<real>(handle.linear, 0.0));
        }
    }
}
