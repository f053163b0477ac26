// Joins, up in a correction: what differs anew, from the accelerations on both sides, and what that adds to
// those of the whole; join.rs of the dynamics has the formulas (`rejoin`). Twelve lanes own a number each of the
// latter, and a column of what the join keeps; six of them one of what differs.

const HANDED = 12u;

// What a lane reads of a join.
struct Up {
    seam: Seam,
    has_join: bool,
    apart: Force,
    column: Force,
    // From other dispatches: what adds to b2 of the inboard part and b1 of the outboard one, and to the lane's number.
    inboard: Force,
    outboard: Force,
    before: real,
}

fn known_up(seam: Seam, has_join: bool, lane: u32) -> Up {
    let own = lane % TEAM;
    var known: Up;
    known.seam = seam;
    known.has_join = has_join && own < 12u;
    if !known.has_join {
        return known;
    }
    known.apart = apart(seam.join);
    let rows = joined_at(seam.join);
    known.column = Force(
        vec3<real>(
            number_at(rows, own),
            number_at(rows + ROW_SIZE, own),
            number_at(rows + 2u * ROW_SIZE, own),
        ),
        vec3<real>(
            number_at(rows + 3u * ROW_SIZE, own),
            number_at(rows + 4u * ROW_SIZE, own),
            number_at(rows + 5u * ROW_SIZE, own),
        ),
    );
    if place_of(seam, INBOARD_PLACE) == NOWHERE {
        let a = change_at(seam.inboard);
        let a1 = vec4<real>(nodes[a + 1u]);
        let a2 = vec4<real>(nodes[a + 2u]);
        known.inboard = Force(vec3<real>(a1.zw, a2.x), a2.yzw);
        if own < 6u {
            known.before = number_at(a, own);
        }
    }
    if place_of(seam, OUTBOARD_PLACE) == NOWHERE {
        let b = change_at(seam.outboard);
        known.outboard = six_at(b);
        if own >= 6u {
            known.before = number_at(b, own);
        }
    }
    return known;
}

fn go_up_join(known: Up, lane: u32) {
    if !known.has_join {
        return;
    }
    let own = lane % TEAM;
    let seam = known.seam;
    let a = place_of(seam, INBOARD_PLACE);
    let b = place_of(seam, OUTBOARD_PLACE);
    var inboard = known.inboard;
    if a != NOWHERE {
        inboard = handed_force(a, 6u);
    }
    var outboard = known.outboard;
    if b != NOWHERE {
        outboard = handed_force(b, 0u);
    }
    var before: real = known.before;
    let own_place = select(b, a, own < 6u);
    if own_place != NOWHERE {
        before = handed_number(own_place, own);
    }
    let differing = force_add(known.apart, force_sub(inboard, outboard));
    let by: real = dot(known.column.angular, differing.angular)
        + dot(known.column.linear, differing.linear);
    let is_taken = own < 6u && seam.head == NONE;
    let changed: real = before + select(by, -by, is_taken);
    hand_on(seam, own, changed);
    put_number(change_at(sizes.chunk_nodes + seam.join), own, changed);
    if own < 6u {
        let three = select(differing.linear, differing.angular, own < 3u);
        put_number(differing_at(seam.join), own, three[own % 3u]);
        if seam.rake != NONE {
            add_to_rake(seam.rake, own, changed);
        }
    }
}

// What a lane reads of a join for what differs in it: a row of the inverse.
struct Differing {
    row: Force,
    by: Force,
}

fn differing_in(join: u32, row: u32, own: u32) -> Differing {
    return Differing(inverse_row(join, own), six_at(differing_at(join)));
}

fn number_differing(known: Differing) -> real {
    return dot(known.row.angular, known.by.angular) + dot(known.row.linear, known.by.linear);
}
