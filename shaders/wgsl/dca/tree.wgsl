// The joins of the tree, up and down.

// Rounding of the tree as multiples of rounding of the chunks.
override COARSER: f32 = 1.0;

fn join_parts(join: u32) {
    let a = get_node(join_word(join, INBOARD_NODE));
    let b = get_node(join_word(join, OUTBOARD_NODE));
    let is_head = join_word(join, HEAD) != NONE;
    let whole = joined_rigidly(is_head, a, b);
    if !whole.joined.factor.positive {
        fail(UNJOINED, join_word(join, CUT));
    }
    put_joined(join, whole.joined);
    put_node(sizes.chunk_nodes + join, whole.node);
    let rake = join_word(join, JOIN_RAKE);
    if rake != NONE {
        put_rake(rake, Rake(whole.node.phi11, whole.node.b1, vec2<real>(0.0, 0.0)), real(COARSER));
    }
}

fn part_parts(join: u32) {
    let parent = join_word(join, JOIN_PARENT);
    var ends = Ends(force_zero(), force_zero());
    if parent != NONE {
        ends = handed(parent);
    } else {
        ends.x = hanging(join_word(join, HEAD), join_word(join, CARRIER));
    }
    let force = force_between(get_joined(join), ends.x, ends.f2);
    put_acting(join, Acting(ends.x, ends.f2, force));
}
