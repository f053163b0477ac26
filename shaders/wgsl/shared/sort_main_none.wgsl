@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    sort_tile(Row(thread, 0u, 1u), thread, group.y * groups.x + group.x);
}
