// A chunk, assembled from its outboard end inwards by the articulated-body recursion with the tip wrench as
// six right-hand sides; interior.rs and chunk.rs of the dynamics have the formulas.

// What has been gathered so far, about its inboard handle.
struct Interior {
    inertia: Inertia,
    bias: Force,
    // B
    tip: Matrix6,
    // C
    compliance: Inertia,
    // d
    drift: Force,
    // Inertia [rotation, translation] before the last joint let go and of the bodies added since.
    carried: vec2<real>,
}

// What pushes a body, about its handle point: a force f and a moment in world axes, the sum of f a' of
// forces f in world axes at points a in joint axes, and a force and a moment in joint axes.
fn pushed(slot: u32, axes: mat3x3<real>) -> Force {
    let number = control[PUSHED_SLOTS + slot];
    if number == 0u {
        return force_zero();
    }
    let at = sizes.pushes + 21u * (number - 1u);
    var parts: array<vec3<real>, 7>;
    for (var i = 0u; i < 7u; i++) {
        parts[i] = vec3<real>(
            real(forces[at + 3u * i]),
            real(forces[at + 3u * i + 1u]),
            real(forces[at + 3u * i + 2u]),
        );
    }
    let moment = cross3(axes[0], parts[2]) + cross3(axes[1], parts[3]) + cross3(axes[2], parts[4]);
    return Force(parts[1] + moment + axes * parts[6], parts[0] + axes * parts[5]);
}

// A body's share of its inertia and bias force about its handle point, rakes included.
fn body_share(
    slot: u32,
    flags: u32,
    placed: Placed,
    axes: mat3x3<real>,
    share: real,
    are_pushed: bool,
) -> Rake {
    let n = sizes.slots;
    let l2 = vec4<real>(links[2u * n + slot]);
    let l3 = vec4<real>(links[3u * n + slot]);
    let mass: real = vec4<real>(links[n + slot]).w;
    let rotational = sym_rotated(
        Sym3(
            vec3<real>(l2.w, l3.x, l3.y),
            vec3<real>(l3.z, l3.w, vec4<real>(links[4u * n + slot]).x),
        ),
        axes,
    );
    // About its centre of mass a body has no moment.
    let moment = select(axes * l2.xyz, zero3(), (flags & AT_CENTER) != 0u);
    let turning = turning_force(rotational, moment, placed.spin);
    var force = turning;
    if are_pushed {
        force = force_sub(turning, pushed(slot, axes));
    }
    let sum: Rake = Rake(
        inertia_scaled(inertia_rigid(rotational, moment, mass), share),
        force_scaled(force, share),
        vec2<real>(sym_trace(rotational), 3.0 * mass) * share,
    );
    return with_rakes(sum, slot, flags, share);
}

fn interior_added(part: Interior, body: Rake) -> Interior {
    var next = part;
    next.inertia = inertia_add(part.inertia, body.inertia);
    next.bias = force_add(part.bias, body.bias);
    next.carried = part.carried + body.carried;
    return next;
}

// Works an acceleration in that comes on top of the handle's.
fn accelerated(part: Interior, c: Motion) -> Interior {
    var next = part;
    next.bias = force_add(part.bias, inertia_mul(part.inertia, c));
    next.drift = force_add(
        part.drift,
        matrix6_transpose_mul(part.tip, Force(c.angular, c.linear)),
    );
    return next;
}

// About the point from which the handle lies at `r`.
fn referred(part: Interior, r: vec3<real>) -> Interior {
    var next = part;
    next.inertia = inertia_shifted_back(part.inertia, r);
    next.bias = force_shifted_back(part.bias, r);
    next.tip = matrix6_shifted_back(part.tip, r);
    return next;
}

// The velocity-product acceleration of the body's point at `r` from one that has none.
fn centripetal(spin: vec3<real>, r: vec3<real>) -> Motion {
    return Motion(zero3(), cross3(spin, cross3(spin, r)));
}

// A freedom's record: column of U, tip s, drive u and 1/D, what its load keeps.
fn put_freedom(v: u32, column: Force, tip: Force, drive: real, d_inverse: real, load: One) {
    let at = freedoms_at() + v;
    put4(at, sizes.dofs, column.angular, column.linear, tip.angular, tip.linear);
    put(at + 3u * sizes.dofs, vec4<real>(drive, d_inverse, load.parts, load.own));
}

