// Rotations, angular velocities and positions over the rounds of the tree: up, across each join; down, what
// each join and chunk hangs from, and the bodies.

const LANES = 128u;

fn go_up(kind: u32, index: u32) {
    if kind == JOIN {
        let inboard = get_across(join_word(index, INBOARD_TURN));
        let outboard = get_across(join_word(index, OUTBOARD_TURN));
        put_across(sizes.chunks + index, then(inboard, outboard));
    }
}

fn go_down(kind: u32, index: u32) {
    if kind == JOIN {
        let parent = join_word(index, JOIN_PARENT);
        let carrier = join_word(index, CARRIER);
        var start = no_turn();
        if parent != NONE {
            start = under(parent);
        } else if carrier != NONE {
            start = carried(carrier);
        }
        put_turn(unders_at() + index, sizes.joins, start);
    } else if kind == CHUNK {
        place_chunk(index);
    }
}
