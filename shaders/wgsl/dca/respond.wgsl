// A chunk, solved from its two ends for the accelerations of its bodies and joints; chunk.rs of the dynamics
// has the formulas. Conditions on joint accelerations are solved twice: the acceleration of the body may be
// much larger than what is to be left of it, and the second solution removes the first one's rounding.

// The acceleration of a body and of its joint, in the axes of its rates.
struct Response {
    body: Motion,
    joint: Motion,
}

// What is read of a body, a place ahead too: of joints of several freedoms not their records.
struct Known {
    spot: Spot,
    placed: Placed,
    record: Four,
    rest: vec4<real>,
    begun: Begun,
    // Of the solutions before: the body's acceleration, the joint's if it has one freedom.
    kept: Motion,
    qdd: real,
}

fn known_of(slot: u32) -> Known {
    let spot = spot_of(slot);
    let at = freedoms_at() + spot.v;
    return Known(
        spot,
        get_placed(slot),
        get4(at, sizes.dofs),
        fetch(at + 3u * sizes.dofs),
        begun_at(spot),
        kept_body(slot),
        kept_joint(spot.v),
    );
}

fn kept_joint(v: u32) -> real {
    if is_first() {
        return 0.0;
    }
    return real(state[accelerations_at() + v]);
}

// The acceleration of a joint in the solutions before.
fn joint_before(known: Known, kind: u32) -> Motion {
    switch kind {
        case REVOLUTE, PRISMATIC, SCREW: {
            return Motion(vec3<real>(known.qdd, 0.0, 0.0), zero3());
        }
        default: { return joint_motion(accelerations_at() + known.spot.v, kind); }
    }
}

fn respond_one(record: Four, rest: vec4<real>, s: Motion, f2: Force, given: Motion) -> Response {
    let column = Force(record.a, record.b);
    let wanted: real = rest.x + dot(record.c, f2.angular) + dot(record.d, f2.linear);
    let first: real = (wanted - motion_dot(given, column)) * rest.y;
    let once = Motion(given.angular + s.angular * first, given.linear + s.linear * first);
    let second: real = (less_own(wanted, rest.w, first) - motion_dot(once, column)) * rest.y;
    return Response(
        Motion(once.angular + s.angular * second, once.linear + s.linear * second),
        Motion(vec3<real>(first + second, 0.0, 0.0), zero3()),
    );
}

fn respond(known: Known, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    let v = known.spot.v;
    switch kind_of(known.spot.flags) {
        case REVOLUTE, SCREW: {
            let s = turning_axis(known.spot.slot, axes[2]);
            return respond_one(known.record, known.rest, s, f2, given);
        }
        case PRISMATIC: {
            let s = Motion(zero3(), axes[2]);
            return respond_one(known.record, known.rest, s, f2, given);
        }
        case SPHERICAL: { return respond_turning(v, axes, f2, given); }
        case FREE: { return respond_free(v, axes, f2, given); }
        default: { return Response(given, motion_zero()); }
    }
}

// In a correction the same with what is missing: there is no velocity then.
fn respond_chunk(chunk: u32) {
    let slots = slots_of(chunk);
    let flags_at_ends = chunk_word(chunk, ENDS);
    let is_inner = (flags_at_ends & FROM_CUT) != 0u;
    let has_leaf = HAS_LEAVES && (flags_at_ends & TO_LEAF) != 0u;
    let leaf = chunk_word(chunk, LEAF);
    let before = chunk_word(chunk, BEFORE);
    let after = chunk_word(chunk, AFTER);
    // What is needed later, so that it is there by then.
    var next = known_of(slot_at(slots, 0u));
    var ahead = slot_ahead(slots, 1u);
    let inboard_end = kept_end(before, OUTBOARD);
    let outboard_end = kept_end(after, INBOARD_SIDE);
    var ends = Ends(force_zero(), force_zero());
    if after != NONE {
        ends.f2 = force_scaled(acting(after), -1.0);
    }
    if is_inner {
        ends.x = acting(before);
    } else {
        var carrier = NONE;
        if (flags_at_ends & FROM_CARRIER) != 0u {
            carrier = chunk_word(chunk, INBOARD);
        }
        ends.x = hanging_again(slot_at(slots, 0u), carrier);
    }
    // The force that a leaf's joint transmits to it acts on the rest the other way round.
    var tip = ends.f2;
    var on_leaf = force_zero();
    if has_leaf {
        let last = slot_at(slots, slots.length - 1u);
        on_leaf = leaf_force(last, leaf, ends.x, ends.f2);
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
        keep_end(before, OUTBOARD, inboard_end, a);
    }
    for (var place = 0u; place < slots.length; place++) {
        let known = next;
        next = known_of(ahead);
        ahead = slot_ahead(slots, place + 2u);
        let slot = known.spot.slot;
        let flags = known.spot.flags;
        let kind = kind_of(flags);
        let placed = known.placed;
        let axes = quaternion_matrix(placed.rotation);
        let arm = axes * arm_of(slot, flags);
        if is_inner || place > 0u {
            a = motion_shifted(a, placed.offset);
        }
        var spin = zero3();
        if is_first() {
            a = motion_add(a, placed.bias_acceleration);
            spin = placed.spin;
        }
        var response: Response;
        if has_leaf && place + 1u == slots.length {
            response = respond_leaf(leaf, slot, spin, arm, kind, axes, ends.f2, on_leaf, a);
        } else {
            response = respond(known, axes, tip, a);
        }
        a = response.body;
        let body = keep_body(slot, known.kept, a);
        if !(is_finite3(body.angular) && is_finite3(body.linear)) {
            fail(OVERFLOW, slot);
        }
        var joint = response.joint;
        if !is_first() {
            joint = motion_add(joint, joint_before(known, kind));
        }
        advance(slot, kind, joint, known.begun);
        let carries = (flags & CARRIES) != 0u;
        let is_cut = IS_KEPT && after != NONE && place + 1u == slots.length;
        if carries || is_cut {
            let handle = motion_add(motion_shifted(a, arm), centripetal(spin, arm));
            if is_cut {
                keep_end(after, INBOARD_SIDE, outboard_end, handle);
            }
            if carries {
                put_handle(slot, handle);
            }
        }
    }
}
