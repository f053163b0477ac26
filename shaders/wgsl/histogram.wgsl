// counts[key] += 1 for each key; a key beyond the counts fails. Up to LOCAL bins are counted on chip
// first. Integer sums do not depend on the order.

struct Bins {
    // Number of keys.
    count: u32,
    // Number of bins.
    bins: u32,
}

const LOCAL: u32 = 2048u;
// Keys that a workgroup takes.
const TILE: u32 = 4096u;

@group(0) @binding(0) var<uniform> range: Bins;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read_write> counts: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> status: array<atomic<u32>>;

var<workgroup> local: array<atomic<u32>, LOCAL>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let on_chip = range.bins <= LOCAL;
    if on_chip {
        for (var bin = lane; bin < LOCAL; bin += 256u) {
            atomicStore(&local[bin], 0u);
        }
    }
    // Cleared before anything is added.
    workgroupBarrier();
    let first = (group.y * groups.x + group.x) * TILE + lane;
    for (var round = 0u; round < TILE / 256u; round++) {
        let i = first + round * 256u;
        if i >= range.count {
            break;
        }
        let key = keys[i];
        if key >= range.bins {
            fail(i);
        } else if on_chip {
            atomicAdd(&local[key], 1u);
        } else {
            atomicAdd(&counts[key], 1u);
        }
    }
    // Everything is added before it is handed on.
    workgroupBarrier();
    if on_chip {
        for (var bin = lane; bin < LOCAL; bin += 256u) {
            let sum = atomicLoad(&local[bin]);
            if sum != 0u {
                atomicAdd(&counts[bin], sum);
            }
        }
    }
}
