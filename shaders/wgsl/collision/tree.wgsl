// The tree of a mesh: level 0 is the blocks.

const LEVELS: u32 = 12u;

struct Tree {
    // The level of the root.
    top: u32,
    // Where each level begins, and how many nodes it has.
    levels: array<vec4<u32>, LEVELS>,
}
