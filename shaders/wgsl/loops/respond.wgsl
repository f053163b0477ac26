// What forces of loops do: lambda = (A + mu 1)^-1 r, then H^-1 J' lambda with the factors at hand.

// r, then lambda.
var<workgroup> multipliers: array<real, MOST_ROWS>;

// Forwards and back by columns, each of which waits for the one before.
fn solve_matrix(g: Group, lane: u32) {
    for (var j = 0u; j < g.rows; j++) {
        workgroupBarrier();
        let pivot = number(row_memory(g, j) + PIVOT);
        let x: real = multipliers[j] * pivot;
        let passes = passes_for(g.rows - j - 1u);
        for (var pass_ = 0u; pass_ < passes; pass_++) {
            let i = j + 1u + pass_ * LANES + lane;
            if i < g.rows {
                let row = row_at(g, i);
                if row.begin <= j {
                    multipliers[i] -= number(row.matrix + j - row.begin) * x;
                }
            }
        }
    }
    workgroupBarrier();
    let passes = passes_for(g.rows);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            let pivot = number(row_memory(g, r) + PIVOT);
            multipliers[r] *= pivot;
        }
    }
    for (var n = 0u; n < g.rows; n++) {
        workgroupBarrier();
        let j = g.rows - 1u - n;
        let row = row_at(g, j);
        let x: real = multipliers[j] * number(row_memory(g, j) + PIVOT);
        let above = passes_for(j - row.begin);
        for (var pass_ = 0u; pass_ < above; pass_++) {
            let i = row.begin + pass_ * LANES + lane;
            if i < j {
                multipliers[i] -= number(row.matrix + i - row.begin) * x;
            }
        }
    }
    workgroupBarrier();
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            let at = row_memory(g, r);
            multipliers[r] *= number(at + PIVOT) * number(at + SCALE);
        }
    }
    workgroupBarrier();
}

// J' lambda of one freedom.
fn gathered(g: Group, dof: u32) -> real {
    let at = g.dofs_at + 3u * dof;
    let list = words[at + 1u];
    let count = words[at + 2u];
    var sum: real = 0.0;
    for (var n = 0u; n < count; n++) {
        let c = constraint_at(words[list + 2u * n]);
        let entry = words[list + 2u * n + 1u];
        for (var i = 0u; i < c.rows; i++) {
            let row = row_at(g, c.first_row + i);
            sum += multipliers[c.first_row + i] * number(row.jacobian + entry);
        }
    }
    return sum;
}

fn rise(g: Group, body: u32) {
    let member = member_at(g, body);
    let freedoms = freedoms_of(kind_of(member.spot.flags));
    var f = force_zero();
    for (var i = 0u; i < member.child_count; i++) {
        f = force_add(f, six(body_memory(g, member.children + i) + PASSED));
    }
    for (var k = 0u; k < freedoms; k++) {
        put_number(freedom_memory(g, member.dof + k) + SOLVED, gathered(g, member.dof + k));
    }
    let solved = freedom_memory(g, member.dof) + SOLVED;
    f = passed_on(g, body, f, solved, solved, FREEDOM, false);
    put_six(body_memory(g, body) + PASSED, f.angular, f.linear);
}

fn fall(g: Group, body: u32) {
    let member = member_at(g, body);
    let at = body_memory(g, body);
    let axes = quaternion_matrix(vec4<real>(three(at + FACTORED), number(at + FACTORED + 3u)));
    var a = motion_zero();
    if member.parent != NONE {
        let given = six(body_memory(g, member.parent) + RESPONSE);
        a = motion_shifted(Motion(given.angular, given.linear), three(at + FACTORED + 4u));
    }
    let freedoms = freedoms_of(kind_of(member.spot.flags));
    for (var i = 0u; i < freedoms; i++) {
        let k = freedoms - 1u - i;
        let s = let_go_along(member.spot, k, axes);
        let own = freedom_memory(g, member.dof + k);
        let x: real = (number(own + SOLVED) - motion_dot(a, six(own))) * number(own + D_INVERSE);
        a = Motion(a.angular + s.angular * x, a.linear + s.linear * x);
        put_number(own + SOLVED, x);
    }
    put_about_axes(member.spot, freedom_memory(g, member.dof) + SOLVED);
    put_six(at + RESPONSE, a.angular, a.linear);
}

fn substitute(g: Group, lane: u32) {
    for (var i = 0u; i < g.levels; i++) {
        let bounds = level_at(g, g.levels - 1u - i);
        let passes = passes_for(bounds.y - bounds.x);
        for (var pass_ = 0u; pass_ < passes; pass_++) {
            let body = bounds.x + pass_ * LANES + lane;
            if body < bounds.y {
                rise(g, body);
            }
        }
        wait_for_numbers();
    }
    for (var level = 0u; level < g.levels; level++) {
        let bounds = level_at(g, level);
        let passes = passes_for(bounds.y - bounds.x);
        for (var pass_ = 0u; pass_ < passes; pass_++) {
            let body = bounds.x + pass_ * LANES + lane;
            if body < bounds.y {
                fall(g, body);
            }
        }
        wait_for_numbers();
    }
}
