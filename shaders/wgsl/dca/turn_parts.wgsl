// Rotations, angular velocities and positions over the rounds of the tree: up, across each join; down, what
// each join and chunk hangs from, and the bodies.

const LANES = 128u;

fn go_up_join(seam: Seam) {
    put_across(sizes.chunks + seam.join, then(get_across(seam.inboard), get_across(seam.outboard)));
}

fn go_down_join(seam: Seam) {
    var start = no_turn();
    if seam.under != NONE {
        start = under(seam.under, seam.across);
    } else if seam.carrier != NONE {
        start = carried(seam.carrier);
    }
    put_turn(unders_at() + seam.join, sizes.joins, start);
}