// Lets one freedom go along `s`.
fn let_one_go(part: Interior, s: Motion, spot: Spot, floor: real, c: Motion, load: One) -> Interior {
    let column = inertia_mul(part.inertia, s);
    let tip = matrix6_transpose_mul(part.tip, Force(s.angular, s.linear));
    let d: real = with_own(motion_dot(s, column), load.own);
    let drive: real = load.force - motion_dot(s, part.bias);
    var d_inverse: real = 0.0;
    if d > floor && is_finite(d) {
        d_inverse = 1.0 / d;
    } else {
        fail(SINGULAR, spot.slot);
    }
    put_freedom(spot.v, column, tip, drive, d_inverse, load);
    let response: real = drive * d_inverse;
    let scaled = force_scaled(column, d_inverse);
    let scaled_tip = force_scaled(tip, d_inverse);
    var next = part;
    next.inertia = inertia_less_outer(part.inertia, column, d_inverse);
    next.bias = force_add(part.bias, force_scaled(column, response));
    next.tip = Matrix6(
        part.tip.aa - outer3(scaled.angular, tip.angular),
        part.tip.al - outer3(scaled.angular, tip.linear),
        part.tip.la - outer3(scaled.linear, tip.angular),
        part.tip.ll - outer3(scaled.linear, tip.linear),
    );
    next.compliance = Inertia(
        sym_add(part.compliance.angular, sym_outer(tip.angular, d_inverse)),
        part.compliance.coupling + outer3(scaled_tip.linear, tip.angular),
        sym_add(part.compliance.linear, sym_outer(tip.linear, d_inverse)),
    );
    next.drift = force_add(part.drift, force_scaled(tip, response));
    return accelerated(next, c);
}

// An inertia inverted, as it stands between forces on both sides: with M = LL', Z = L^-1 B and y = L^-1 p
// its acceleration is L'^-1 (L^-1 f + Z f2 - y).
struct Inverse {
    factor: Cholesky6,
    far: Matrix6,
    bias: Force,
}

fn inverse_of(f: Four, h: Four, aa: Four, la: Four, ll: Four, y: vec3<real>) -> Inverse {
    return Inverse(
        Cholesky6(
            Cholesky3(f.a, f.b, true),
            mat3x3<real>(h.a, h.b, h.c),
            Cholesky3(f.c, f.d, true),
            true,
        ),
        Matrix6(
            mat3x3<real>(aa.a, aa.b, aa.c),
            mat3x3<real>(aa.d, la.d, ll.d),
            mat3x3<real>(la.a, la.b, la.c),
            mat3x3<real>(ll.a, ll.b, ll.c),
        ),
        Force(h.d, y),
    );
}

// Passes through a slot's joint. A pivot that is within rounding of what it is computed from fails.
fn let_go(part: Interior, spot: Spot, axes: mat3x3<real>, c: Motion, tau: real) -> Interior {
    let slot = spot.slot;
    let kind = kind_of(spot.flags);
    let v = spot.v;
    let floor: vec2<real> = part.carried * (4.0 * EPSILON);
    switch kind {
        case REVOLUTE, SCREW: {
            let s = turning_axis(slot, axes[2]);
            let load = load_one(slot, spot.q, v, tau);
            return let_one_go(part, s, spot, turning_floor(slot, floor), c, load);
        }
        case PRISMATIC: {
            let load = load_one(slot, spot.q, v, tau);
            return let_one_go(part, Motion(zero3(), axes[2]), spot, floor.y, c, load);
        }
        case SPHERICAL: {
            return let_turning_go(part, load_turning(slot, spot.q, v), axes, spot, floor.x, c);
        }
        case FREE: { return let_all_go(part, load_all(v), axes, spot, c); }
        default: { return accelerated(part, c); }
    }
}

fn put_inverse(index: u32, inverse: Inverse) {
    let at = inners_at() + index;
    let n = sizes.inners;
    let f = inverse.factor;
    let z = inverse.far;
    let y = inverse.bias;
    put4(at, n, f.angular.inverse, f.angular.lower, f.linear.inverse, f.linear.lower);
    put4(at + 3u * n, n, f.coupling[0], f.coupling[1], f.coupling[2], y.angular);
    put4(at + 6u * n, n, z.aa[0], z.aa[1], z.aa[2], z.al[0]);
    put4(at + 9u * n, n, z.la[0], z.la[1], z.la[2], z.al[1]);
    put4(at + 12u * n, n, z.ll[0], z.ll[1], z.ll[2], z.al[2]);
    put(at + 15u * n, vec4<real>(y.linear, 0.0));
}

