// Where each triangle comes in the order of the tree: where its box's centre is on the curve of D. Hilbert ("Ueber die
// stetige Abbildung einer Linie auf ein Flaechenstueck", Math. Annalen 38, 1891) through cells of a 1024th of the mesh's
// longest side, by the turns of J. Skilling ("Programming the Hilbert curve", AIP Conf. Proc. 707, 2004). Whatever the
// order, answers are the same.
//
// The curve goes from cell to neighbouring cell. Interleaved bits alone (Morton's order) leap from the far end of one
// half of space to the near end of the other: blocks across such a leap have boxes as large as the mesh.

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

// The highest bit of a coordinate, and how many bits there are above the lowest.
const TOP: u32 = 512u;
const HALVINGS: u32 = 9u;

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

// What is done to the bits below this one of the first and of another coordinate: if the other has the bit, the first is
// turned over, else both are exchanged.
fn turned(first: u32, other: u32, bit: u32) -> vec2<u32> {
    let below = bit - 1u;
    if (other & bit) != 0u {
        return vec2<u32>(first ^ below, other);
    }
    let differ = (first ^ other) & below;
    return vec2<u32>(first ^ differ, other ^ differ);
}

// The place of a cell on the curve.
fn place_on_curve(cell: vec3<u32>) -> u32 {
    var x = cell.x;
    var y = cell.y;
    var z = cell.z;
    for (var k = 0u; k < HALVINGS; k++) {
        let bit = TOP >> k;
        x = turned(x, x, bit).x;
        let with_y = turned(x, y, bit);
        let with_z = turned(with_y.x, z, bit);
        x = with_z.x;
        y = with_y.y;
        z = with_z.y;
    }
    // From the reflected code to the plain one.
    y ^= x;
    z ^= y;
    var flip = 0u;
    for (var k = 0u; k < HALVINGS; k++) {
        let bit = TOP >> k;
        flip ^= select(0u, bit - 1u, (z & bit) != 0u);
    }
    return (spread(x ^ flip) << 2u) | (spread(y ^ flip) << 1u) | spread(z ^ flip);
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
    keys[i] = place_on_curve(vec3<u32>(cells));
    values[i] = i;
}
