// Boxes of nodes from those of their children: of two levels in one go.

struct Levels {
    // Number of nodes of each level, and where it begins.
    children: u32,
    children_at: u32,
    parents: u32,
    parents_at: u32,
    grandparents: u32,
    grandparents_at: u32,
}

var<workgroup> lows: array<vec3<f32>, 256>;
var<workgroup> highs: array<vec3<f32>, 256>;

// The box of eight boxes in a row.
fn union_of(first: u32) -> Box {
    var all = Box(lows[first], highs[first]);
    for (var k = 1u; k < WIDTH; k++) {
        all.low = min(all.low, lows[first + k]);
        all.high = max(all.high, highs[first + k]);
    }
    return all;
}

fn store(node: u32, bounds: Box) {
    boxes[2u * node] = vec4<f32>(bounds.low, 0.0);
    boxes[2u * node + 1u] = vec4<f32>(bounds.high, 0.0);
}

// For the box of child `256 group + lane`.
fn fit(bounds: Box, lane: u32, group: u32) {
    lows[lane] = bounds.low;
    highs[lane] = bounds.high;
    // All children are there before they are joined ...
    workgroupBarrier();
    var parent = empty_box();
    if lane < 32u {
        parent = union_of(WIDTH * lane);
        let node = 32u * group + lane;
        if node < levels.parents {
            store(levels.parents_at + node, parent);
        }
    }
    // ... and joined before parents take their places.
    workgroupBarrier();
    if lane < 32u {
        lows[lane] = parent.low;
        highs[lane] = parent.high;
    }
    // The same for parents.
    workgroupBarrier();
    if lane < 4u {
        let node = 4u * group + lane;
        if node < levels.grandparents {
            store(levels.grandparents_at + node, union_of(WIDTH * lane));
        }
    }
}