fn get_inverse(index: u32) -> Inverse {
    let at = inners_at() + index;
    let n = sizes.inners;
    return inverse_of(
        get4(at, n),
        get4(at + 3u * n, n),
        get4(at + 6u * n, n),
        get4(at + 9u * n, n),
        get4(at + 12u * n, n),
        fetch(at + 15u * n).xyz,
    );
}

// Assembles a chunk whose bodies are placed.
fn assemble_chunk(chunk: u32) {
    let slots = slots_of(chunk);
    let ends = chunk_word(chunk, ENDS);
    // What is needed later, so that it is there by then.
    let cut = chunk_word(chunk, INBOARD);
    let inner = chunk_word(chunk, INNER);
    let leaf = chunk_word(chunk, LEAF);
    let rake = chunk_word(chunk, RAKE);
    let index = chunk_word(chunk, NODE);
    let are_pushed = control[PUSHED] != 0u;
    let is_inner = (ends & FROM_CUT) != 0u;
    let last_share: real = select(real(1.0), real(0.5), (ends & IS_HALVED) != 0u);
    var part: Interior = Interior(
        inertia_zero(),
        force_zero(),
        matrix6_zero(),
        inertia_zero(),
        force_zero(),
        vec2<real>(0.0, 0.0),
    );
    if (ends & (TO_HALF | TO_LEAF)) != 0u {
        part.tip = matrix6_one();
    }
    var length = slots.length;
    if (ends & TO_LEAF) != 0u {
        length -= 1u;
        if is_inner || length > 0u {
            part = referred(part, get_placed(slot_at(slots, length)).offset);
        }
    }
    var next = spot_of(slot_ahead(slots, length - 1u));
    var next_tau = joint_force(next.v);
    var ahead = slot_ahead(slots, length - 2u);
    for (var i = 0u; i < length; i++) {
        let place = length - 1u - i;
        let spot = next;
        let tau = next_tau;
        next = spot_of(ahead);
        next_tau = joint_force(next.v);
        ahead = slot_ahead(slots, place - 2u);
        let slot = spot.slot;
        let flags = spot.flags;
        let placed = get_placed(slot);
        let axes = quaternion_matrix(placed.rotation);
        let is_last = place + 1u == slots.length;
        let share: real = select(real(1.0), last_share, is_last);
        let body = body_share(slot, flags, placed, axes, share, are_pushed);
        part = interior_added(part, body);
        if (flags & AT_CENTER) != 0u {
            let arm = axes * arm_of(slot, flags);
            part = accelerated(part, centripetal(placed.spin, arm));
            part.carried.x += shifted_angular_trace(part.inertia, arm)
                - sym_trace(part.inertia.angular);
            part = referred(part, arm);
        }
        // Of what arrives at the joint, for pivots further inboard.
        let arriving = vec2<real>(
            shifted_angular_trace(part.inertia, placed.offset),
            sym_trace(part.inertia.linear),
        );
        part = let_go(part, spot, axes, placed.bias_acceleration, tau);
        part.carried = arriving;
        if is_inner || place > 0u {
            part = referred(part, placed.offset);
        }
    }
    var node = Node(part.inertia, part.tip, part.compliance, part.bias, part.drift);
    if is_inner {
        // Not as it is placed, which another lane may be about to do.
        let start = under_chunk(chunk);
        let placed = Placed(start.rotation, start.spin, zero3(), motion_zero());
        let axes = quaternion_matrix(placed.rotation);
        let half: Rake = body_share(cut, flags_of(cut), placed, axes, 0.5, are_pushed);
        part = interior_added(part, half);
        let factor: Cholesky6 = cholesky6(part.inertia, 0.0, 0.0);
        if !factor.positive {
            fail(UNJOINED, cut);
        }
        let inverse = Inverse(factor, lower66(factor, part.tip), lower6(factor, part.bias));
        let own = lower_inverse(factor);
        node.phi11 = gram6(own);
        node.phi12 = transpose_product(own, inverse.far);
        node.phi22 = inertia_add(part.compliance, gram6(inverse.far));
        node.b1 = force_scaled(matrix6_transpose_mul(own, inverse.bias), -1.0);
        node.b2 = force_sub(part.drift, matrix6_transpose_mul(inverse.far, inverse.bias));
        put_inverse(inner, inverse);
    }
    if (ends & TO_LEAF) != 0u {
        node = with_leaf(!is_inner, node, slot_at(slots, length), last_share, leaf);
    }
    if index != NONE {
        put_node(index, node);
    }
    if rake != NONE && index == NONE {
        put_rake(rake, Rake(node.phi11, node.b1, part.carried), 1.0);
    }
}
