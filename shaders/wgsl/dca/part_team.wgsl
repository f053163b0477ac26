// Joins, down: six of a team's lanes own a number each of the force between the parts.

// What a lane reads of a join.
struct Down {
    seam: Seam,
    has_join: bool,
    r: vec4<real>,
    s: vec4<real>,
    t: vec4<real>,
    differing: Differing,
    kept: chunk_real,
    // From other dispatches.
    x: Force,
    f2: Force,
}

fn known_down(seam: Seam, has_join: bool, lane: u32) -> Down {
    let own = lane % TEAM;
    var known: Down;
    known.seam = seam;
    known.has_join = has_join && own < 6u;
    if !known.has_join {
        return known;
    }
    let at = joined_at(seam.join) + ROW_SIZE * own;
    known.r = vec4<real>(nodes[at]);
    known.s = vec4<real>(nodes[at + 1u]);
    known.t = vec4<real>(nodes[at + 2u]);
    known.differing = differing_in(seam.join, at, own);
    known.kept = kept_number(seam.join, own);
    if seam.before == NONE {
        known.x = hanging_again(seam.head, seam.carrier);
    } else if place_of(seam, BEFORE_PLACE) == NOWHERE {
        known.x = acting(seam.before);
    }
    if seam.after != NONE && place_of(seam, AFTER_PLACE) == NOWHERE {
        known.f2 = acting(seam.after);
    }
    return known;
}

fn go_down_join(known: Down, lane: u32) {
    if !known.has_join {
        return;
    }
    let own = lane % TEAM;
    let before = place_of(known.seam, BEFORE_PLACE);
    let after = place_of(known.seam, AFTER_PLACE);
    var x = known.x;
    if before != NOWHERE {
        x = handed_force(before, 0u);
    }
    // On the inboard part it acts the other way round.
    var f = known.f2;
    if after != NOWHERE {
        f = handed_force(after, 0u);
    }
    let r = known.r;
    let s = known.s;
    let t = known.t;
    var number: real = number_differing(known.differing);
    number += dot(r.xyz, x.angular) + dot(vec3<real>(r.w, s.xy), x.linear);
    number += dot(vec3<real>(s.zw, t.x), f.angular) + dot(t.yzw, f.linear);
    put_number(acting_at(known.seam.join), own, number);
    hand_on(known.seam, own, number);
    keep_number(known.seam.join, own, known.kept, number);
}
