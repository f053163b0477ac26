// The joins of the tree, up and down: 16 lanes a join. Going up, twelve of them own a column each of Y_A and
// Y_B, another one y; all factor G by themselves, so that none waits for another. Of the whole each then
// computes a row. Going down six own an equation each.

// Rounding of the tree as multiples of rounding of the chunks.
override COARSER: f32 = 1.0;

const TEAM = 16u;
const JOINS = LANES / TEAM;

const NODE_NUMBERS = 4u * NODE_SIZE;
// Starts of the parts of a node.
const B1 = 36u;
const B2 = 42u;
const PHI11 = 48u;
const PHI22 = 69u;

// Columns of Y_A, Y_B, and y; two numbers more make fours.
const BIAS = 72u;
const COLUMNS = 80u;

// Both parts' nodes, of which the first becomes the whole's, and columns.
var<workgroup> inboard_node: array<real, NODE_NUMBERS * JOINS>;
var<workgroup> outboard_node: array<real, NODE_NUMBERS * JOINS>;
var<workgroup> columns: array<real, COLUMNS * JOINS>;

fn inboard3(at: u32) -> vec3<real> {
    return vec3<real>(inboard_node[at], inboard_node[at + 1u], inboard_node[at + 2u]);
}

fn outboard3(at: u32) -> vec3<real> {
    return vec3<real>(outboard_node[at], outboard_node[at + 1u], outboard_node[at + 2u]);
}

fn column(at: u32) -> Force {
    return Force(
        vec3<real>(columns[at], columns[at + 1u], columns[at + 2u]),
        vec3<real>(columns[at + 3u], columns[at + 4u], columns[at + 5u]),
    );
}

fn force_dot(a: Force, b: Force) -> real {
    return dot(a.angular, b.angular) + dot(a.linear, b.linear);
}

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
fn join_parts(join: u32, has_join: bool, lane: u32) {
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

// The force between the parts of one join of each team, or none.
fn part_parts(join: u32, has_join: bool, lane: u32) {
    let place = lane / TEAM;
    let own = lane % TEAM;
    let first_column = COLUMNS * place;
    let first_rest = NODE_NUMBERS * place;
    var ends = Ends(force_zero(), force_zero());
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
        let parent = join_word(join, JOIN_PARENT);
        if parent != NONE {
            ends = handed(parent);
        } else {
            ends.x = hanging(join_word(join, HEAD), join_word(join, CARRIER));
        }
    }
    workgroupBarrier();
    if has_join && own < 6u {
        let at = first_column + own;
        let along = row_dot(at, ends.x) - row_dot(at + 36u, ends.f2);
        inboard_node[first_rest + own] = columns[at + BIAS] + along;
    }
    workgroupBarrier();
    if has_join && own == 0u {
        let rest = Force(inboard3(first_rest), inboard3(first_rest + 3u));
        put_acting(join, ends, upper6(factor, rest));
    }
    workgroupBarrier();
}

fn get_factor(at: u32) -> Cholesky6 {
    let a = vec4<real>(nodes[at]);
    let b = vec4<real>(nodes[at + 1u]);
    let c = vec4<real>(nodes[at + 2u]);
    let d = vec4<real>(nodes[at + 3u]);
    let e = vec4<real>(nodes[at + 4u]);
    let f = vec4<real>(nodes[at + 5u]);
    return Cholesky6(
        Cholesky3(a.xyz, vec3<real>(a.w, b.xy), true),
        mat3x3<real>(d.xyz, vec3<real>(d.w, e.xy), vec3<real>(e.zw, f.x)),
        Cholesky3(vec3<real>(b.zw, c.x), c.yzw, true),
        true,
    );
}

// A row of six columns times a vector.
fn row_dot(at: u32, v: Force) -> real {
    let angular = vec3<real>(columns[at], columns[at + 6u], columns[at + 12u]);
    let linear = vec3<real>(columns[at + 18u], columns[at + 24u], columns[at + 30u]);
    return dot(angular, v.angular) + dot(linear, v.linear);
}
