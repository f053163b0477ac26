// Fails at each number that is infinite or NaN. Numbers are looked at as words: no compiler can take
// it for granted that there is no NaN, and f64 needs no feature. With `Words` and `is_number` of
// another part.

@group(0) @binding(0) var<uniform> count: u32;
@group(0) @binding(1) var<storage, read> data: array<Words>;
@group(0) @binding(2) var<storage, read_write> status: array<atomic<u32>>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (group.y * groups.x + group.x) * 256u + lane;
    if i < count && !is_number(data[i]) {
        fail(i);
    }
}
