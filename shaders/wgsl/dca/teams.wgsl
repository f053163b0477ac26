// A round: a team of lanes takes a join, a single lane anything else.

fn run_round(start: u32, lane: u32, is_up: bool) {
    let first = words[start];
    let first_join = words[start + 1u];
    let end = words[start + 2u];
    let passes = (first_join - first + LANES - 1u) / LANES;
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let at = first + pass_ * LANES + lane;
        if at < first_join {
            let word = words[at];
            if is_up {
                go_up(word & 3u, word >> 2u);
            } else {
                go_down(word & 3u, word >> 2u);
            }
        }
    }
    let join_passes = (end - first_join + JOINS - 1u) / JOINS;
    for (var pass_ = 0u; pass_ < join_passes; pass_++) {
        let at = first_join + pass_ * JOINS + lane / TEAM;
        let word = words[min(at, end - 1u)];
        if is_up {
            go_up_join(word >> 2u, at < end, lane);
        } else {
            go_down_join(word >> 2u, at < end, lane);
        }
    }
}
