// Joints of three and of six freedoms.

// Records of joints of several freedoms take the places of these freedoms' records, of which the first three
// numbers of four hold four vectors, and the last another one.
fn put_several4(v: u32, i: u32, a: vec3<real>, b: vec3<real>, c: vec3<real>, d: vec3<real>) {
    put4(freedoms_at() + v + i, sizes.dofs, a, b, c, d);
}

fn get_several4(v: u32, i: u32) -> Four { return get4(freedoms_at() + v + i, sizes.dofs); }

fn put_several(v: u32, i: u32, a: vec3<real>) {
    put(freedoms_at() + 3u * sizes.dofs + v + i, vec4<real>(a, 0.0));
}

fn get_several(v: u32, i: u32) -> vec3<real> {
    return fetch(freedoms_at() + 3u * sizes.dofs + v + i).xyz;
}

// Lets all three turning freedoms go, along the world's axes: with A = LL', what is kept is L, L^-1 [A H'],
// L^-1 B of the turning rows and L^-1 u. What is then left of IA, pA and B is known to be zero, but for the
// force that drives the joint; unless the freedoms have inertia of their own.
fn let_turning_go(
    part: Interior,
    load: Turning,
    axes: mat3x3<real>,
    spot: Spot,
    floor: real,
    c: Motion,
) -> Interior {
    let v = spot.v;
    let drive = axes * load.force;
    let factor = cholesky3(with_moments(part.inertia.angular, load.own, axes), floor);
    if !factor.positive {
        fail(SINGULAR, spot.slot);
    }
    let turning = lower33(factor, full(part.inertia.angular));
    let sliding = lower33(factor, transpose(part.inertia.coupling));
    let tip_a = lower33(factor, part.tip.aa);
    let tip_l = lower33(factor, part.tip.al);
    let u = cholesky3_lower(factor, drive - part.bias.angular);
    put_several4(v, 0u, turning[0], turning[1], turning[2], factor.inverse);
    put_several4(v, 1u, sliding[0], sliding[1], sliding[2], factor.lower);
    put_several4(v, 2u, tip_a[0], tip_a[1], tip_a[2], u);
    put_several(v, 0u, tip_l[0]);
    put_several(v, 1u, tip_l[1]);
    put_several(v, 2u, tip_l[2]);
    keep_moments(v, load.own);
    var next = part;
    next.inertia = Inertia(
        sym_zero(),
        zero33(),
        sym_sub(part.inertia.linear, gram3(sliding)),
    );
    next.bias = Force(drive, part.bias.linear + u * sliding);
    next.tip = Matrix6(
        zero33(),
        zero33(),
        part.tip.la - transpose(sliding) * tip_a,
        part.tip.ll - transpose(sliding) * tip_l,
    );
    next.compliance = inertia_add(
        part.compliance,
        Inertia(gram3(tip_a), transpose(tip_l) * tip_a, gram3(tip_l)),
    );
    next.drift = force_add(part.drift, Force(u * tip_a, u * tip_l));
    if HAS_OWN && is_turning_held(load.own) {
        next.inertia.angular = sym_sub(part.inertia.angular, gram3(turning));
        next.inertia.coupling = part.inertia.coupling - transpose(sliding) * turning;
        next.bias.angular = part.bias.angular + u * turning;
        next.tip.aa = part.tip.aa - transpose(turning) * tip_a;
        next.tip.al = part.tip.al - transpose(turning) * tip_l;
    }
    return accelerated(next, c);
}

fn put_several_inverse(v: u32, inverse: Inverse) {
    let f = inverse.factor;
    let z = inverse.far;
    let y = inverse.bias;
    put_several4(v, 0u, f.angular.inverse, f.angular.lower, f.linear.inverse, f.linear.lower);
    put_several4(v, 1u, f.coupling[0], f.coupling[1], f.coupling[2], y.angular);
    put_several4(v, 2u, z.aa[0], z.aa[1], z.aa[2], z.al[0]);
    put_several4(v, 3u, z.la[0], z.la[1], z.la[2], z.al[1]);
    put_several4(v, 4u, z.ll[0], z.ll[1], z.ll[2], z.al[2]);
    put_several(v, 5u, y.linear);
}

