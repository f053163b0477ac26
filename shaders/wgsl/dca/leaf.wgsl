// A chunk's last body where it is a leaf of its own, joined at its joint to what the recursion has gathered;
// join.rs of the dynamics has the formulas. The basis of the constraint forces is the joint's axes without
// those of its freedoms, whose rows and columns of G are those of the identity instead.

const HAS_LEAVES = true;

struct Mask {
    angular: vec3<real>,
    linear: vec3<real>,
}

// 1 where the joint transmits a force, 0 along its freedoms.
fn constraint_of(kind: u32) -> Mask {
    let all: vec3<real> = vec3<real>(1.0, 1.0, 1.0);
    let but_z: vec3<real> = vec3<real>(1.0, 1.0, 0.0);
    switch kind {
        case REVOLUTE, SCREW: { return Mask(but_z, all); }
        case PRISMATIC: { return Mask(all, but_z); }
        case SPHERICAL: { return Mask(zero3(), all); }
        case FREE: { return Mask(zero3(), zero3()); }
        default: { return Mask(all, all); }
    }
}

// The same with freedoms that have inertia of their own, of which the force is one more to be found.
fn mask_of(kind: u32, drive: Drive) -> Mask {
    let mask = constraint_of(kind);
    let more = holding(drive);
    return Mask(mask.angular + more.angular, mask.linear + more.linear);
}

fn sym_masked(s: Sym3, mask: vec3<real>) -> Sym3 {
    return Sym3(
        s.diagonal * mask + (vec3<real>(1.0, 1.0, 1.0) - mask),
        s.off * (mask.yzx * mask.zxy),
    );
}

fn inertia_masked(m: Inertia, mask: Mask) -> Inertia {
    return Inertia(
        sym_masked(m.angular, mask.angular),
        mat3x3<real>(
            m.coupling[0] * (mask.linear * mask.angular.x),
            m.coupling[1] * (mask.linear * mask.angular.y),
            m.coupling[2] * (mask.linear * mask.angular.z),
        ),
        sym_masked(m.linear, mask.linear),
    );
}

fn force_projected(f: Force, axes: mat3x3<real>, pitch: real, mask: Mask) -> Force {
    let seen = seen_along(pitch, Force(f.angular * axes, f.linear * axes));
    return Force(seen.angular * mask.angular, seen.linear * mask.linear);
}

fn columns_turned(m: mat3x3<real>, axes: mat3x3<real>) -> mat3x3<real> {
    return mat3x3<real>(m[0] * axes, m[1] * axes, m[2] * axes);
}

fn rows_masked(m: mat3x3<real>, mask: vec3<real>) -> mat3x3<real> {
    return mat3x3<real>(m[0] * mask, m[1] * mask, m[2] * mask);
}

fn matrix6_projected(m: Matrix6, axes: mat3x3<real>, pitch: real, mask: Mask) -> Matrix6 {
    let turned = Matrix6(
        columns_turned(m.aa, axes),
        columns_turned(m.al, axes),
        columns_turned(m.la, axes),
        columns_turned(m.ll, axes),
    );
    let seen = rows_along(pitch, turned);
    return Matrix6(
        rows_masked(seen.aa, mask.angular),
        rows_masked(seen.al, mask.angular),
        rows_masked(seen.la, mask.linear),
        rows_masked(seen.ll, mask.linear),
    );
}

// A force given by its components along a joint's freedoms and across, in world axes.
fn force_in_world(f: Force, axes: mat3x3<real>, pitch: real) -> Force {
    let whole = put_along(pitch, f);
    return Force(axes * whole.angular, axes * whole.linear);
}

