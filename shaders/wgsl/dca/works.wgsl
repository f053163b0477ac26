// What a step that has not failed does to elements: the work done so far is that of the state, and the next step
// begins with its first attempt.

fn begin_attempts() { control[LAST_ASKED] = 0u; }

fn commit_works(spot: Spot) {
    // What is fixed has no freedom, and its number may be the next one's.
    if kind_of(spot.flags) == FIXED {
        return;
    }
    for (var k = 0u; k < WORKS; k++) {
        let sum = works_at() + k * sizes.dofs + spot.v;
        state[sum] = state[sum + WORKS * sizes.dofs];
    }
}
