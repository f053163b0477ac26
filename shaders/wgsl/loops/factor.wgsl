// Articulated inertias of a group, one freedom after the other, and A = Y'Y with its factor; aba.rs, substitute.rs
// and loops/solve.rs of the dynamics have the formulas.

fn put_handed(at: u32, m: Inertia) {
    put_three(at, m.angular.diagonal);
    put_three(at + 3u, m.angular.off);
    put_three(at + 6u, m.coupling[0]);
    put_three(at + 9u, m.coupling[1]);
    put_three(at + 12u, m.coupling[2]);
    put_three(at + 15u, m.linear.diagonal);
    put_three(at + 18u, m.linear.off);
}

fn handed(at: u32) -> Inertia {
    return Inertia(
        Sym3(three(at), three(at + 3u)),
        mat3x3<real>(three(at + 6u), three(at + 9u), three(at + 12u)),
        Sym3(three(at + 15u), three(at + 18u)),
    );
}

// Of a body in joint axes, about the joint's origin.
struct Mass {
    mass: real,
    moment: vec3<real>,
    rotational: Sym3,
}

fn mass_of(g: Group, body: u32) -> Mass {
    let constants = g.constants + 5u * body;
    let l1 = vec4<real>(links[constants + 1u]);
    let l2 = vec4<real>(links[constants + 2u]);
    let l3 = vec4<real>(links[constants + 3u]);
    let l4 = vec4<real>(links[constants + 4u]);
    let rotational = Sym3(vec3<real>(l2.w, l3.x, l3.y), vec3<real>(l3.z, l3.w, l4.x));
    return Mass(l1.w, l2.xyz, rotational);
}

fn let_member_go(g: Group, body: u32) {
    let member = member_at(g, body);
    let kind = kind_of(member.spot.flags);
    let at = body_memory(g, body);
    let p = place_of(g, body);
    // What substitutions go by.
    put_three(at + FACTORED, p.rotation.xyz);
    put_number(at + FACTORED + 3u, p.rotation.w);
    put_three(at + FACTORED + 4u, p.offset);
    let axes = quaternion_matrix(p.rotation);
    let l = mass_of(g, body);
    var inertia = inertia_rigid(sym_rotated(l.rotational, axes), axes * l.moment, l.mass);
    for (var i = 0u; i < member.child_count; i++) {
        let child = body_memory(g, member.children + i);
        inertia = inertia_add(inertia, handed(child + HANDED));
    }
    let freedoms = freedoms_of(kind);
    for (var k = 0u; k < freedoms; k++) {
        let s = let_go_along(member.spot, k, axes);
        let column = inertia_mul(inertia, s);
        let d: real = motion_dot(s, column) + own_inertia(member.spot, k);
        let is_positive: bool = d > 0.0 && is_finite(d);
        let d_inverse: real = select(
            real(0.0),
            1.0 / select(real(1.0), d, is_positive),
            is_positive,
        );
        if !is_positive {
            fail(SINGULAR, member.spot.slot);
        }
        inertia = inertia_less_outer(inertia, column, d_inverse);
        let to = freedom_memory(g, member.dof + k);
        put_six(to, column.angular, column.linear);
        put_number(to + D_INVERSE, d_inverse);
    }
    // What is left is known to be zero, unless the freedoms have inertia of their own.
    let lets_all_go = !has_own_inertia(member.spot);
    if lets_all_go && kind == FREE {
        inertia = inertia_zero();
    } else if lets_all_go && kind == SPHERICAL {
        inertia = Inertia(sym_zero(), mat3x3<real>(zero3(), zero3(), zero3()), inertia.linear);
    }
    put_handed(at + HANDED, inertia_shifted_back(inertia, p.offset));
}

fn let_members_go(g: Group, lane: u32) {
    for (var i = 0u; i < g.levels; i++) {
        let bounds = level_at(g, g.levels - 1u - i);
        let passes = passes_for(bounds.y - bounds.x);
        for (var pass_ = 0u; pass_ < passes; pass_++) {
            let body = bounds.x + pass_ * LANES + lane;
            if body < bounds.y {
                let_member_go(g, body);
            }
        }
        wait_for_numbers();
    }
}

// Takes what has arrived at a body through its joint, given its forces at `tau`: u, or D^(-1/2) u, to `onto`, which
// are `stride` apart.
fn passed_on(
    g: Group,
    body: u32,
    arriving: Force,
    tau: u32,
    onto: u32,
    stride: u32,
    is_whitened: bool,
) -> Force {
    let member = member_at(g, body);
    let kind = kind_of(member.spot.flags);
    let at = body_memory(g, body) + FACTORED;
    let axes = quaternion_matrix(vec4<real>(three(at), number(at + 3u)));
    var f = arriving;
    var drive = force_zero();
    let of_axes = given_about_axes(member.spot, tau, stride);
    let freedoms = freedoms_of(kind);
    for (var k = 0u; k < freedoms; k++) {
        let s = let_go_along(member.spot, k, axes);
        let own = freedom_memory(g, member.dof + k);
        let d_inverse = number(own + D_INVERSE);
        let given = given_along(member.spot, k, tau + stride * k, of_axes);
        let u: real = given - motion_dot(s, f);
        f = force_add(f, force_scaled(six(own), u * d_inverse));
        drive = force_add(drive, force_scaled(Force(s.angular, s.linear), given));
        put_number(onto + stride * k, select(u, u * sqrt(d_inverse), is_whitened));
    }
    // As the inertia, so the force: nothing but what drives the joint is held.
    let lets_all_go = !has_own_inertia(member.spot);
    if lets_all_go && kind == FREE {
        f = drive;
    } else if lets_all_go && kind == SPHERICAL {
        f.angular = drive.angular;
    }
    return force_shifted_back(f, three(at + 4u));
}

