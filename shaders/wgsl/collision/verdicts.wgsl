// What a test says of a pair: whether it meets, or that it cannot tell.
const MISS: u32 = 0u;
const HIT: u32 = 1u;
const OPEN: u32 = 2u;
