// Decides the pairs that single precision left, in integers, where both meshes stand in one frame: by the signs of the
// same determinants, exact. With `hit` of another part. What remains is left to the host: triangles of one plane or of no
// area, neighbours in one mesh, posed triangles, and pairs whose coordinates span too many powers of two.
//
// The coordinates of a pair are multiples of a power of two. In its units they are integers; if these are below 2^60,
// differences are below 2^61, minors below 2^123, and a determinant below 2^186.

const LANES: u32 = 64u;
const SPAN: u32 = 60u;
// Words of the record of a pair: its name and the coordinates of its corners.
const RECORD: u32 = 21u;
const CORNERS: u32 = 3u;
// Determinants of a pair: six sides, and the order of two pairs of ends.
const SIGNS: u32 = 8u;

// Whether pairs that meet are left to the host, for more than that they do.
override LEAVE_HITS: u32 = 0u;

@group(0) @binding(0) var<uniform> places: Places;
@group(0) @binding(1) var<storage, read> jobs: array<Job>;
@group(0) @binding(2) var<storage, read> records: array<u32>;
@group(0) @binding(3) var<storage, read_write> found: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> left: array<u32>;

var<workgroup> queued: u32;

// The exponent of the lowest place of a number that is not zero, in units of the smallest that there is.
fn place_of(word: u32) -> u32 {
    return max((word >> 23u) & 0xffu, 1u) - 1u;
}

fn mantissa(word: u32) -> u32 {
    let hidden = select(0u, 0x800000u, (word & 0x7f800000u) != 0u);
    return (word & 0x7fffffu) | hidden;
}

// A number in units of 2^unit, as an integer of 64 bits.
fn scaled(word: u32, unit: u32) -> vec2<u32> {
    let digits = mantissa(word);
    let place = place_of(word);
    var value = vec2<u32>(0u);
    if digits != 0u {
        if place < unit {
            value.x = digits >> (unit - place);
        } else {
            let shift = place - unit;
            if shift == 0u {
                value.x = digits;
            } else if shift < 32u {
                value = vec2<u32>(digits << shift, digits >> (32u - shift));
            } else {
                value.y = digits << (shift - 32u);
            }
        }
    }
    if (word & 0x80000000u) != 0u {
        return difference(vec2<u32>(0u), value);
    }
    return value;
}

// The difference of two corners of a record, from p to q.
fn edge(record: u32, unit: u32, p: u32, q: u32) -> array<vec2<u32>, 3> {
    let p_at = record + 3u + 3u * p;
    let q_at = record + 3u + 3u * q;
    var edge: array<vec2<u32>, 3>;
    for (var axis = 0u; axis < 3u; axis++) {
        edge[axis] = difference(scaled(records[q_at + axis], unit), scaled(records[p_at + axis], unit));
    }
    return edge;
}

// The side of the last of four corners against the plane through the others: the sign of det(q - p, r - p, s - p).
fn side_of(record: u32, unit: u32, corners: vec4<u32>) -> i32 {
    var u = edge(record, unit, corners.x, corners.y);
    var v = edge(record, unit, corners.x, corners.z);
    var w = edge(record, unit, corners.x, corners.w);
    var all = widened(vec2<u32>(0u));
    for (var axis = 0u; axis < 3u; axis++) {
        let next = (axis + 1u) % 3u;
        let last = (axis + 2u) % 3u;
        let one = times(widened(u[next]), widened(v[last]));
        let other = times(widened(u[last]), widened(v[next]));
        all = plus(all, times(minus(one, other), widened(w[axis])));
    }
    return sign_of(all);
}

// The sides of the corners of a triangle against the plane of another, as bits.
struct Sides {
    positive: u32,
    negative: u32,
}

fn strictly_one(sides: Sides) -> bool {
    return sides.positive == 7u || sides.negative == 7u;
}

// The part of a triangle in the plane of the other: from a corner off that plane two edges lead to its ends. Both ends
// are the one corner in the plane if none is beyond. The host's `exact.rs` has the same.
struct Part {
    hub: u32,
    ends: vec2<u32>,
    positive: bool,
}

fn part_of(sides: Sides) -> Part {
    let lone = select(sides.negative, sides.positive, countOneBits(sides.positive) == 1u);
    var part: Part;
    if countOneBits(lone) == 1u {
        part.hub = firstTrailingBit(lone);
        part.ends = vec2<u32>((part.hub + 1u) % 3u, (part.hub + 2u) % 3u);
    } else {
        let strict = sides.positive | sides.negative;
        part.hub = firstTrailingBit(strict);
        part.ends = vec2<u32>(firstTrailingBit(~strict));
    }
    part.positive = (sides.positive >> part.hub & 1u) != 0u;
    return part;
}

