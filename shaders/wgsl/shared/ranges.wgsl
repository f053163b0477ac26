// What a kernel works on, level by level: elements, the totals of their tiles, the totals of those.
const LEVELS: u32 = 4u;

struct Range {
    // Number of elements.
    count: u32,
    // Number of tiles.
    tiles: u32,
    // An array of uniforms has elements of 16 bytes.
    unused: vec2<u32>,
}

struct Ranges {
    level: array<Range, LEVELS>,
}
