// Boxes of blocks and of their parents. Fails at a vertex that is infinite or NaN.

@group(0) @binding(0) var<uniform> levels: Levels;
@group(0) @binding(1) var<storage, read> vertices: array<u32>;
@group(0) @binding(2) var<storage, read> leaves: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> boxes: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> status: array<atomic<u32>>;

const EXPONENT: u32 = 0x7f800000u;

fn position(vertex: u32) -> vec3<f32> {
    let at = 3u * vertex;
    let words = vec3<u32>(vertices[at], vertices[at + 1u], vertices[at + 2u]);
    // As words, because compilers may take it for granted that there is no NaN.
    if any((words & vec3<u32>(EXPONENT)) == vec3<u32>(EXPONENT)) {
        fail(vertex);
        return vec3<f32>(0.0);
    }
    return bitcast<vec3<f32>>(words) * SCALE;
}

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
        let leaf = leaves[at];
        if leaf.w != NONE {
            bounds = around(position(leaf.x), position(leaf.y), position(leaf.z));
        }
    }
    fit(bounds, lane, number);
}
