// Joins, up in a correction: what differs anew, from the accelerations on both sides, and what that adds to
// those of the whole; join.rs of the dynamics has the formulas (`rejoin`).

fn go_up_join(seam: Seam, has_join: bool, lane: u32) {
    let own = lane % TEAM;
    if !has_join || own > 12u {
        return;
    }
    let a = change_at(seam.inboard);
    let b = change_at(seam.outboard);
    let a1 = vec4<real>(nodes[a + 1u]);
    let a2 = vec4<real>(nodes[a + 2u]);
    let b0 = vec4<real>(nodes[b]);
    let b1 = vec4<real>(nodes[b + 1u]);
    let beyond = Force(
        vec3<real>(a1.zw, a2.x) - b0.xyz,
        a2.yzw - vec3<real>(b0.w, b1.xy),
    );
    let differing = force_add(apart(seam.join), beyond);
    let rows = joined_at(seam.join);
    if own < 12u {
        let angular = vec3<real>(
            number_at(rows, own),
            number_at(rows + ROW_SIZE, own),
            number_at(rows + 2u * ROW_SIZE, own),
        );
        let linear = vec3<real>(
            number_at(rows + 3u * ROW_SIZE, own),
            number_at(rows + 4u * ROW_SIZE, own),
            number_at(rows + 5u * ROW_SIZE, own),
        );
        let by: real = dot(angular, differing.angular) + dot(linear, differing.linear);
        let is_taken = own < 6u && seam.head == NONE;
        let before: real = number_at(select(b, a, own < 6u), own);
        let changed: real = before + select(by, -by, is_taken);
        put_number(change_at(sizes.chunk_nodes + seam.join), own, changed);
        if own < 6u && seam.rake != NONE {
            add_to_rake(seam.rake, own, changed);
        }
    } else if own == 12u {
        let solved = cholesky6_solve(get_factor(seam.join), differing);
        put_number(rows, DIFFERENCE, solved.angular.x);
        put_number(rows + ROW_SIZE, DIFFERENCE, solved.angular.y);
        put_number(rows + 2u * ROW_SIZE, DIFFERENCE, solved.angular.z);
        put_number(rows + 3u * ROW_SIZE, DIFFERENCE, solved.linear.x);
        put_number(rows + 4u * ROW_SIZE, DIFFERENCE, solved.linear.y);
        put_number(rows + 5u * ROW_SIZE, DIFFERENCE, solved.linear.z);
    }
}
