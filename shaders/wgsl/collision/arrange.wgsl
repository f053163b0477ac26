// Puts the triangles in the order of the tree.

struct Mesh {
    // Number of triangles.
    triangles: u32,
    // The node whose box is that of the mesh.
    root: u32,
}

@group(0) @binding(0) var<uniform> mesh: Mesh;
@group(0) @binding(1) var<storage, read> triangles: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read_write> leaves: array<vec4<u32>>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (group.y * groups.x + group.x) * 256u + lane;
    if i < mesh.triangles {
        leaves[i] = triangles[order[i]];
    }
}
