// Joins, up in a correction: what differs anew, from the accelerations on both sides, and what that adds to
// those of the whole; join.rs of the dynamics has the formulas (`rejoin`).

const HANDED = 12u;

// What a lane reads of a join: twelve own a column each of what it keeps, another one the factor.
struct Up {
    seam: Seam,
    has_join: bool,
    apart: Force,
    column: Force,
    factor: Cholesky6,
    // From other dispatches: what adds to b2 of the inboard part and b1 of the outboard one, and to the lane's number.
    inboard: Force,
    outboard: Force,
    before: real,
}

fn known_up(seam: Seam, has_join: bool, lane: u32) -> Up {
    let own = lane % TEAM;
    var known: Up;
    known.seam = seam;
    known.has_join = has_join && own <= 12u;
    if !known.has_join {
        return known;
    }
    known.apart = apart(seam.join);
    if own < 12u {
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
    } else {
        known.factor = get_factor(seam.join);
    }
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
        let b0 = vec4<real>(nodes[b]);
        let b1 = vec4<real>(nodes[b + 1u]);
        known.outboard = Force(b0.xyz, vec3<real>(b0.w, b1.xy));
        if own >= 6u && own < 12u {
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
    let differing = force_add(known.apart, force_sub(inboard, outboard));
    if own < 12u {
        var before: real = known.before;
        let own_place = select(b, a, own < 6u);
        if own_place != NOWHERE {
            before = handed_number(own_place, own);
        }
        let by: real = dot(known.column.angular, differing.angular)
            + dot(known.column.linear, differing.linear);
        let is_taken = own < 6u && seam.head == NONE;
        let changed: real = before + select(by, -by, is_taken);
        put_number(change_at(sizes.chunk_nodes + seam.join), own, changed);
        hand_on(seam, own, changed);
        if own < 6u && seam.rake != NONE {
            add_to_rake(seam.rake, own, changed);
        }
    } else {
        let rows = joined_at(seam.join);
        let solved = cholesky6_solve(known.factor, differing);
        put_number(rows, DIFFERENCE, solved.angular.x);
        put_number(rows + ROW_SIZE, DIFFERENCE, solved.angular.y);
        put_number(rows + 2u * ROW_SIZE, DIFFERENCE, solved.angular.z);
        put_number(rows + 3u * ROW_SIZE, DIFFERENCE, solved.linear.x);
        put_number(rows + 4u * ROW_SIZE, DIFFERENCE, solved.linear.y);
        put_number(rows + 5u * ROW_SIZE, DIFFERENCE, solved.linear.z);
    }
}

fn end_round_up() { workgroupBarrier(); }

// What the way down reads is in memory.
fn end_up() { storageBarrier(); }
