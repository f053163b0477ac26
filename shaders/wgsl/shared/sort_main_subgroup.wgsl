@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(subgroup_id) row: u32,
    @builtin(subgroup_invocation_id) lane: u32,
    @builtin(subgroup_size) lanes: u32,
    @builtin(num_subgroups) rows: u32,
) {
    // Ranks rest on subgroups that fill the workgroup, which no API promises.
    if rows > ROWS || rows * lanes != THREADS {
        fail(group.y * groups.x + group.x);
    }
    sort_tile(Row(row, lane, lanes), thread, group.y * groups.x + group.x);
}
