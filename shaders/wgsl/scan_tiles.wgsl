// Scans each tile, from what comes before it: result[i] = before[tile] + data[first] + ... + data[i],
// without data[i] unless INCLUSIVE. With `Element`, `identity`, `combine` and `load` of other parts.

override INCLUSIVE: u32 = 0u;

@group(0) @binding(0) var<uniform> ranges: Ranges;
@group(0) @binding(1) var<uniform> level: u32;
@group(0) @binding(2) var<storage, read> data: array<Element>;
@group(0) @binding(3) var<storage, read> before: array<Element>;
@group(0) @binding(4) var<storage, read_write> result: array<Element>;

var<workgroup> partial: array<Element, THREADS>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let range = ranges.level[level];
    let tile = group.y * groups.x + group.x;
    if tile >= range.tiles {
        return;
    }
    let first = tile * TILE + lane * ITEMS;
    var items: array<Element, ITEMS>;
    var total = load_items(first, range.count, &items);
    // Hillis and Steele, "Data parallel algorithms", CACM 29(12), 1986: log2 rounds.
    partial[lane] = total;
    for (var round = 0u; round < ROUNDS; round++) {
        let width = 1u << round;
        // What the last round wrote is read ...
        workgroupBarrier();
        if lane >= width {
            total = combine(partial[lane - width], total);
        }
        // ... by all before it is written again.
        workgroupBarrier();
        partial[lane] = total;
    }
    workgroupBarrier();
    // A single tile has nothing before it.
    var running = identity();
    if range.tiles > 1u {
        running = before[tile];
    }
    if lane > 0u {
        running = combine(running, partial[lane - 1u]);
    }
    for (var i = 0u; i < ITEMS; i++) {
        if first + i < range.count {
            let next = combine(running, items[i]);
            if INCLUSIVE != 0u {
                result[first + i] = next;
            } else {
                result[first + i] = running;
            }
            running = next;
        }
    }
}
