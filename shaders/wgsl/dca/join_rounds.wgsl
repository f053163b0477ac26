// Rounds of joins alone, up. Nodes go through memory.

fn go_up_rounds(lane: u32) {
    for (var round = 0u; round < layer.rounds; round++) {
        go_up_join(up_ahead(round, lane), lane);
        storageBarrier();
    }
}
