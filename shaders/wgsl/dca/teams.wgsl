// A round: a team of lanes takes a join, a single lane anything else.

const TEAM = 16u;
const JOINS = LANES / TEAM;

// A join in dynamics: the nodes of its parts; the joins before and after; if it is the head of a path, its first
// body and the one that carries it; its rake.
struct Seam {
    join: u32,
    inboard: u32,
    outboard: u32,
    before: u32,
    after: u32,
    head: u32,
    carrier: u32,
    rake: u32,
}

struct Ahead {
    bounds: Bounds,
    // The team's first, if it has one.
    seam: Seam,
}

fn seam_at(at: u32) -> Seam {
    return Seam(
        words[at],
        words[at + 1u],
        words[at + 2u],
        words[at + 3u],
        words[at + 4u],
        words[at + 5u],
        words[at + 6u],
        words[at + 7u],
    );
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
            go_up_join(seam, item < joins, lane);
        } else {
            go_down_join(seam, item < joins, lane);
        }
    }
}
