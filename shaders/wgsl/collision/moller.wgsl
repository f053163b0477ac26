// The interval test of Moeller in single precision, every triangle of A against every one of B: the host's
// `moller.rs` says where it errs. With `hit` and `wanted` of another part.
//
// Operations are those of the host in the same order, so that where all of them are exact, as for small
// integers, the answers are the same; elsewhere drivers may round and fuse otherwise.

const LANES: u32 = 64u;
// Triangles of B that are brought at a time, how often, and both.
const TILE: u32 = 32u;
const TILES: u32 = 16u;
const COLUMNS: u32 = 512u;

struct Tolerance {
    // Distances times twice the area below this are zero.
    epsilon: f32,
}

@group(0) @binding(0) var<uniform> sizes: Sizes;
@group(0) @binding(1) var<uniform> places: Places;
@group(0) @binding(2) var<uniform> tolerance: Tolerance;
@group(0) @binding(3) var<storage, read> jobs: array<Job>;
@group(0) @binding(4) var<storage, read> vertices_a: array<u32>;
@group(0) @binding(5) var<storage, read> leaves_a: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> vertices_b: array<u32>;
@group(0) @binding(7) var<storage, read> leaves_b: array<vec4<u32>>;
@group(0) @binding(8) var<storage, read_write> found: array<atomic<u32>>;

// A triangle with its plane normal . x + offset = 0.
struct Planed {
    corners: array<vec3<f32>, 3>,
    normal: vec3<f32>,
    offset: f32,
    name: u32,
}

var<workgroup> tile: array<Planed, TILE>;

fn point_a(vertex: u32) -> vec3<f32> {
    let at = 3u * vertex;
    return bitcast<vec3<f32>>(vec3<u32>(vertices_a[at], vertices_a[at + 1u], vertices_a[at + 2u]));
}

fn point_b(vertex: u32, job: Job) -> vec3<f32> {
    let at = 3u * vertex;
    let words = vec3<u32>(vertices_b[at], vertices_b[at + 1u], vertices_b[at + 2u]);
    return rotated(job, bitcast<vec3<f32>>(words)) + translation(job) / SCALE;
}

fn planed(p: vec3<f32>, q: vec3<f32>, r: vec3<f32>, name: u32) -> Planed {
    let normal = cross(q - p, r - p);
    return Planed(array<vec3<f32>, 3>(p, q, r), normal, -dot(normal, p), name);
}

fn distances(base: Planed, other: Planed) -> vec3<f32> {
    let computed = vec3<f32>(
        dot(base.normal, other.corners[0]) + base.offset,
        dot(base.normal, other.corners[1]) + base.offset,
        dot(base.normal, other.corners[2]) + base.offset,
    );
    return select(computed, vec3<f32>(0.0), abs(computed) < vec3<f32>(tolerance.epsilon));
}

fn one_side(d: vec3<f32>) -> bool {
    return d.x * d.y > 0.0 && d.x * d.z > 0.0;
}

fn largest_component(v: vec3<f32>) -> u32 {
    let size = abs(v);
    let first = select(0u, 1u, size.y > size.x);
    return select(first, 2u, size.z > max(size.x, size.y));
}

// x / y, exact where that is a number of few bits: drivers may be off by a few units.
fn quotient(x: f32, y: f32) -> f32 {
    let near = x / y;
    let few = bitcast<f32>((bitcast<u32>(near) + 0x800u) & 0xfffff000u);
    return select(near, few, few * y == x);
}

fn cut(at: vec3<f32>, d: vec3<f32>, alone: u32, other: u32) -> f32 {
    return at[alone] + quotient((at[other] - at[alone]) * d[alone], d[alone] - d[other]);
}

// Where a triangle cuts the line, from its corners' positions along it and distances to the other plane.
fn interval(at: vec3<f32>, d: vec3<f32>) -> vec2<f32> {
    var alone = 2u;
    if d.x * d.y > 0.0 {
        alone = 2u;
    } else if d.x * d.z > 0.0 {
        alone = 1u;
    } else if d.y * d.z > 0.0 || d.x != 0.0 {
        alone = 0u;
    } else if d.y != 0.0 {
        alone = 1u;
    }
    let first = cut(at, d, alone, (alone + 1u) % 3u);
    let second = cut(at, d, alone, (alone + 2u) % 3u);
    return vec2<f32>(min(first, second), max(first, second));
}

