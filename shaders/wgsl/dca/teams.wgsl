// A round: a team of lanes takes a join, a single lane anything else.

struct Ahead {
    bounds: Bounds,
    // The team's first, if it has one.
    seam: Seam,
}

fn look(bounds: Bounds, lane: u32) -> Ahead {
    return Ahead(bounds, seam_at(bounds.joins + RECORD * (lane / TEAM)));
}

fn run_round(ahead: Ahead, lane: u32, is_up: bool) {
    let bounds = ahead.bounds;
    run_items(bounds, lane, is_up);
    let joins = (bounds.end - bounds.joins) / RECORD;
    let join_passes = (joins + JOINS - 1u) / JOINS;
    for (var pass_ = 0u; pass_ < join_passes; pass_++) {
        let item = pass_ * JOINS + lane / TEAM;
        var seam = ahead.seam;
        if pass_ > 0u {
            seam = seam_at(bounds.joins + RECORD * item);
        }
        if is_up {
            go_up_join(known_up(seam, item < joins, lane), lane);
        } else {
            go_down_join(known_down(seam, item < joins, lane), lane);
        }
    }
}
