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

const HANDED = 6u;

// Both parts' nodes. A column takes the place of what it is solved from: a row of Phi12 of the inboard part, a
// column of that of the outboard one, the latter's b1. What stays the first's becomes the whole's but for Phi12.
const PAIR = 2u * NODE_NUMBERS;
var<workgroup> pairs: array<real, PAIR * JOINS>;

fn shared3(at: u32) -> vec3<real> {
    return vec3<real>(pairs[at], pairs[at + 1u], pairs[at + 2u]);
}

// Where a column starts, and how far its numbers are from each other.
struct Column {
    at: u32,
    stride: u32,
}

fn column_of(first: u32, index: u32) -> Column {
    let outboard = first + NODE_NUMBERS;
    if index < 6u {
        return Column(first + 6u * index, 1u);
    }
    return Column(
        outboard + select(index - 6u, B1, index == 12u),
        select(6u, 1u, index == 12u),
    );
}

fn column(c: Column) -> Force {
    return Force(
        vec3<real>(pairs[c.at], pairs[c.at + c.stride], pairs[c.at + 2u * c.stride]),
        vec3<real>(
            pairs[c.at + 3u * c.stride],
            pairs[c.at + 4u * c.stride],
            pairs[c.at + 5u * c.stride],
        ),
    );
}

// Phi22 of the inboard part and Phi11 of the outboard one.
fn between(first: u32) -> Inertia {
    let p = first + PHI22;
    let q = first + NODE_NUMBERS + PHI11;
    let x = shared3(p) + shared3(q);
    let y = shared3(p + 3u) + shared3(q + 3u);
    let row3 = shared3(p + 6u) + shared3(q + 6u);
    let row4 = shared3(p + 10u) + shared3(q + 10u);
    let row5 = shared3(p + 15u) + shared3(q + 15u);
    let last = shared3(p + 18u) + shared3(q + 18u);
    let xx = pairs[p + 9u] + pairs[q + 9u];
    let xy = pairs[p + 13u] + pairs[q + 13u];
    let yy = pairs[p + 14u] + pairs[q + 14u];
    return Inertia(
        Sym3(vec3<real>(x.x, x.z, y.z), vec3<real>(y.y, y.x, x.y)),
        transpose(mat3x3<real>(row3, row4, row5)),
        Sym3(vec3<real>(xx, yy, last.z), vec3<real>(last.y, last.x, xy)),
    );
}

// What a lane knows of a join before its round.
struct Up {
    seam: Seam,
    has_join: bool,
}

fn known_up(seam: Seam, has_join: bool, lane: u32) -> Up { return Up(seam, has_join); }

// One join of each team, or none; all lanes of the workgroup come here.
fn go_up_join(known: Up, lane: u32) {
    let seam = known.seam;
    let has_join = known.has_join;
    let place = lane / TEAM;
    let own = lane % TEAM;
    let first = PAIR * place;
    if has_join {
        let a = node_at(seam.inboard);
        let b = node_at(seam.outboard);
        for (var i = own; i < NODE_SIZE; i += TEAM) {
            let v = vec4<real>(nodes[a + i]);
            let w = vec4<real>(nodes[b + i]);
            let to = first + 4u * i;
            pairs[to] = v.x;
            pairs[to + 1u] = v.y;
            pairs[to + 2u] = v.z;
            pairs[to + 3u] = v.w;
            pairs[to + NODE_NUMBERS] = w.x;
            pairs[to + NODE_NUMBERS + 1u] = w.y;
            pairs[to + NODE_NUMBERS + 2u] = w.z;
            pairs[to + NODE_NUMBERS + 3u] = w.w;
        }
    }
    workgroupBarrier();

    var factor: Cholesky6;
    var y = force_zero();
    let is_column = has_join && own < COLUMNS;
    if has_join {
        factor = cholesky6(between(first), 0.0, 0.0);
    }
    if is_column {
        let at = column_of(first, own);
        y = column(at);
        if own == 12u {
            let b2 = Force(shared3(first + B2), shared3(first + B2 + 3u));
            y = force_sub(b2, y);
        }
        y = lower6(factor, y);
        pairs[at.at] = y.angular.x;
        pairs[at.at + at.stride] = y.angular.y;
        pairs[at.at + 2u * at.stride] = y.angular.z;
        pairs[at.at + 3u * at.stride] = y.linear.x;
        pairs[at.at + 4u * at.stride] = y.linear.y;
        pairs[at.at + 5u * at.stride] = y.linear.z;
    }
    workgroupBarrier();

    let to = node_at(sizes.chunk_nodes + seam.join);
    if is_column {
        multiply(to, first, own, y, seam.head != NONE);
    }
    workgroupBarrier();

    if has_join {
        for (var i = B1 / 4u + own; i < NODE_SIZE; i += TEAM) {
            let at = first + 4u * i;
            tree_put(to + i, pairs[at], pairs[at + 1u], pairs[at + 2u], pairs[at + 3u]);
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
            if seam.rake != NONE {
                put_path_rake(seam.rake, first);
            }
        }
        if IS_KEPT && own >= COLUMNS {
            // Lanes that own no column have two rows each.
            let row = 2u * (own - COLUMNS);
            keep_inverse_row(seam.join, factor, row);
            keep_inverse_row(seam.join, factor, row + 1u);
        }
    }
    // Before the next joins take their places.
    workgroupBarrier();
}

