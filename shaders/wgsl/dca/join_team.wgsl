// Joins, up: twelve of a team's lanes own a column each of Y_A and Y_B, another one y; all factor G by
// themselves, so that none waits for another. Of the whole each then computes a row.

// Rounding of the tree as multiples of rounding of the chunks.
override COARSER: f32 = 1.0;

// Phi22 of the inboard part and Phi11 of the outboard one.
fn between(place: u32) -> Inertia {
    let p = NODE_NUMBERS * place + PHI22;
    let q = NODE_NUMBERS * place + PHI11;
    let x = inboard3(p) + outboard3(q);
    let y = inboard3(p + 3u) + outboard3(q + 3u);
    let row3 = inboard3(p + 6u) + outboard3(q + 6u);
    let row4 = inboard3(p + 10u) + outboard3(q + 10u);
    let row5 = inboard3(p + 15u) + outboard3(q + 15u);
    let last = inboard3(p + 18u) + outboard3(q + 18u);
    let xx = inboard_node[p + 9u] + outboard_node[q + 9u];
    let xy = inboard_node[p + 13u] + outboard_node[q + 13u];
    let yy = inboard_node[p + 14u] + outboard_node[q + 14u];
    return Inertia(
        Sym3(vec3<real>(x.x, x.z, y.z), vec3<real>(y.y, y.x, x.y)),
        transpose(mat3x3<real>(row3, row4, row5)),
        Sym3(vec3<real>(xx, yy, last.z), vec3<real>(last.y, last.x, xy)),
    );
}

// Where the lower triangle of a symmetric matrix has a number.
fn lower_at(row: u32, other: u32) -> u32 {
    let i = max(row, other);
    return i * (i + 1u) / 2u + min(row, other);
}

// One join of each team, or none; all lanes of the workgroup come here.
fn go_up_join(join: u32, has_join: bool, lane: u32) {
    let place = lane / TEAM;
    let own = lane % TEAM;
    let first = NODE_NUMBERS * place;
    // What is needed later, so that it is there by then.
    let head = join_word(join, HEAD);
    let rake = join_word(join, JOIN_RAKE);
    let cut = join_word(join, CUT);
    if has_join {
        let a = node_at(join_word(join, INBOARD_NODE));
        let b = node_at(join_word(join, OUTBOARD_NODE));
        for (var i = own; i < NODE_SIZE; i += TEAM) {
            let v = vec4<real>(nodes[a + i]);
            let w = vec4<real>(nodes[b + i]);
            let to = first + 4u * i;
            inboard_node[to] = v.x;
            inboard_node[to + 1u] = v.y;
            inboard_node[to + 2u] = v.z;
            inboard_node[to + 3u] = v.w;
            outboard_node[to] = w.x;
            outboard_node[to + 1u] = w.y;
            outboard_node[to + 2u] = w.z;
            outboard_node[to + 3u] = w.w;
        }
    }
    workgroupBarrier();

    // Column 0 to 5 of Phi21 of the inboard part, 6 to 11 of Phi12 of the outboard one, or the bias.
    var factor: Cholesky6;
    var y = force_zero();
    let first_column = COLUMNS * place;
    if has_join {
        factor = cholesky6(between(place), 0.0, 0.0);
        if own < 6u {
            let row = first + 6u * own;
            y = Force(inboard3(row), inboard3(row + 3u));
        } else if own < 12u {
            let at = first + own - 6u;
            y = Force(
                vec3<real>(outboard_node[at], outboard_node[at + 6u], outboard_node[at + 12u]),
                vec3<real>(outboard_node[at + 18u], outboard_node[at + 24u], outboard_node[at + 30u]),
            );
        } else {
            y = Force(
                inboard3(first + B2) - outboard3(first + B1),
                inboard3(first + B2 + 3u) - outboard3(first + B1 + 3u),
            );
        }
        y = lower6(factor, y);
        if own < 13u {
            let at = first_column + 6u * own;
            columns[at] = y.angular.x;
            columns[at + 1u] = y.angular.y;
            columns[at + 2u] = y.angular.z;
            columns[at + 3u] = y.linear.x;
            columns[at + 4u] = y.linear.y;
            columns[at + 5u] = y.linear.z;
        }
    }
    workgroupBarrier();

    let sign: real = select(real(-1.0), real(1.0), head != NONE);
    if has_join && own < 6u {
        let bias: real = force_dot(y, column(first_column + BIAS));
        inboard_node[first + B1 + own] += sign * bias;
        for (var i = 0u; i < 6u; i++) {
            inboard_node[first + 6u * own + i] = force_dot(y, column(first_column + 36u + 6u * i));
            if i <= own {
                let product: real = force_dot(y, column(first_column + 6u * i));
                inboard_node[first + PHI11 + lower_at(own, i)] += sign * product;
            }
        }
    } else if has_join && own < 12u {
        let row = own - 6u;
        let bias: real = force_dot(y, column(first_column + BIAS));
        inboard_node[first + B2 + row] = outboard_node[first + B2 + row] + bias;
        for (var i = 0u; i < row + 1u; i++) {
            let product: real = force_dot(y, column(first_column + 36u + 6u * i));
            let at = first + PHI22 + lower_at(row, i);
            inboard_node[at] = outboard_node[at] - product;
        }
    } else if has_join && own == 12u {
        if !factor.positive {
            fail(UNJOINED, cut);
        }
        let at = joined_at(join) + FACTOR;
        let a = factor.angular;
        let l = factor.linear;
        let c = factor.coupling;
        tree_put_vectors(at, a.inverse, a.lower, l.inverse, l.lower);
        tree_put_vectors(at + 3u, c[0], c[1], c[2], zero3());
    }
    workgroupBarrier();

    if has_join {
        let to = node_at(sizes.chunk_nodes + join);
        for (var i = own; i < NODE_SIZE; i += TEAM) {
            let at = first + 4u * i;
            tree_put(
                to + i,
                inboard_node[at],
                inboard_node[at + 1u],
                inboard_node[at + 2u],
                inboard_node[at + 3u],
            );
        }
        for (var i = own; i < FACTOR; i += TEAM) {
            let at = first_column + 4u * i;
            tree_put(
                joined_at(join) + i,
                columns[at],
                columns[at + 1u],
                columns[at + 2u],
                columns[at + 3u],
            );
        }
        if rake != NONE && own == 0u {
            put_path_rake(rake, first);
        }
    }
    // Before the next joins take their places.
    workgroupBarrier();
}

// A path's inertia and bias force, for the body that carries it.
fn put_path_rake(rake: u32, first: u32) {
    let p = first + PHI11;
    let x = inboard3(p);
    let y = inboard3(p + 3u);
    let last = inboard3(p + 18u);
    let inertia = Inertia(
        Sym3(vec3<real>(x.x, x.z, y.z), vec3<real>(y.y, y.x, x.y)),
        transpose(mat3x3<real>(inboard3(p + 6u), inboard3(p + 10u), inboard3(p + 15u))),
        Sym3(
            vec3<real>(inboard_node[p + 9u], inboard_node[p + 14u], last.z),
            vec3<real>(last.y, last.x, inboard_node[p + 13u]),
        ),
    );
    let bias = Force(inboard3(first + B1), inboard3(first + B1 + 3u));
    put_rake(rake, Rake(inertia, bias, vec2<real>(0.0, 0.0)), real(COARSER));
}
