// Lays the list of pairs out for sorting: the first and the second triangle of each in lists of their own.

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (group.y * groups.x + group.x) * 256u + lane;
    if i < min(found[HITS], split.pairs) {
        let a = found[ANSWER + 3u * i];
        let b = found[ANSWER + 3u * i + 1u];
        first[i] = select(a, min(a, b), split.ordered != 0u);
        second[i] = select(b, max(a, b), split.ordered != 0u);
    }
}
