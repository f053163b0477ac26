// Every node of a level of A against every node of that level of B: appends the pairs whose boxes overlap to the queue
// of that level. Where it is the lowest, nodes are blocks.
//
// A lane poses the box of a node of B and holds it against 64 of A.

const TILE: u32 = 64u;

var<workgroup> lows: array<vec3<f32>, TILE>;
var<workgroup> highs: array<vec3<f32>, TILE>;

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
    let of_a = span_above(job.a_first, job.a_blocks, sizes.level);
    let of_b = span_above(job.b_first, job.b_blocks, sizes.level);
    let tiles_a = (of_a.count + TILE - 1u) / TILE;
    let tile = number - job.first_group;
    let a_first = tile % tiles_a * TILE;
    let b_place = tile / tiles_a * TILE + lane;
    var staged = empty_box();
    if a_first + lane < of_a.count {
        staged = box_a(of_a.first + a_first + lane);
    }
    lows[lane] = staged.low;
    highs[lane] = staged.high;
    // All boxes of A are there before any is looked at.
    workgroupBarrier();
    if b_place >= of_b.count {
        return;
    }
    let a_node = of_a.first + a_first;
    let b_node = of_b.first + b_place;
    let posed = posed_box(job, box_b(b_node));
    var near = vec2<u32>(0u);
    for (var k = 0u; k < TILE; k++) {
        let hit = overlap(Box(lows[k], highs[k]), posed)
            && (job.itself == 0u || a_node + k <= b_node);
        if k < 32u {
            near.x |= select(0u, 1u << k, hit);
        } else {
            near.y |= select(0u, 1u << (k & 31u), hit);
        }
    }
    let count = countOneBits(near.x) + countOneBits(near.y);
    if count == 0u {
        return;
    }
    var place = atomicAdd(&counts[queue_counter(sizes.level)], count);
    for (var k = 0u; k < TILE; k++) {
        let word = select(near.y, near.x, k < 32u);
        if (word >> (k & 31u) & 1u) != 0u {
            enqueue(place, a_node + k, b_node, index);
            place++;
        }
    }
}
