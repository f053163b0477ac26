// Combines the elements of each tile in their order: totals[tile] = data[first] + ... + data[last].
// With `Element`, `identity`, `combine` (associative) and `load` of other parts.

@group(0) @binding(0) var<uniform> ranges: Ranges;
@group(0) @binding(1) var<uniform> level: u32;
@group(0) @binding(2) var<storage, read> data: array<Element>;
@group(0) @binding(3) var<storage, read_write> totals: array<Element>;

var<workgroup> partial: array<Element, THREADS>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let range = ranges.level[level];
    let tile = group.y * groups.x + group.x;
    // Of nothing there is one total all the same.
    if tile >= max(range.tiles, 1u) {
        return;
    }
    var items: array<Element, ITEMS>;
    partial[lane] = load_items(tile * TILE + lane * ITEMS, range.count, &items);
    // Neighbours join, so that the order is kept: the same tree on every device.
    for (var round = 0u; round < ROUNDS; round++) {
        let width = 1u << round;
        // What the last round wrote is read.
        workgroupBarrier();
        let left = 2u * width * lane;
        if left + width < THREADS {
            partial[left] = combine(partial[left], partial[left + width]);
        }
    }
    if lane == 0u {
        totals[tile] = partial[0];
    }
}
