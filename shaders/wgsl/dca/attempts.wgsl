// Solutions of one step: where laws of elements turn out to be on other parts than those that a solution took, the
// step is solved again with these. Dispatches of attempts that no one has asked for do nothing.

var<workgroup> asked: u32;

fn is_needed() -> bool {
    return layer.attempt < 2u || control[LAST_ASKED] + 1u >= layer.attempt;
}

// The same for all lanes of a workgroup.
fn is_group_needed(lane: u32) -> bool {
    if layer.attempt < 2u {
        return true;
    }
    if lane == 0u {
        asked = control[LAST_ASKED];
    }
    return workgroupUniformLoad(&asked) + 1u >= layer.attempt;
}

// Whether the state that is worked on is that of the bodies.
fn is_first_attempt() -> bool { return layer.attempt < 2u; }
