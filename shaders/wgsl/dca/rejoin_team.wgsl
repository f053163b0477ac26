// Joins, up in a correction: y anew from the accelerations that differ, and what it adds to those of the
// whole; join.rs of the dynamics has the formulas (`rejoin`).

// One join of each team, or none; all lanes of the workgroup come here.
fn go_up_join(join: u32, has_join: bool, lane: u32) {
    let place = lane / TEAM;
    let own = lane % TEAM;
    let first = NODE_NUMBERS * place;
    let first_column = COLUMNS * place;
    let head = join_word(join, HEAD);
    let rake = join_word(join, JOIN_RAKE);
    var factor: Cholesky6;
    var differing = force_zero();
    if has_join {
        let at = joined_at(join);
        for (var i = own; i < SIDES; i += TEAM) {
            let v = vec4<real>(nodes[at + i]);
            let to = first_column + 4u * i;
            columns[to] = v.x;
            columns[to + 1u] = v.y;
            columns[to + 2u] = v.z;
            columns[to + 3u] = v.w;
        }
        if own < CHANGE_SIZE {
            let v = vec4<real>(nodes[change_at(join_word(join, INBOARD_NODE)) + own]);
            let w = vec4<real>(nodes[change_at(join_word(join, OUTBOARD_NODE)) + own]);
            let to = first + 4u * own;
            inboard_node[to] = v.x;
            inboard_node[to + 1u] = v.y;
            inboard_node[to + 2u] = v.z;
            inboard_node[to + 3u] = v.w;
            outboard_node[to] = w.x;
            outboard_node[to + 1u] = w.y;
            outboard_node[to + 2u] = w.z;
            outboard_node[to + 3u] = w.w;
        }
        factor = get_factor(at + FACTOR);
        differing = apart(join);
    }
    workgroupBarrier();
    var y = force_zero();
    if has_join {
        let b2 = Force(inboard3(first + 6u), inboard3(first + 9u));
        let b1 = Force(outboard3(first), outboard3(first + 3u));
        y = lower6(factor, force_add(differing, force_sub(b2, b1)));
        let sign: real = select(real(-1.0), real(1.0), head != NONE);
        if own < 6u {
            let by: real = force_dot(column(first_column + 6u * own), y);
            inboard_node[first + 12u + own] = inboard_node[first + own] + sign * by;
        } else if own < 12u {
            let by: real = force_dot(column(first_column + 6u * own), y);
            inboard_node[first + 12u + own] = outboard_node[first + own] + by;
        }
    }
    workgroupBarrier();
    if has_join {
        let changed = first + 12u;
        if own < CHANGE_SIZE {
            let at = changed + 4u * own;
            tree_put(
                change_at(sizes.chunk_nodes + join) + own,
                inboard_node[at],
                inboard_node[at + 1u],
                inboard_node[at + 2u],
                inboard_node[at + 3u],
            );
        } else if own == CHANGE_SIZE {
            let at = joined_at(join) + SIDES;
            tree_put(at, y.angular.x, y.angular.y, y.angular.z, y.linear.x);
            tree_put(at + 1u, y.linear.y, y.linear.z, 0.0, 0.0);
        } else if own == CHANGE_SIZE + 1u && rake != NONE {
            add_to_rake(rake, Force(inboard3(changed), inboard3(changed + 3u)));
        }
    }
    // Before the next joins take their places.
    workgroupBarrier();
}