fn with_leaf(is_head: bool, a: Node, slot: u32, share: real, index: u32) -> Node {
    let flags = flags_of(slot);
    let kind = kind_of(flags);
    let placed = get_placed(slot);
    let axes = quaternion_matrix(placed.rotation);
    let arm = axes * arm_of(slot, flags);
    let body = body_share(slot, flags, placed, axes, share, control[PUSHED] != 0u);
    let own_factor: Cholesky6 = cholesky6(body.inertia, 0.0, 0.0);
    // What maps forces at the joint to forces at the centre of mass.
    let to_center = matrix6_shifted_back(matrix6_one(), -arm);
    let far = lower66(own_factor, to_center);
    let own = lower_inverse(own_factor);
    let own_bias = lower6(own_factor, body.bias);
    let outwards = centripetal(placed.spin, -arm);
    let b: Node = Node(
        gram6(far),
        transpose_product(far, own),
        gram6(own),
        force_sub(
            Force(outwards.angular, outwards.linear),
            matrix6_transpose_mul(far, own_bias),
        ),
        force_scaled(matrix6_transpose_mul(own, own_bias), -1.0),
    );
    let pitch = pitch_of(slot);
    let own_drive = drive_of(slot, kind);
    let basis = joint_basis(kind, dof_of(slot), axes);
    let drive = force_in_world(own_drive.force, basis, pitch);
    let mask = mask_of(kind, own_drive);
    let g = inertia_add(a.phi22, b.phi11);
    let c = placed.bias_acceleration;
    let moved = inertia_mul(g, Motion(drive.angular, drive.linear));
    let apart = force_sub(
        force_sub(force_add(a.b2, Force(c.angular, c.linear)), b.b1),
        moved,
    );
    var whole = finish(
        is_head,
        a,
        b,
        compliant(
            inertia_masked(inertia_along(pitch, inertia_rotated(g, transpose(basis))), mask),
            own_drive,
        ),
        matrix6_projected(matrix6_transposed(a.phi12), basis, pitch, mask),
        matrix6_projected(b.phi12, basis, pitch, mask),
        with_held(force_projected(apart, basis, pitch, mask), own_drive),
    );
    if !(own_factor.positive && whole.joined.factor.positive) {
        fail(UNJOINED, slot);
    }
    let sign: real = select(real(-1.0), real(1.0), is_head);
    whole.node.b1 = force_add(whole.node.b1, force_scaled(matrix6_mul(a.phi12, drive), sign));
    whole.node.b2 = force_add(whole.node.b2, matrix6_transpose_mul(b.phi12, drive));
    put_leaf(index, own_factor, own_bias, whole.joined);
    return whole.node;
}

fn put_leaf(index: u32, own: Cholesky6, own_bias: Force, joined: Joined) {
    let at = leaves_at() + index;
    let n = sizes.leaves;
    let f = joined.factor;
    let i = joined.inboard;
    let o = joined.outboard;
    put4(at, n, f.angular.inverse, f.angular.lower, f.linear.inverse, f.linear.lower);
    put4(at + 3u * n, n, f.coupling[0], f.coupling[1], f.coupling[2], joined.bias.angular);
    put4(at + 6u * n, n, i.aa[0], i.aa[1], i.aa[2], joined.bias.linear);
    put4(at + 9u * n, n, i.al[0], i.al[1], i.al[2], o.aa[0]);
    put4(at + 12u * n, n, i.la[0], i.la[1], i.la[2], o.aa[1]);
    put4(at + 15u * n, n, i.ll[0], i.ll[1], i.ll[2], o.aa[2]);
    put4(at + 18u * n, n, o.al[0], o.al[1], o.al[2], o.la[0]);
    put4(at + 21u * n, n, o.ll[0], o.ll[1], o.ll[2], o.la[1]);
    let m = own;
    put4(at + 24u * n, n, m.angular.inverse, m.angular.lower, m.linear.inverse, m.linear.lower);
    put4(at + 27u * n, n, m.coupling[0], m.coupling[1], m.coupling[2], o.la[2]);
    put(at + 30u * n, vec4<real>(own_bias.angular, 0.0));
    put(at + 31u * n, vec4<real>(own_bias.linear, 0.0));
}

