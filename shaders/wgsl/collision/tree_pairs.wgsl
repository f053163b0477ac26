// Every block of B down the tree of A: appends the pairs of blocks whose boxes overlap to the queue.
//
// A lane poses the box of a block of B and descends depth first. The tree has no pointers: the children
// of node k of a level are the nodes 8 k .. 8 k + 8 of the level below, and level 0 is the blocks. What is
// left to be looked at is a byte a level.

// More steps than any descent takes.
const STEPS: u32 = 0xffffffffu;

@group(0) @binding(6) var<uniform> tree: Tree;

// A bit for each child of a node whose box overlaps.
fn near_children(level: u32, node: u32, posed: Box) -> u32 {
    let below = tree.levels[level - 1u];
    var near = 0u;
    for (var k = 0u; k < WIDTH; k++) {
        let child = WIDTH * node + k;
        if child < below.y {
            let at = 2u * (below.x + child);
            let hit = overlap(Box(boxes_a[at].xyz, boxes_a[at + 1u].xyz), posed);
            near |= select(0u, 1u << k, hit);
        }
    }
    return near;
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
    let place_in_job = (number - job.first_group) * 64u + lane;
    if place_in_job >= job.b_blocks {
        return;
    }
    let b_block = job.b_first + place_in_job;
    let at = 2u * b_block;
    let posed = posed_box(job, Box(boxes_b[at].xyz, boxes_b[at + 1u].xyz));
    let root = 2u * tree.levels[tree.top].x;
    if !overlap(Box(boxes_a[root].xyz, boxes_a[root + 1u].xyz), posed) {
        return;
    }
    if tree.top == 0u {
        enqueue(atomicAdd(&counts[QUEUED], 1u), 0u, b_block, index);
        return;
    }
    var left: array<u32, LEVELS>;
    var level = tree.top;
    var node = 0u;
    left[level] = near_children(level, 0u, posed);
    for (var step = 0u; step < STEPS; step++) {
        if level == 1u {
            // Blocks: all at once.
            var near = left[1u];
            if job.itself != 0u {
                // Of a mesh with itself, those up to this one.
                let behind = clamp(i32(b_block) - i32(WIDTH * node) + 1, 0, 8);
                near &= (1u << u32(behind)) - 1u;
            }
            let count = countOneBits(near);
            if count > 0u {
                var place = atomicAdd(&counts[QUEUED], count);
                for (var k = 0u; k < WIDTH; k++) {
                    if (near >> k & 1u) != 0u {
                        enqueue(place, WIDTH * node + k, b_block, index);
                        place++;
                    }
                }
            }
            left[1u] = 0u;
        }
        if left[level] == 0u {
            if level == tree.top {
                break;
            }
            level++;
            node /= WIDTH;
        } else {
            let child = firstTrailingBit(left[level]);
            left[level] &= left[level] - 1u;
            level--;
            node = WIDTH * node + child;
            left[level] = near_children(level, node, posed);
        }
    }
}
