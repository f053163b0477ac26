// How many children of each node above the blocks a query enters that meets the node: the surface of their
// boxes in units of that of the node (J. Goldsmith and J. Salmon, "Automatic creation of object hierarchies for
// ray tracing", IEEE CG&A 7(5), 1987); and whether the node has any surface.

@group(0) @binding(0) var<uniform> tree: Tree;
@group(0) @binding(1) var<storage, read> boxes: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> entered: array<f32>;
@group(0) @binding(3) var<storage, read_write> counted: array<f32>;

fn sides(node: u32) -> vec3<f32> {
    return max(boxes[2u * node + 1u].xyz - boxes[2u * node].xyz, vec3<f32>(0.0));
}

// Half the surface of a box with these sides.
fn half_area(s: vec3<f32>) -> f32 {
    return s.x * s.y + s.y * s.z + s.z * s.x;
}

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = (group.y * groups.x + group.x) * 256u + lane;
    if i >= arrayLength(&entered) {
        return;
    }
    let node = tree.levels[1].x + i;
    var level = 1u;
    for (var above = 2u; above < LEVELS; above++) {
        if above <= tree.top && node >= tree.levels[above].x {
            level = above;
        }
    }
    let here = tree.levels[level];
    let below = tree.levels[level - 1u];
    let size = sides(node);
    let longest = max(size.x, max(size.y, size.z));
    entered[i] = 0.0;
    counted[i] = 0.0;
    // A shorter one has no surface that could be told from none.
    if longest < 2.0 * FLUSH {
        return;
    }
    let whole = half_area(size / longest);
    if whole == 0.0 {
        return;
    }
    var parts: f32 = 0.0;
    for (var k = 0u; k < WIDTH; k++) {
        let child = WIDTH * (node - here.x) + k;
        if child < below.y {
            parts += half_area(sides(below.x + child) / longest);
        }
    }
    entered[i] = parts / whole;
    counted[i] = 1.0;
}
