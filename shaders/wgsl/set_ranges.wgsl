// Writes what each level works on where only the device knows how many elements there are.

struct Lengths {
    // Elements there is room for.
    most: u32,
    // Elements of a tile of the first level.
    tile: u32,
    // Elements of the second level for each tile of the first.
    per_tile: u32,
    // Elements of a tile of the second level and all further.
    further_tile: u32,
}

@group(0) @binding(0) var<uniform> lengths: Lengths;
@group(0) @binding(1) var<storage, read> count: array<u32>;
@group(0) @binding(2) var<storage, read_write> ranges: Ranges;

@compute @workgroup_size(1)
fn main() {
    var elements = min(count[0], lengths.most);
    var tile = lengths.tile;
    var per_tile = lengths.per_tile;
    for (var i = 0u; i < LEVELS; i++) {
        // The quotient rounded up, without a sum that could wrap.
        let tiles = elements / tile + select(0u, 1u, elements % tile != 0u);
        ranges.level[i] = Range(elements, tiles, vec2<u32>(0u));
        elements = tiles * per_tile;
        tile = lengths.further_tile;
        per_tile = 1u;
    }
}
