// Joins, down: six of a team's lanes own a number each of the force between the parts.

fn go_down_join(seam: Seam, has_join: bool, lane: u32) {
    let own = lane % TEAM;
    if !has_join || own >= 6u {
        return;
    }
    let at = joined_at(seam.join) + ROW_SIZE * own;
    let r = vec4<real>(nodes[at]);
    let s = vec4<real>(nodes[at + 1u]);
    let t = vec4<real>(nodes[at + 2u]);
    var number: real = number_at(at, DIFFERENCE);
    var x: Force;
    if seam.before != NONE {
        x = acting(seam.before);
    } else {
        x = hanging_again(seam.head, seam.carrier);
    }
    number += dot(r.xyz, x.angular) + dot(vec3<real>(r.w, s.xy), x.linear);
    if seam.after != NONE {
        // On the inboard part it acts the other way round.
        let f = acting(seam.after);
        number += dot(vec3<real>(s.zw, t.x), f.angular) + dot(t.yzw, f.linear);
    }
    put_number(acting_at(seam.join), own, number);
    keep_number(seam.join, own, number);
}
