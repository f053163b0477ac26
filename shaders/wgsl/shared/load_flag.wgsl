// A flag counts one, whatever it is if not zero.
fn load(i: u32) -> Element {
    return select(0u, 1u, data[i] != 0u);
}
