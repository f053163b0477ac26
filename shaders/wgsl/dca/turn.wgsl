// What is across each chunk, from the handle it hangs from to that of its last body, in the state that is
// worked on; which becomes the state if the step has not failed, or is taken from it.

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
    if chunk == 0u {
        begin_attempts();
    }
    let slots = slots_of(chunk);
    if layer.stage == RESTORE {
        for (var place = 0u; place < slots.length; place++) {
            copy_joint(spot_of(slot_at(slots, place)), false);
        }
    }
    var across = no_turn();
    var next = given_of(slot_at(slots, 0u));
    var ahead = slot_ahead(slots, 1u);
    for (var place = 0u; place < slots.length; place++) {
        let given = next;
        next = given_of(ahead);
        ahead = slot_ahead(slots, place + 2u);
        if layer.stage == COMMIT {
            commit_joint(given);
        }
        let joint = local(given);
        let arm = quaternion_turned(joint.rotation, arm_of(given.spot.slot, given.spot.flags));
        across = then(
            across,
            Turn(
                joint.rotation,
                quaternion_turned(joint.rotation, joint.velocity.angular),
                joint.offset + arm,
            ),
        );
    }
    put_across(chunk, across);
}

fn commit_joint(given: Given) {
    let kind = kind_of(given.spot.flags);
    commit_works(given.spot);
    if kind == REVOLUTE || kind == PRISMATIC || kind == SCREW {
        state[given.spot.q] = chunk_real(given.position);
        state[sizes.positions + given.spot.v] = chunk_real(given.rate);
    } else {
        copy_joint(given.spot, true);
    }
}
