// Every block of A against every block of B: appends the pairs whose boxes overlap to the queue.
//
// A lane poses the box of a block of B and holds it against 64 of A.

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
    let tiles_a = (job.a_blocks + TILE - 1u) / TILE;
    let tile = number - job.first_group;
    let a_first = tile % tiles_a * TILE;
    let b_block = tile / tiles_a * TILE + lane;
    var staged = empty_box();
    if a_first + lane < job.a_blocks {
        let at = 2u * (job.a_first + a_first + lane);
        staged = Box(boxes_a[at].xyz, boxes_a[at + 1u].xyz);
    }
    lows[lane] = staged.low;
    highs[lane] = staged.high;
    // All boxes of A are there before any is looked at.
    workgroupBarrier();
    if b_block >= job.b_blocks {
        return;
    }
    let at = 2u * (job.b_first + b_block);
    let posed = posed_box(job, Box(boxes_b[at].xyz, boxes_b[at + 1u].xyz));
    var near = vec2<u32>(0u);
    for (var k = 0u; k < TILE; k++) {
        let hit = overlap(Box(lows[k], highs[k]), posed)
            && (job.itself == 0u || job.a_first + a_first + k <= job.b_first + b_block);
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
    var place = atomicAdd(&counts[QUEUED], count);
    for (var k = 0u; k < TILE; k++) {
        let word = select(near.y, near.x, k < 32u);
        if (word >> (k & 31u) & 1u) != 0u {
            enqueue(place, job.a_first + a_first + k, job.b_first + b_block, index);
            place++;
        }
    }
}
