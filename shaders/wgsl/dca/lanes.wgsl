// A round, a lane for each item.

// A join in kinematics: what is across its parts; what it hangs from, which is what another join hangs from,
// then what is across a part, or the body that carries it.
struct Seam {
    join: u32,
    inboard: u32,
    outboard: u32,
    under: u32,
    across: u32,
    carrier: u32,
}

struct Ahead {
    bounds: Bounds,
    // The lane's first, if it has one.
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
    );
}

fn look(bounds: Bounds, lane: u32) -> Ahead {
    return Ahead(bounds, seam_at(bounds.joins + RECORD * lane));
}

fn run_round(ahead: Ahead, lane: u32, is_up: bool) {
    let bounds = ahead.bounds;
    run_items(bounds, lane, is_up);
    let joins = (bounds.end - bounds.joins) / RECORD;
    let passes = (joins + LANES - 1u) / LANES;
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let item = pass_ * LANES + lane;
        if item < joins {
            var seam = ahead.seam;
            if pass_ > 0u {
                seam = seam_at(bounds.joins + RECORD * item);
            }
            if is_up {
                go_up_join(seam);
            } else {
                go_down_join(seam);
            }
        }
    }
}
