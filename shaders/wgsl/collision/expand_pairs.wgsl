// Of the queued pairs of nodes the pairs of their children, a level below: appends those whose boxes overlap to the
// queue of that level.
//
// A workgroup takes eight pairs at a time, eight lanes each: a lane brings a child of A, poses one of B, and holds it
// against the eight of A. So no lane has more to do than others, however many pairs a node is in.

const LANES: u32 = 64u;
const PAIRS: u32 = 8u;

@group(0) @binding(6) var<storage, read> parents: array<u32>;

var<workgroup> lows: array<vec3<f32>, LANES>;
var<workgroup> highs: array<vec3<f32>, LANES>;
var<workgroup> queued: u32;
var<workgroup> found: atomic<u32>;
var<workgroup> place: u32;

fn is_in(span: Span, node: u32) -> bool {
    return node >= span.first && node - span.first < span.count;
}

@compute @workgroup_size(64)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    if lane == 0u {
        queued = min(atomicLoad(&counts[queue_counter(sizes.level + 1u)]), sizes.queue);
    }
    let count = workgroupUniformLoad(&queued);
    let all_rounds = (count + PAIRS - 1u) / PAIRS;
    var rounds = 0u;
    if group.x < all_rounds {
        rounds = (all_rounds - group.x - 1u) / groups.x + 1u;
    }
    for (var round = 0u; round < rounds; round++) {
        let entry = (group.x + round * groups.x) * PAIRS + lane / WIDTH;
        let is_entry = entry < count;
        var a_first = 0u;
        var b_node = 0u;
        var index = 0u;
        if is_entry {
            a_first = WIDTH * parents[3u * entry];
            b_node = WIDTH * parents[3u * entry + 1u] + lane % WIDTH;
            index = parents[3u * entry + 2u];
        }
        let job = jobs[index];
        let of_a = span_above(job.a_first, job.a_blocks, sizes.level);
        let of_b = span_above(job.b_first, job.b_blocks, sizes.level);
        var staged = empty_box();
        let mine = a_first + lane % WIDTH;
        if is_entry && is_in(of_a, mine) {
            staged = box_a(mine);
        }
        lows[lane] = staged.low;
        highs[lane] = staged.high;
        if lane == 0u {
            atomicStore(&found, 0u);
        }
        // All boxes of A are there before any is looked at.
        workgroupBarrier();
        var near = 0u;
        if is_entry && is_in(of_b, b_node) {
            let posed = posed_box(job, box_b(b_node));
            for (var k = 0u; k < WIDTH; k++) {
                let other = lane / WIDTH * WIDTH + k;
                let hit = overlap(Box(lows[other], highs[other]), posed)
                    && (job.itself == 0u || a_first + k <= b_node);
                near |= select(0u, 1u << k, hit);
            }
        }
        // A place among those of the workgroup, so that the queue's counter is touched once a round.
        let near_count = countOneBits(near);
        var before = 0u;
        if near_count > 0u {
            before = atomicAdd(&found, near_count);
        }
        // All are counted before the sum is taken.
        workgroupBarrier();
        if lane == 0u {
            let sum = atomicLoad(&found);
            if sum > 0u {
                place = atomicAdd(&counts[queue_counter(sizes.level)], sum);
            }
        }
        var next = workgroupUniformLoad(&place) + before;
        for (var k = 0u; k < WIDTH; k++) {
            if (near >> k & 1u) != 0u {
                enqueue(next, a_first + k, b_node, index);
                next++;
            }
        }
    }
}