// What a lane reads of a join for what differs in it: what has been solved for it.
struct Differing {
    number: real,
}

fn differing_in(join: u32, row: u32, own: u32) -> Differing {
    return Differing(number_at(row, DIFFERENCE));
}

fn number_differing(known: Differing) -> real { return known.number; }

// The products of all columns by two: a lane's with the six that follow, in a ring of thirteen, and with
// itself, so that each pair is one lane's and all have the same number. They make up the whole's node, `to`.
fn multiply(to: u32, first: u32, own: u32, y: Force, is_head: bool) {
    let sign: real = select(real(-1.0), real(1.0), is_head);
    for (var step = 0u; step < 7u; step++) {
        let other = select(own + step, own + step - COLUMNS, own + step >= COLUMNS);
        let z = column(column_of(first, other));
        let product: real = dot(y.angular, z.angular) + dot(y.linear, z.linear);
        let a = min(own, other);
        let b = max(own, other);
        let is_inboard = a < 6u;
        if b == 12u && a < 12u {
            let at = first + select(B2 + a - 6u, B1 + a, is_inboard);
            let factor: real = select(real(1.0), sign, is_inboard);
            pairs[at] = pairs[at + select(NODE_NUMBERS, 0u, is_inboard)] + factor * product;
        } else if is_inboard == (b < 6u) && b < 12u {
            let i = select(b - 6u, b, is_inboard);
            let k = select(a - 6u, a, is_inboard);
            let at = first + select(PHI22, PHI11, is_inboard) + i * (i + 1u) / 2u + k;
            let factor: real = select(real(-1.0), sign, is_inboard);
            pairs[at] = pairs[at + select(NODE_NUMBERS, 0u, is_inboard)] + factor * product;
        } else if b < 12u {
            put_number(to, 6u * a + b - 6u, product);
        }
    }
}

// A path's inertia and bias force, for the body that carries it.
fn put_path_rake(rake: u32, first: u32) {
    let p = first + PHI11;
    let x = shared3(p);
    let y = shared3(p + 3u);
    let last = shared3(p + 18u);
    let inertia = Inertia(
        Sym3(vec3<real>(x.x, x.z, y.z), vec3<real>(y.y, y.x, x.y)),
        transpose(mat3x3<real>(shared3(p + 6u), shared3(p + 10u), shared3(p + 15u))),
        Sym3(
            vec3<real>(pairs[p + 9u], pairs[p + 14u], last.z),
            vec3<real>(last.y, last.x, pairs[p + 13u]),
        ),
    );
    let bias = Force(shared3(first + B1), shared3(first + B1 + 3u));
    put_rake(rake, Rake(inertia, bias, vec2<real>(0.0, 0.0)), real(COARSER));
}
