fn load(i: u32) -> Element {
    return data[i];
}
