// Counts the digits of each tile: counts[digit * tiles + tile], so that a scan over all of it says
// where the keys of a digit from a tile belong.

@group(0) @binding(0) var<uniform> ranges: Ranges;
@group(0) @binding(1) var<uniform> digit: Digit;
@group(0) @binding(2) var<storage, read> keys: array<u32>;
@group(0) @binding(3) var<storage, read_write> counts: array<u32>;

var<workgroup> bins: array<atomic<u32>, BINS>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let range = ranges.level[0];
    let tile = group.y * groups.x + group.x;
    if tile >= range.tiles {
        return;
    }
    if lane < BINS {
        atomicStore(&bins[lane], 0u);
    }
    // Cleared before anything is added.
    workgroupBarrier();
    for (var i = 0u; i < ITEMS; i++) {
        let at = tile * TILE + i * THREADS + lane;
        if at < range.count {
            atomicAdd(&bins[digit_of(keys[at])], 1u);
        }
    }
    // Everything is added before it is read.
    workgroupBarrier();
    if lane < BINS {
        counts[lane * range.tiles + tile] = atomicLoad(&bins[lane]);
    }
}
