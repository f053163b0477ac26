// Decides the pairs of triangles of queued pairs of blocks: first by their boxes, then what is left by
// `judge`. With `judge`, `is_once`, `hit` and `wanted` of other parts.
//
// A workgroup takes four pairs of blocks at a time: each lane brings one of their 64 triangles, then each
// compares four pairs of boxes, then the pairs that are left are shared out.

const LANES: u32 = 64u;
const PAIRS: u32 = 4u;
const SIDE: u32 = PAIRS * WIDTH;
// Words of the record of an undecided pair: its name and the coordinates of its corners.
const RECORD: u32 = 21u;
// Posed vertices are defined with the roundings of f64, of which edges have a part whatever their length:
// this part of the error of a coordinate, and more.
const DEFINITION: f32 = 1.5e-8;

// Whether pairs that meet are listed like the undecided, for more than that they do.
override LEAVE_HITS: u32 = 0u;

@group(0) @binding(0) var<uniform> places: Places;
@group(0) @binding(1) var<storage, read> jobs: array<Job>;
@group(0) @binding(2) var<storage, read> queue: array<u32>;
@group(0) @binding(3) var<storage, read> vertices_a: array<u32>;
@group(0) @binding(4) var<storage, read> leaves_a: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> vertices_b: array<u32>;
@group(0) @binding(6) var<storage, read> leaves_b: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> found: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> undecided: array<u32>;

// Triangles of A, then triangles of B.
var<workgroup> names: array<u32, LANES>;
var<workgroup> lows: array<vec3<f32>, LANES>;
var<workgroup> highs: array<vec3<f32>, LANES>;
var<workgroup> corners_p: array<vec3<f32>, LANES>;
var<workgroup> corners_q: array<vec3<f32>, LANES>;
var<workgroup> corners_r: array<vec3<f32>, LANES>;
// Of B only.
var<workgroup> to_q: array<vec3<f32>, SIDE>;
var<workgroup> to_r: array<vec3<f32>, SIDE>;
var<workgroup> errors: array<vec2<f32>, SIDE>;
// The pairs that are left: the place of the triangle of A, times SIDE, and that of B.
var<workgroup> list: array<u32, PAIRS * LANES>;
var<workgroup> list_count: atomic<u32>;
var<workgroup> queued: u32;

fn words_a(vertex: u32) -> vec3<u32> {
    let at = 3u * vertex;
    return vec3<u32>(vertices_a[at], vertices_a[at + 1u], vertices_a[at + 2u]);
}

fn words_b(vertex: u32) -> vec3<u32> {
    let at = 3u * vertex;
    return vec3<u32>(vertices_b[at], vertices_b[at + 1u], vertices_b[at + 2u]);
}

fn point(words: vec3<u32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(words) * SCALE;
}

// Brings the triangle of A with this place in the round.
fn stage_a(place: u32, leaf: vec4<u32>) {
    var bounds = empty_box();
    if leaf.w != NONE {
        let p = point(words_a(leaf.x));
        let q = point(words_a(leaf.y));
        let r = point(words_a(leaf.z));
        corners_p[place] = p;
        corners_q[place] = q;
        corners_r[place] = r;
        bounds = around(p, q, r);
    }
    names[place] = leaf.w;
    lows[place] = bounds.low;
    highs[place] = bounds.high;
}

fn stage_b(place: u32, leaf: vec4<u32>, job: Job) {
    var bounds = empty_box();
    if leaf.w != NONE {
        let p = point(words_b(leaf.x));
        let q = point(words_b(leaf.y));
        let r = point(words_b(leaf.z));
        let origin = translation(job);
        let corners = Corners(
            rotated(job, p) + origin,
            rotated(job, q) + origin,
            rotated(job, r) + origin,
        );
        let u = q - p;
        let v = r - p;
        let size = magnitudes(job, max(max(abs(p), abs(q)), abs(r))) + abs(origin);
        let error = job.coordinate_error * max(max(size.x, size.y), size.z) + FLUSH;
        bounds = around(corners.p, corners.q, corners.r);
        bounds = Box(bounds.low - vec3<f32>(error), bounds.high + vec3<f32>(error));
        corners_p[SIDE + place] = corners.p;
        corners_q[SIDE + place] = corners.q;
        corners_r[SIDE + place] = corners.r;
        to_q[place] = rotated(job, u);
        to_r[place] = rotated(job, v);
        let length = max(sum(abs(u)), sum(abs(v)));
        errors[place] = vec2<f32>(error, job.edge_error * length + DEFINITION * error + FLUSH);
    }
    names[SIDE + place] = leaf.w;
    lows[SIDE + place] = bounds.low;
    highs[SIDE + place] = bounds.high;
}