// The corners whose determinant says how an end of B's part lies to an end of A's along the line of both planes: A's part
// runs along it from its first end to its second where its hub is on the negative side, B's where it is on the positive.
fn ends_of(a: Part, b: Part, reversed: bool) -> vec4<u32> {
    let start = select(a.ends.x, a.ends.y, a.positive != reversed);
    let end = select(b.ends.x, b.ends.y, b.positive != reversed);
    return vec4<u32>(a.hub, start, CORNERS + b.hub, CORNERS + end);
}

// Whether two triangles of one mesh have a corner in common, or may have: zeros have two names.
fn share_a_corner(record: u32) -> bool {
    var share = false;
    for (var i = 0u; i < CORNERS; i++) {
        for (var k = CORNERS; k < 2u * CORNERS; k++) {
            var same = true;
            for (var axis = 0u; axis < 3u; axis++) {
                let one = records[record + 3u + 3u * i + axis];
                let other = records[record + 3u + 3u * k + axis];
                same = same && (one == other || ((one | other) << 1u) == 0u);
            }
            share = share || same;
        }
    }
    return share;
}

fn decided(record: u32, job: Job) -> u32 {
    if job.coordinate_error != 0.0 || (job.itself != 0u && share_a_corner(record)) {
        return OPEN;
    }
    var unit = 0xffffffffu;
    var top = 0u;
    for (var k = 3u; k < RECORD; k++) {
        let word = records[record + k];
        let digits = mantissa(word);
        if digits != 0u {
            unit = min(unit, place_of(word) + firstTrailingBit(digits));
            top = max(top, place_of(word) + 24u);
        }
    }
    if unit == 0xffffffffu {
        return OPEN;
    }
    // One place in the code for all determinants, and a loop that nobody unrolls: else drivers compile for seconds.
    let signs = select(SIGNS, 0u, top - unit > SPAN);
    var of_a = Sides(0u, 0u);
    var of_b = Sides(0u, 0u);
    var a: Part;
    var b: Part;
    for (var k = 0u; k < signs; k++) {
        let reversed = k == SIGNS - 1u;
        var corners = ends_of(a, b, reversed);
        if k < CORNERS {
            corners = vec4<u32>(3u, 4u, 5u, k);
        } else if k < 2u * CORNERS {
            corners = vec4<u32>(0u, 1u, 2u, k);
        }
        let side = side_of(record, unit, corners);
        let positive = select(0u, 1u << (k % CORNERS), side > 0);
        let negative = select(0u, 1u << (k % CORNERS), side < 0);
        if k < CORNERS {
            of_a = Sides(of_a.positive | positive, of_a.negative | negative);
        } else if k < 2u * CORNERS {
            of_b = Sides(of_b.positive | positive, of_b.negative | negative);
        } else if select(-side, side, (a.positive == b.positive) != reversed) < 0 {
            return MISS;
        }
        if k + 1u == CORNERS && strictly_one(of_a) {
            return MISS;
        }
        if k + 1u == 2u * CORNERS {
            if strictly_one(of_b) {
                return MISS;
            }
            if (of_a.positive | of_a.negative) == 0u || (of_b.positive | of_b.negative) == 0u {
                return OPEN;
            }
            a = part_of(of_a);
            b = part_of(of_b);
        }
    }
    return select(OPEN, HIT, signs == SIGNS);
}

@compute @workgroup_size(64)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    if lane == 0u {
        queued = min(atomicLoad(&found[UNDECIDED]), places.undecided);
    }
    let count = workgroupUniformLoad(&queued);
    let all_rounds = (count + LANES - 1u) / LANES;
    var rounds = 0u;
    if group.x < all_rounds {
        rounds = (all_rounds - group.x - 1u) / groups.x + 1u;
    }
    for (var round = 0u; round < rounds; round++) {
        let i = (group.x + round * groups.x) * LANES + lane;
        if i < count {
            let record = RECORD * i;
            let job = records[record + 2u];
            let verdict = decided(record, jobs[job]);
            if verdict == HIT && LEAVE_HITS == 0u {
                hit(records[record], records[record + 1u], job);
            } else if verdict != MISS {
                let place = atomicAdd(&found[LEFT], 1u);
                if place < places.left {
                    for (var k = 0u; k < RECORD; k++) {
                        left[RECORD * place + k] = records[record + k];
                    }
                }
            }
        }
    }
}
