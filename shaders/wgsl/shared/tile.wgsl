// A workgroup of 256 lanes takes a tile of consecutive elements, each lane four of them in a row.
// With `Element`, `identity`, `combine` and `load` of other parts.
const THREADS: u32 = 256u;
// Doublings from one lane to all.
const ROUNDS: u32 = 8u;
const ITEMS: u32 = 4u;
const TILE: u32 = 1024u;

// Loads the elements of a lane from `first` on, of `count` in all; returns what they combine to.
fn load_items(first: u32, count: u32, items: ptr<function, array<Element, ITEMS>>) -> Element {
    var total = identity();
    for (var i = 0u; i < ITEMS; i++) {
        if first + i < count {
            (*items)[i] = load(first + i);
            total = combine(total, (*items)[i]);
        }
    }
    return total;
}
