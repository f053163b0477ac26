// Puts the sorted list of pairs where it was.

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (group.y * groups.x + group.x) * 256u + lane;
    if i < min(found[HITS], split.pairs) {
        found[ANSWER + 3u * i] = first[i];
        found[ANSWER + 3u * i + 1u] = second[i];
    }
}
