// A workgroup of 256 lanes takes a tile of consecutive elements, each lane four of them in a row.
const THREADS: u32 = 256u;
// Doublings from one lane to all.
const ROUNDS: u32 = 8u;
const ITEMS: u32 = 4u;
const TILE: u32 = 1024u;

struct Range {
    // Number of elements.
    count: u32,
    // Number of tiles.
    tiles: u32,
}
