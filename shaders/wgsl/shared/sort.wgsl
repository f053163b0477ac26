// One pass of the sort: by one digit of the key. BITS, ITEMS and ROWS come from the host.
const THREADS: u32 = 256u;
const TILE: u32 = THREADS * ITEMS;
const BINS: u32 = 1u << BITS;

struct Digit {
    // Its lowest bit.
    shift: u32,
    // Its bits that count: fewer than all in the last pass of some keys.
    mask: u32,
}

fn digit_of(key: u32) -> u32 {
    return (key >> digit.shift) & digit.mask;
}
