// Triangles of one mesh: each pair once, and neighbours only if they meet beyond their common corners.
//
// Neighbours are certain not to if the plane of one, or in a projection along an axis a line through the
// common corners or the angles there, has the others strictly apart; the host's `self_query.rs` has the same
// with exact signs. All others are left to the host.

// Of a pair of blocks of one mesh, once each pair of triangles.
fn is_once(entry: u32, a: u32, b: u32) -> bool {
    return queue[3u * entry] != queue[3u * entry + 1u] || a < b;
}

struct Words {
    p: vec3<u32>,
    q: vec3<u32>,
    r: vec3<u32>,
}

// Equal numbers have equal words, but for the two zeros.
fn normalized(words: vec3<u32>) -> vec3<u32> {
    return select(words, vec3<u32>(0u), words == vec3<u32>(0x80000000u));
}

fn words_of(leaf: vec4<u32>) -> Words {
    return Words(
        normalized(words_a(leaf.x)),
        normalized(words_a(leaf.y)),
        normalized(words_a(leaf.z)),
    );
}

fn is_own(corner: vec3<u32>, other: Words) -> bool {
    return any(corner != other.p) && any(corner != other.q) && any(corner != other.r);
}

// Which corners the other triangle does not have.
fn own_corners(words: Words, other: Words) -> vec3<bool> {
    return vec3<bool>(
        is_own(words.p, other),
        is_own(words.q, other),
        is_own(words.r, other),
    );
}

// The corners turned so that a triangle's own come first.
fn own_first(t: Corners, own: vec3<bool>) -> Corners {
    if !own.x && own.y {
        return Corners(t.q, t.r, t.p);
    }
    if !own.y && own.z {
        return Corners(t.r, t.p, t.q);
    }
    return t;
}

// Whether those corners of a triangle that are its own lie strictly on one side of the other's plane.
fn on_one_side(t: Corners, other: Corners, count: u32, unit: f32) -> bool {
    let error = FLUSH * unit;
    let through = plane((other.q - other.p) * unit, (other.r - other.p) * unit, error, error);
    let first = side(through, (t.p - other.p) * unit, error);
    let second = select(first, side(through, (t.q - other.p) * unit, error), count == 2u);
    return first != 0 && first == second;
}

// Whether the line of the common side has the own corners strictly on either side.
fn apart_across(a: Corners, b: Corners, axis: u32, unit: f32) -> bool {
    let error = FLUSH * unit;
    let start = flat(a.q, axis);
    let end = flat(a.r, axis);
    return turn(start, end, flat(a.p, axis), unit, error)
        * turn(start, end, flat(b.p, axis), unit, error) < 0;
}

// Whether the angles at the common corner share nothing else: if two angles below a half turn do, then a
// side of one lies in the other.
fn apart_around(a: Corners, b: Corners, axis: u32, unit: f32) -> bool {
    let error = FLUSH * unit;
    let corner = flat(a.r, axis);
    let a_p = flat(a.p, axis);
    let a_q = flat(a.q, axis);
    let b_p = flat(b.p, axis);
    let b_q = flat(b.q, axis);
    let within_a = turn(a_p, a_q, corner, unit, error);
    let within_b = turn(b_p, b_q, corner, unit, error);
    if within_a == 0 || within_b == 0 {
        return false;
    }
    let pp = turn(a_p, b_p, corner, unit, error);
    let pq = turn(a_p, b_q, corner, unit, error);
    let qp = turn(a_q, b_p, corner, unit, error);
    let qq = turn(a_q, b_q, corner, unit, error);
    return (pp == -within_a || qp == within_a) && (pq == -within_a || qq == within_a)
        && (pp == within_b || pq == -within_b) && (qp == within_b || qq == -within_b);
}

fn judge(entry: u32, a: u32, b: u32, corners: Corners, posed: Posed) -> u32 {
    let words_1 = words_of(leaves_a[WIDTH * queue[3u * entry] + a % WIDTH]);
    let words_2 = words_of(leaves_a[WIDTH * queue[3u * entry + 1u] + b % WIDTH]);
    let own_1 = own_corners(words_1, words_2);
    let own_2 = own_corners(words_2, words_1);
    if all(own_1) && all(own_2) {
        return decide(corners, posed);
    }
    let counts_1 = select(vec3<u32>(0u), vec3<u32>(1u), own_1);
    let counts_2 = select(vec3<u32>(0u), vec3<u32>(1u), own_2);
    let count = counts_1.x + counts_1.y + counts_1.z;
    if count == 0u || count != counts_2.x + counts_2.y + counts_2.z {
        return OPEN;
    }
    let first = own_first(corners, own_1);
    let second = own_first(posed.corners, own_2);
    let reach_1 = max(abs(first.p - first.r), abs(first.q - first.r));
    let reach_2 = max(abs(second.p - second.r), abs(second.q - second.r));
    let reach = max(reach_1, reach_2);
    let unit = to_unit(max(max(reach.x, reach.y), max(reach.z, FLUSH)));
    if on_one_side(first, second, count, unit) || on_one_side(second, first, count, unit) {
        return MISS;
    }
    let axis = longest_axis(cross((first.q - first.p) * unit, (first.r - first.p) * unit));
    if count == 1u {
        return select(OPEN, MISS, apart_across(first, second, axis, unit));
    }
    return select(OPEN, MISS, apart_around(first, second, axis, unit));
}