struct Leaf {
    own: Cholesky6,
    own_bias: Force,
    joined: Joined,
}

fn get_leaf(index: u32) -> Leaf {
    let at = leaves_at() + index;
    let n = sizes.leaves;
    let f = get4(at, n);
    let h = get4(at + 3u * n, n);
    let aa = get4(at + 6u * n, n);
    let al = get4(at + 9u * n, n);
    let la = get4(at + 12u * n, n);
    let ll = get4(at + 15u * n, n);
    let o = get4(at + 18u * n, n);
    let l = get4(at + 21u * n, n);
    let m = get4(at + 24u * n, n);
    let k = get4(at + 27u * n, n);
    let joined = Joined(
        Cholesky6(
            Cholesky3(f.a, f.b, true),
            mat3x3<real>(h.a, h.b, h.c),
            Cholesky3(f.c, f.d, true),
            true,
        ),
        Matrix6(
            mat3x3<real>(aa.a, aa.b, aa.c),
            mat3x3<real>(al.a, al.b, al.c),
            mat3x3<real>(la.a, la.b, la.c),
            mat3x3<real>(ll.a, ll.b, ll.c),
        ),
        Matrix6(
            mat3x3<real>(al.d, la.d, ll.d),
            mat3x3<real>(o.a, o.b, o.c),
            mat3x3<real>(o.d, l.d, k.d),
            mat3x3<real>(l.a, l.b, l.c),
        ),
        Force(h.d, aa.d),
    );
    let own = Cholesky6(
        Cholesky3(m.a, m.b, true),
        mat3x3<real>(k.a, k.b, k.c),
        Cholesky3(m.c, m.d, true),
        true,
    );
    return Leaf(own, Force(fetch(at + 30u * n).xyz, fetch(at + 31u * n).xyz), joined);
}

// The force that a leaf's joint transmits to it, given x and f2 at the ends of the chunk; the joint force itself is
// in the first solution.
fn leaf_force(slot: u32, index: u32, x: Force, f2: Force) -> Force {
    let leaf = get_leaf(index);
    let axes = quaternion_matrix(get_placed(slot).rotation);
    let kind = kind_of(flags_of(slot));
    var transmitted = force_between(leaf.joined, x, f2);
    if is_first() {
        let drive = drive_of(slot, kind);
        transmitted = force_add(transmitted, drive.force);
    }
    return force_in_world(transmitted, joint_basis(kind, dof_of(slot), axes), pitch_of(slot));
}

// A leaf, acted on by f2 at its centre of mass and by `force` at its joint, which `given` would accelerate if
// its freedoms stood still: of the accelerations on both sides the difference is S qdd.
fn respond_leaf(
    index: u32,
    slot: u32,
    spin: vec3<real>,
    arm: vec3<real>,
    kind: u32,
    axes: mat3x3<real>,
    f2: Force,
    force: Force,
    given: Motion,
) -> Response {
    let leaf = get_leaf(index);
    let total = force_add(f2, force_shifted_back(force, -arm));
    let center = upper6(leaf.own, force_sub(lower6(leaf.own, total), leaf.own_bias));
    let across = motion_add(
        motion_shifted(Motion(center.angular, center.linear), -arm),
        centripetal(spin, -arm),
    );
    let apart = motion_sub(across, given);
    var joint = Motion(apart.angular * axes, apart.linear * axes);
    switch kind {
        case REVOLUTE, SCREW: {
            joint = Motion(vec3<real>(rate_along(pitch_of(slot), joint), 0.0, 0.0), zero3());
        }
        case PRISMATIC: { joint = Motion(vec3<real>(joint.linear.z, 0.0, 0.0), zero3()); }
        case SPHERICAL: { joint.linear = zero3(); }
        case FREE: {}
        default: { joint = motion_zero(); }
    }
    return Response(across, joint);
}
