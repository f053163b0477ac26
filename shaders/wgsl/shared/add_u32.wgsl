alias Element = u32;

fn identity() -> Element {
    return 0u;
}

fn combine(a: Element, b: Element) -> Element {
    return a + b;
}
