// For models no chunk of which ends with a leaf.

fn with_leaf_again(chunk: u32, slots: Slots, change: Change, bias: Force) -> Change { return change; }
