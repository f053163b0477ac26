// Boxes of two levels of nodes from those of the level below.

@group(0) @binding(0) var<uniform> levels: Levels;
@group(0) @binding(1) var<storage, read_write> boxes: array<vec4<f32>>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let number = group.y * groups.x + group.x;
    let at = 256u * number + lane;
    var bounds = empty_box();
    if at < levels.children {
        let node = 2u * (levels.children_at + at);
        bounds = Box(boxes[node].xyz, boxes[node + 1u].xyz);
    }
    fit(bounds, lane, number);
}
