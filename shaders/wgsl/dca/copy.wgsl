// Coordinates of a joint from the state that is worked on to that at the start of a step, or back.

fn copy_joint(spot: Spot, is_taken: bool) {
    var positions = 0u;
    var rates = 0u;
    switch kind_of(spot.flags) {
        case REVOLUTE, PRISMATIC, SCREW: { positions = 1u; rates = 1u; }
        case SPHERICAL: { positions = 4u; rates = 3u; }
        case FREE: { positions = 7u; rates = 6u; }
        default: {}
    }
    let q = spot.q;
    for (var i = 0u; i < positions; i++) {
        copy_number(q + i, work_q() + q + i, is_taken);
    }
    let v = spot.v;
    for (var i = 0u; i < rates; i++) {
        copy_number(sizes.positions + v + i, work_qd() + v + i, is_taken);
    }
}

fn copy_number(start: u32, work: u32, is_taken: bool) {
    if is_taken {
        state[start] = state[work];
    } else {
        state[work] = state[start];
    }
}
