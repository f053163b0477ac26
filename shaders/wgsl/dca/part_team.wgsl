// Joins, down: six of a team's lanes own an equation each.

// The force between the parts of one join of each team, or none.
fn go_down_join(join: u32, has_join: bool, lane: u32) {
    let place = lane / TEAM;
    let own = lane % TEAM;
    let first_column = COLUMNS * place;
    let first_rest = NODE_NUMBERS * place;
    var x = force_zero();
    var f2 = force_zero();
    var factor: Cholesky6;
    if has_join {
        let at = joined_at(join);
        for (var i = own; i < FACTOR; i += TEAM) {
            let v = vec4<real>(nodes[at + i]);
            let to = first_column + 4u * i;
            columns[to] = v.x;
            columns[to + 1u] = v.y;
            columns[to + 2u] = v.z;
            columns[to + 3u] = v.w;
        }
        // Read by all, so that it is there when one needs it.
        factor = get_factor(at + FACTOR);
        let before = join_word(join, JOIN_BEFORE);
        let after = join_word(join, JOIN_AFTER);
        if before != NONE {
            x = acting(before);
        } else {
            x = hanging_again(join_word(join, HEAD), join_word(join, CARRIER));
        }
        if after != NONE {
            f2 = force_scaled(acting(after), -1.0);
        }
    }
    workgroupBarrier();
    if has_join && own < 6u {
        let at = first_column + own;
        let along = row_dot(at, x) - row_dot(at + 36u, f2);
        inboard_node[first_rest + own] = columns[at + BIAS] + along;
    }
    workgroupBarrier();
    if has_join && own == 0u {
        let rest = Force(inboard3(first_rest), inboard3(first_rest + 3u));
        let force = upper6(factor, rest);
        put_acting(join, force);
        keep_force(join, force);
    }
    workgroupBarrier();
}

// A row of six columns times a vector.
fn row_dot(at: u32, v: Force) -> real {
    let angular = vec3<real>(columns[at], columns[at + 6u], columns[at + 12u]);
    let linear = vec3<real>(columns[at + 18u], columns[at + 24u], columns[at + 30u]);
    return dot(angular, v.angular) + dot(linear, v.linear);
}
