// A round, a lane for each item.

fn run_round(start: u32, lane: u32, is_up: bool) {
    let first = words[start];
    let count = words[start + 2u] - first;
    let passes = (count + LANES - 1u) / LANES;
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let item = pass_ * LANES + lane;
        if item < count {
            let word = words[first + item];
            if is_up {
                go_up(word & 3u, word >> 2u);
            } else {
                go_down(word & 3u, word >> 2u);
            }
        }
    }
}
