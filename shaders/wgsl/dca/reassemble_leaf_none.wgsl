// For models no chunk of which ends with a leaf.

fn with_leaf_again(is_head: bool, change: Change, slot: u32, share: real, index: u32) -> Change {
    return change;
}
