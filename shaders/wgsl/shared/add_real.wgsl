alias Element = real;

fn identity() -> Element {
    return real(0);
}

fn combine(a: Element, b: Element) -> Element {
    return a + b;
}