fn get_several_inverse(v: u32) -> Inverse {
    let f = get_several4(v, 0u);
    let h = get_several4(v, 1u);
    let aa = get_several4(v, 2u);
    let la = get_several4(v, 3u);
    let ll = get_several4(v, 4u);
    return inverse_of(f, h, aa, la, ll, get_several(v, 5u));
}

// What a free joint moves that is held back.
fn put_held(v: u32, m: Inertia) {
    put_several4(v, 5u, m.angular.diagonal, m.angular.off, m.linear.diagonal, m.linear.off);
    for (var i = 0u; i < 3u; i++) {
        let at = freedoms_at() + 3u * sizes.dofs + v + i;
        put(at, vec4<real>(m.coupling[i], fetch(at).w));
    }
}

fn get_held(v: u32) -> Inertia {
    let m = get_several4(v, 5u);
    let coupling = mat3x3<real>(get_several(v, 0u), get_several(v, 1u), get_several(v, 2u));
    return Inertia(Sym3(m.a, m.b), coupling, Sym3(m.c, m.d));
}

// Lets all six freedoms go: what is beyond moves by itself, with M a = f_Q - pA + B f2. If the freedoms have
// inertia of their own, that holds it back, and what is left of M is kept with the rest.
fn let_all_go(part: Interior, load: Load, axes: mat3x3<real>, spot: Spot, c: Motion) -> Interior {
    let v = spot.v;
    let drive = Force(axes * load.force.angular, axes * load.force.linear);
    let rounding: real = 4.0 * EPSILON;
    var moved = part.inertia;
    moved.angular = with_own3(moved.angular, load.own.angular, axes);
    moved.linear = with_own3(moved.linear, load.own.linear, axes);
    let factor = cholesky6(moved, part.carried.x * rounding, part.carried.y * rounding);
    if !factor.positive {
        fail(SINGULAR, spot.slot);
    }
    let far = lower66(factor, part.tip);
    let bias = lower6(factor, force_sub(part.bias, drive));
    put_several_inverse(v, Inverse(factor, far, bias));
    var next = part;
    next.inertia = inertia_zero();
    next.bias = drive;
    next.tip = matrix6_zero();
    next.compliance = inertia_add(part.compliance, gram6(far));
    next.drift = force_sub(part.drift, matrix6_transpose_mul(far, bias));
    if HAS_OWN {
        keep_own3(v, load.own.angular);
        keep_own3(v + 3u, load.own.linear);
        if is_held(load.own) {
            put_held(v, part.inertia);
            let columns = lower66(factor, matrix6_of(part.inertia));
            next.inertia = inertia_add(part.inertia, inertia_scaled(gram6(columns), -1.0));
            next.bias = force_sub(part.bias, matrix6_transpose_mul(columns, bias));
            next.tip = matrix6_less(part.tip, transpose_product(columns, far));
            return accelerated(next, c);
        }
    }
    return next;
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
    var second = cholesky3_upper(factor, wanted - turning * once);
    if HAS_OWN && is_turning_held(moments_kept(v)) {
        // Which would have to know its part of what is wanted.
        second = zero3();
    }
    return Response(
        Motion(once + second, given.linear),
        Motion((first + second) * axes, zero3()),
    );
}

fn respond_free(v: u32, axes: mat3x3<real>, f2: Force, given: Motion) -> Response {
    let inverse = get_several_inverse(v);
    let moved = force_sub(matrix6_mul(inverse.far, f2), inverse.bias);
    if HAS_OWN && is_held(Force(own_kept3(v), own_kept3(v + 3u))) {
        let held = lower6(inverse.factor, inertia_mul(get_held(v), given));
        let qdd = upper6(inverse.factor, force_sub(moved, held));
        let body = Motion(given.angular + qdd.angular, given.linear + qdd.linear);
        return Response(body, Motion(qdd.angular * axes, qdd.linear * axes));
    }
    let a = upper6(inverse.factor, moved);
    return Response(
        Motion(a.angular, a.linear),
        Motion((a.angular - given.angular) * axes, (a.linear - given.linear) * axes),
    );
}