fn component(t: Planed, axis: u32) -> vec3<f32> {
    return vec3<f32>(t.corners[0][axis], t.corners[1][axis], t.corners[2][axis]);
}

fn flat(p: vec3<f32>, dropped: u32) -> vec2<f32> {
    if dropped == 0u {
        return p.yz;
    }
    if dropped == 1u {
        return p.xz;
    }
    return p.xy;
}

fn perp_dot(u: vec2<f32>, v: vec2<f32>) -> f32 {
    return u.x * v.y - u.y * v.x;
}

fn within(numerator: f32, denominator: f32) -> bool {
    return (denominator > 0.0 && numerator >= 0.0 && numerator <= denominator)
        || (denominator < 0.0 && numerator <= 0.0 && numerator >= denominator);
}

fn segments_cross(p: vec2<f32>, q: vec2<f32>, r: vec2<f32>, s: vec2<f32>) -> bool {
    let along = q - p;
    let across = r - s;
    let between = p - r;
    let denominator = perp_dot(along, across);
    return within(perp_dot(across, between), denominator)
        && within(perp_dot(between, along), denominator);
}

fn contains(t: array<vec2<f32>, 3>, p: vec2<f32>) -> bool {
    return one_side(vec3<f32>(
        perp_dot(t[1] - t[0], p - t[0]),
        perp_dot(t[2] - t[1], p - t[1]),
        perp_dot(t[0] - t[2], p - t[2]),
    ));
}

fn coplanar_meet(a: Planed, b: Planed) -> bool {
    let dropped = largest_component(a.normal);
    var t: array<vec2<f32>, 3>;
    var u: array<vec2<f32>, 3>;
    for (var k = 0u; k < 3u; k++) {
        t[k] = flat(a.corners[k], dropped);
        u[k] = flat(b.corners[k], dropped);
    }
    var meet = contains(u, t[0]) || contains(t, u[0]);
    for (var i = 0u; i < 3u; i++) {
        for (var k = 0u; k < 3u; k++) {
            meet = meet || segments_cross(t[i], t[(i + 1u) % 3u], u[k], u[(k + 1u) % 3u]);
        }
    }
    return meet;
}

fn intersect(a: Planed, b: Planed) -> bool {
    let of_a = distances(b, a);
    if one_side(of_a) {
        return false;
    }
    let of_b = distances(a, b);
    if one_side(of_b) {
        return false;
    }
    if all(of_a == vec3<f32>(0.0)) || all(of_b == vec3<f32>(0.0)) {
        return coplanar_meet(a, b);
    }
    let axis = largest_component(cross(a.normal, b.normal));
    let first = interval(component(a, axis), of_a);
    let second = interval(component(b, axis), of_b);
    return !(first.y < second.x || second.y < first.x);
}

@compute @workgroup_size(64)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = group.y * groups.x + group.x;
    if number >= sizes.groups {
        return;
    }
    let index = job_of(number);
    let job = jobs[index];
    let tiles_a = (WIDTH * job.a_blocks + LANES - 1u) / LANES;
    let place = number - job.first_group;
    let row = place % tiles_a * LANES + lane;
    let column = place / tiles_a * COLUMNS;
    var mine: Planed = planed(vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0), NONE);
    if row < WIDTH * job.a_blocks {
        let leaf = leaves_a[WIDTH * job.a_first + row];
        mine = planed(point_a(leaf.x), point_a(leaf.y), point_a(leaf.z), leaf.w);
    }
    for (var step = 0u; step < TILES; step++) {
        if lane < TILE {
            tile[lane].name = NONE;
            let other = column + step * TILE + lane;
            if other < WIDTH * job.b_blocks {
                let leaf = leaves_b[WIDTH * job.b_first + other];
                tile[lane] = planed(
                    point_b(leaf.x, job), point_b(leaf.y, job), point_b(leaf.z, job), leaf.w);
            }
        }
        // All are there before any is looked at ...
        workgroupBarrier();
        if mine.name != NONE {
            for (var k = 0u; k < TILE; k++) {
                let name = tile[k].name;
                if name != NONE && wanted(mine.name, name, index) && intersect(mine, tile[k]) {
                    hit(mine.name, name, index);
                }
            }
        }
        // ... and all are looked at before they are replaced.
        workgroupBarrier();
    }
}
