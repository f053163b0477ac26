// Joins, up: 16 lanes each, of which twelve own a column each of Y_A and Y_B, another one y; all factor G by
// themselves, so that none waits for another.

// Rounding of the tree as multiples of rounding of the chunks.
override COARSER: f32 = 1.0;

const NODE_NUMBERS = 4u * NODE_SIZE;
// Starts of the parts of a node.
const B1 = 36u;
const B2 = 42u;
const PHI11 = 48u;
const PHI22 = 69u;

// Columns of Y_A, Y_B, and y.
const COLUMNS = 13u;
const COLUMN_NUMBERS = 80u;

// Both parts' nodes, of which the first becomes the whole's, and columns.
var<workgroup> inboard_node: array<real, NODE_NUMBERS * JOINS>;
var<workgroup> outboard_node: array<real, NODE_NUMBERS * JOINS>;
var<workgroup> columns: array<real, COLUMN_NUMBERS * JOINS>;

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
fn go_up_join(seam: Seam, has_join: bool, lane: u32) {
    let place = lane / TEAM;
    let own = lane % TEAM;
    let first = NODE_NUMBERS * place;
    if has_join {
        let a = node_at(seam.inboard);
        let b = node_at(seam.outboard);
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
    let first_column = COLUMN_NUMBERS * place;
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
        if own < COLUMNS {
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

    if has_join && own < COLUMNS {
        multiply(first, first_column, own, y, seam.head != NONE);
    }
    workgroupBarrier();

    if has_join {
        let to = node_at(sizes.chunk_nodes + seam.join);
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
        if own < COLUMNS {
            let solved = upper6(factor, y);
            let at = joined_at(seam.join);
            put_number(at, own, solved.angular.x);
            put_number(at + ROW_SIZE, own, solved.angular.y);
            put_number(at + 2u * ROW_SIZE, own, solved.angular.z);
            put_number(at + 3u * ROW_SIZE, own, solved.linear.x);
            put_number(at + 4u * ROW_SIZE, own, solved.linear.y);
            put_number(at + 5u * ROW_SIZE, own, solved.linear.z);
        } else if own == COLUMNS {
            if !factor.positive {
                fail(UNJOINED, cut_of(seam.join));
            }
            keep_factor(seam.join, factor);
            if seam.rake != NONE {
                put_path_rake(seam.rake, first);
            }
        }
    }
    // Before the next joins take their places.
    workgroupBarrier();
}

// The products of all columns by two: a lane's with the six that follow, in a ring of thirteen, and with
// itself, so that each pair is one lane's and all have the same number. They make up the whole's node.
fn multiply(first: u32, first_column: u32, own: u32, y: Force, is_head: bool) {
    let sign: real = select(real(-1.0), real(1.0), is_head);
    for (var step = 0u; step < 7u; step++) {
        let other = select(own + step, own + step - COLUMNS, own + step >= COLUMNS);
        let z = column(first_column + 6u * other);
        let product: real = dot(y.angular, z.angular) + dot(y.linear, z.linear);
        let a = min(own, other);
        let b = max(own, other);
        let is_inboard = a < 6u;
        var to: u32;
        var factor: real = sign;
        if b == 12u {
            to = select(B2 + a - 6u, B1 + a, is_inboard);
            factor = select(real(1.0), sign, is_inboard);
        } else if is_inboard == (b < 6u) {
            let i = select(b - 6u, b, is_inboard);
            let k = select(a - 6u, a, is_inboard);
            to = select(PHI22, PHI11, is_inboard) + i * (i + 1u) / 2u + k;
            factor = select(real(-1.0), sign, is_inboard);
        } else {
            to = 6u * a + b - 6u;
            factor = 1.0;
        }
        if a < 12u {
            var before: real = select(outboard_node[first + to], inboard_node[first + to], is_inboard);
            if to < B1 {
                before = 0.0;
            }
            inboard_node[first + to] = before + factor * product;
        }
    }
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
