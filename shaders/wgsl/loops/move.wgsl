// What has been solved for, added to accelerations, rates or positions.

// Adds to numbers of `state`, one for each freedom.
fn add_solved(g: Group, body: u32, start: u32) {
    let member = member_at(g, body);
    let freedoms = freedoms_of(kind_of(member.spot.flags));
    for (var k = 0u; k < freedoms; k++) {
        let at = start + member.spot.v + k;
        let change = number(freedom_memory(g, member.dof + k) + SOLVED);
        state[at] = chunk_real(real(state[at]) + change);
    }
}

// Moves the positions that are worked on, a part of the way.
fn move_member(g: Group, body: u32, part: real) {
    let member = member_at(g, body);
    let kind = kind_of(member.spot.flags);
    let q = work_q() + member.spot.q;
    let at = freedom_memory(g, member.dof) + SOLVED;
    let angular = vec3<real>(number(at), number(at + FREEDOM), number(at + 2u * FREEDOM)) * part;
    switch kind {
        case REVOLUTE, PRISMATIC, SCREW: {
            state[q] = chunk_real(real(state[q]) + angular.x);
        }
        case SPHERICAL: { put_state4(q, quaternion_integrated(state4(q), angular)); }
        case FREE: {
            let linear = vec3<real>(
                number(at + 3u * FREEDOM),
                number(at + 4u * FREEDOM),
                number(at + 5u * FREEDOM),
            ) * part;
            let u = to_displacement_axes(kind, q, Motion(angular, linear));
            put_state3(q, state3(q) + u.linear);
            put_state4(q + 3u, quaternion_integrated(state4(q + 3u), u.angular));
        }
        default: {}
    }
}
