// What is across each chunk in the state that is worked on, which becomes the state if the step has not
// failed, or is taken from it.

const KEEP = 0u;
const COMMIT = 1u;
const RESTORE = 2u;

fn turn_chunk(chunk: u32) {
    let has_failed = atomicLoad(&status[0]) != 0u;
    if layer.stage == COMMIT {
        // What the first lane writes below is one of these two whenever it is read elsewhere.
        if has_failed || control[HALTED] != 0u {
            if chunk == 0u {
                control[HALTED] = 1u;
            }
            return;
        }
        if chunk == 0u {
            control[STEPS] += 1u;
        }
    }
    if layer.stage != KEEP {
        let slots = slots_of(chunk);
        for (var place = 0u; place < slots.length; place++) {
            copy_joint(slot_at(slots, place));
        }
    }
    put_across(chunk, across_chunk(chunk));
}

fn copy_joint(slot: u32) {
    var positions = 0u;
    var rates = 0u;
    switch kind_of(flags_of(slot)) {
        case REVOLUTE, PRISMATIC: { positions = 1u; rates = 1u; }
        case SPHERICAL: { positions = 4u; rates = 3u; }
        case FREE: { positions = 7u; rates = 6u; }
        default: {}
    }
    let q = position_of(slot);
    for (var i = 0u; i < positions; i++) {
        copy_number(q + i, work_q() + q + i);
    }
    let v = dof_of(slot);
    for (var i = 0u; i < rates; i++) {
        copy_number(sizes.positions + v + i, work_qd() + v + i);
    }
}

fn copy_number(start: u32, work: u32) {
    if layer.stage == COMMIT {
        state[start] = state[work];
    } else {
        state[work] = state[start];
    }
}
