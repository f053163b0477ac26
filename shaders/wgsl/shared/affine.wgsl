// The maps x -> a x + b of integers modulo 2^16, a in the lower half of the word and b in the upper;
// combine(f, g) is f, then g. Associative, not commutative: what keeps its order passes with it.
alias Element = u32;

fn identity() -> Element {
    return 1u;
}

fn combine(f: Element, g: Element) -> Element {
    let a = (f * g) & 0xffffu;
    let b = (g & 0xffffu) * (f >> 16u) + (g >> 16u);
    return a | (b << 16u);
}