// A row of Y from one of J: up both chains, then up the bodies that carry both.
fn whiten_row(g: Group, r: u32) {
    let row = row_at(g, r);
    let c = constraint_at(row.constraint);
    var f = force_zero();
    var beside = force_zero();
    var entry = 0u;
    let length = c.first + c.second + c.carrying;
    for (var i = 0u; i < length; i++) {
        if i == c.first {
            beside = f;
            f = force_zero();
        }
        if i == c.first + c.second {
            f = force_add(f, beside);
        }
        let body = words[c.chains + i];
        let from_j = row.jacobian + entry;
        f = passed_on(g, body, f, from_j, row.whitened + entry, 1u, true);
        entry += freedoms_of(kind_of(member_at(g, body).spot.flags));
    }
    var square: real = 0.0;
    for (var i = 0u; i < c.entries; i++) {
        let y = number(row.whitened + i);
        square += y * y;
    }
    put_number(row_memory(g, r) + SQUARE, square);
}

// Lengths over the size of their loop, all of a loop over its largest compliance.
fn scale_row(g: Group, r: u32) {
    let row = row_at(g, r);
    let c = constraint_at(row.constraint);
    var compliance: real = 0.0;
    for (var i = 0u; i < c.rows; i++) {
        let size = size_of(row_at(g, c.first_row + i));
        let square = number(row_memory(g, c.first_row + i) + SQUARE);
        if !is_finite(square) {
            fail(OVERFLOW, member_at(g, words[c.chains]).spot.slot);
        }
        compliance = max(compliance, square / (size * size));
    }
    let moves: bool = compliance > 0.0;
    let inverse: real = 1.0 / sqrt(select(real(1.0), compliance, moves));
    put_number(
        row_memory(g, r) + SCALE,
        select(real(0.0), inverse / size_of(row), moves),
    );
    put_number(row_memory(g, r) + FORCE, real(0.0));
    for (var i = row.begin; i < r + 1u; i++) {
        put_number(row.matrix + i - row.begin, real(0.0));
    }
}

fn size_of(row: Row) -> real { return vec4<real>(links[row.constants]).y; }

// An entry of A between rows of two constraints that move the same joints: `pair` lists runs of these.
fn product_of(g: Group, pair: u32, i: u32, j: u32, proximal: real) {
    let at = g.pairs_at + 4u * pair;
    let one = constraint_at(words[at]);
    let other = constraint_at(words[at + 1u]);
    let r = one.first_row + i;
    let k = other.first_row + j;
    if i >= one.rows || j >= other.rows || k > r {
        return;
    }
    let row = row_at(g, r);
    let column = row_at(g, k);
    let list = words[at + 2u];
    let count = words[at + 3u];
    var sum: real = 0.0;
    for (var n = 0u; n < count; n++) {
        let own = row.whitened + words[list + 3u * n];
        let others = column.whitened + words[list + 3u * n + 1u];
        let length = words[list + 3u * n + 2u];
        for (var m = 0u; m < length; m++) {
            sum += number(own + m) * number(others + m);
        }
    }
    sum *= number(row_memory(g, r) + SCALE) * number(row_memory(g, k) + SCALE);
    put_number(row.matrix + k - row.begin, sum + select(real(0.0), proximal, k == r));
}

// Replaces A + mu 1 by its factor, column by column within its envelope.
fn factor_matrix(g: Group, lane: u32, floor: real) {
    for (var j = 0u; j < g.rows; j++) {
        let column = row_at(g, j);
        var diagonal: real = number(column.matrix + j - column.begin);
        for (var k = column.begin; k < j; k++) {
            let entry = number(column.matrix + k - column.begin);
            diagonal -= entry * entry;
        }
        let pivot: real = 1.0 / sqrt(max(diagonal, floor));
        if lane == 0u {
            put_number(row_memory(g, j) + PIVOT, pivot);
        }
        let passes = passes_for(g.rows - j - 1u);
        for (var pass_ = 0u; pass_ < passes; pass_++) {
            let i = j + 1u + pass_ * LANES + lane;
            if i < g.rows {
                let row = row_at(g, i);
                if row.begin <= j {
                    let to = row.matrix + j - row.begin;
                    var sum = number(to);
                    for (var k = max(row.begin, column.begin); k < j; k++) {
                        sum -= number(row.matrix + k - row.begin)
                            * number(column.matrix + k - column.begin);
                    }
                    put_number(to, sum * pivot);
                }
            }
        }
        wait_for_numbers();
    }
}

// Factors of the articulated inertias in the present place, and of A + mu 1.
fn factor(g: Group, lane: u32, proximal: real) {
    let_members_go(g, lane);
    let passes = passes_for(g.rows);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            whiten_row(g, r);
        }
    }
    wait_for_numbers();
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            scale_row(g, r);
        }
    }
    wait_for_numbers();
    let products = 36u * g.pairs;
    let product_passes = passes_for(products);
    for (var pass_ = 0u; pass_ < product_passes; pass_++) {
        let item = pass_ * LANES + lane;
        if item < products {
            product_of(g, item / 36u, item % 36u / 6u, item % 6u, proximal);
        }
    }
    wait_for_numbers();
    factor_matrix(g, lane, 0.5 * proximal);
}
