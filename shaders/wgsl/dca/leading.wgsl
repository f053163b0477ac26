// A lane a chunk, of the first chunks.

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let chunk = (id.y * groups.x + id.x) * LANES + lane;
    if chunk < layer.count && is_needed() {
        run_chunk(chunk);
    }
}