fn put(at: u32, words: vec3<u32>) {
    undecided[at] = words.x;
    undecided[at + 1u] = words.y;
    undecided[at + 2u] = words.z;
}

// Leaves a pair undecided, with its coordinates as they are in memory.
fn leave(a: vec4<u32>, b: vec4<u32>, job: u32) {
    let place = atomicAdd(&found[UNDECIDED], 1u);
    if place >= places.undecided {
        return;
    }
    let at = RECORD * place;
    put(at, vec3<u32>(a.w, b.w, job));
    put(at + 3u, words_a(a.x));
    put(at + 6u, words_a(a.y));
    put(at + 9u, words_a(a.z));
    put(at + 12u, words_b(b.x));
    put(at + 15u, words_b(b.y));
    put(at + 18u, words_b(b.z));
}

@compute @workgroup_size(64)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    if lane == 0u {
        queued = min(atomicLoad(&found[QUEUED]), places.queue);
    }
    let count = workgroupUniformLoad(&queued);
    let all_rounds = (count + PAIRS - 1u) / PAIRS;
    var rounds = 0u;
    if group.x < all_rounds {
        rounds = (all_rounds - group.x - 1u) / groups.x + 1u;
    }
    for (var round = 0u; round < rounds; round++) {
        let first = (group.x + round * groups.x) * PAIRS;
        let entry = first + (lane / WIDTH) % PAIRS;
        let child = lane % WIDTH;
        let filler = vec4<u32>(0u, 0u, 0u, NONE);
        if lane < SIDE {
            var leaf = filler;
            if entry < count {
                leaf = leaves_a[WIDTH * queue[3u * entry] + child];
            }
            stage_a(lane, leaf);
        } else {
            var leaf = filler;
            var job = 0u;
            if entry < count {
                leaf = leaves_b[WIDTH * queue[3u * entry + 1u] + child];
                job = queue[3u * entry + 2u];
            }
            stage_b(lane - SIDE, leaf, jobs[job]);
        }
        if lane == 0u {
            atomicStore(&list_count, 0u);
        }
        // All triangles are there before any is looked at.
        workgroupBarrier();
        for (var pair = 0u; pair < PAIRS; pair++) {
            let a = WIDTH * pair + lane / WIDTH;
            let b = WIDTH * pair + lane % WIDTH;
            let box_a = Box(lows[a], highs[a]);
            let box_b = Box(lows[SIDE + b], highs[SIDE + b]);
            if first + pair < count && overlap(box_a, box_b)
                && is_once(first + pair, a, b)
                && wanted(names[a], names[SIDE + b], queue[3u * (first + pair) + 2u])
            {
                list[atomicAdd(&list_count, 1u)] = a * SIDE + b;
            }
        }
        // The list is whole before it is read.
        workgroupBarrier();
        let left = atomicLoad(&list_count);
        for (var step = 0u; step < PAIRS; step++) {
            let item = step * LANES + lane;
            if item < left {
                let a = list[item] / SIDE;
                let b = list[item] % SIDE;
                let posed = Posed(
                    Corners(corners_p[SIDE + b], corners_q[SIDE + b], corners_r[SIDE + b]),
                    to_q[b],
                    to_r[b],
                    errors[b].x,
                    errors[b].y,
                );
                let entry = first + a / WIDTH;
                let corners = Corners(corners_p[a], corners_q[a], corners_r[a]);
                let verdict = judge(entry, a, b, corners, posed);
                if verdict != MISS {
                    let at = 3u * entry;
                    let job = queue[at + 2u];
                    if verdict == HIT && LEAVE_HITS == 0u {
                        hit(names[a], names[SIDE + b], job);
                    } else {
                        let leaf_a = leaves_a[WIDTH * queue[at] + a % WIDTH];
                        let leaf_b = leaves_b[WIDTH * queue[at + 1u] + b % WIDTH];
                        leave(leaf_a, leaf_b, job);
                    }
                }
            }
        }
        // Everything is read before the next round overwrites it.
        workgroupBarrier();
    }
}
