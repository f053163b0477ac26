// Writes the values whose flag is not zero to the front, in their order, and how many they are.

@group(0) @binding(0) var<uniform> ranges: Ranges;
@group(0) @binding(1) var<storage, read> data: array<Element>;
@group(0) @binding(2) var<storage, read> places: array<u32>;
@group(0) @binding(3) var<storage, read> values: array<u32>;
@group(0) @binding(4) var<storage, read_write> kept: array<u32>;
@group(0) @binding(5) var<storage, read_write> kept_count: array<u32>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let count = ranges.level[0].count;
    let i = (group.y * groups.x + group.x) * 256u + lane;
    if i >= count {
        return;
    }
    let flag = load(i);
    if flag != 0u {
        kept[places[i]] = values[i];
    }
    if i + 1u == count {
        kept_count[0] = places[i] + flag;
    }
}
