// Rotations, angular velocities and positions over the rounds of the tree: up, across each chunk and join;
// down, what each join hangs from, and the bodies of chunks after the first round's.

const LANES = 256u;

fn go_up(kind: u32, index: u32) {
    if kind != SUM {
        turn_chunk(index);
    }
}

fn go_down(kind: u32, index: u32) {
    if kind == CHUNK {
        place_chunk(index);
    }
}

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
