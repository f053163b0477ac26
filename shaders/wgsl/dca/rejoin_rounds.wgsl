// Rounds of joins alone, up in a correction.

fn go_up_rounds(lane: u32) {
    var even = up_ahead(0u, lane);
    var odd = up_ahead(1u, lane);
    let pairs = (layer.rounds + 1u) / 2u;
    for (var pair = 0u; pair < pairs; pair++) {
        let round = 2u * pair;
        go_up_join(even, lane);
        even = up_ahead(round + 2u, lane);
        workgroupBarrier();
        if round + 1u < layer.rounds {
            go_up_join(odd, lane);
            odd = up_ahead(round + 3u, lane);
            workgroupBarrier();
        }
    }
    // What the way down reads is in memory.
    storageBarrier();
}
