// Where each triangle comes in the order of the tree: the bits of its box's centre, interleaved (G. M.
// Morton, "A computer oriented geodetic data base and a new technique in file sequencing", IBM, 1966), in
// cells of a 1024th of the mesh's longest side. Whatever the order, answers are the same.

struct Mesh {
    // Number of triangles.
    triangles: u32,
    // The node whose box is that of the mesh.
    root: u32,
}

@group(0) @binding(0) var<uniform> mesh: Mesh;
@group(0) @binding(1) var<storage, read> vertices: array<u32>;
@group(0) @binding(2) var<storage, read> triangles: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> boxes: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> keys: array<u32>;
@group(0) @binding(5) var<storage, read_write> values: array<u32>;

fn position(vertex: u32) -> vec3<f32> {
    let at = 3u * vertex;
    let words = vec3<u32>(vertices[at], vertices[at + 1u], vertices[at + 2u]);
    return bitcast<vec3<f32>>(words) * SCALE;
}

// Two zeros between the bits of a number below 1024.
fn spread(number: u32) -> u32 {
    var bits = number;
    bits = (bits | (bits << 16u)) & 0x030000ffu;
    bits = (bits | (bits << 8u)) & 0x0300f00fu;
    bits = (bits | (bits << 4u)) & 0x030c30c3u;
    bits = (bits | (bits << 2u)) & 0x09249249u;
    return bits;
}

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (group.y * groups.x + group.x) * 256u + lane;
    if i >= mesh.triangles {
        return;
    }
    let low = boxes[2u * mesh.root].xyz;
    let size = boxes[2u * mesh.root + 1u].xyz - low;
    let longest = max(max(size.x, size.y), max(size.z, FLUSH));
    let leaf = triangles[i];
    let bounds = around(position(leaf.x), position(leaf.y), position(leaf.z));
    let center: vec3<f32> = 0.5 * (bounds.low + bounds.high) - low;
    let cells: vec3<f32> = clamp(center / longest, vec3<f32>(0.0), vec3<f32>(1.0)) * 1023.0;
    let cell = vec3<u32>(cells);
    keys[i] = (spread(cell.x) << 2u) | (spread(cell.y) << 1u) | spread(cell.z);
    values[i] = i;
}
