// Where the bodies of a group are, how they move, and how they accelerate when the world does not; kinematics.rs
// of the dynamics has the formulas.

struct Place {
    rotation: vec4<real>,
    offset: vec3<real>,
    spin: vec3<real>,
    velocity: vec3<real>,
    turning: vec3<real>,
    acceleration: vec3<real>,
}

fn place_of(g: Group, body: u32) -> Place {
    let at = body_memory(g, body);
    return Place(
        vec4<real>(three(at + ROTATION), number(at + ROTATION + 3u)),
        three(at + OFFSET),
        three(at + SPIN),
        three(at + VELOCITY),
        three(at + TURNING),
        three(at + ACCELERATION),
    );
}

fn put_place(g: Group, body: u32, p: Place) {
    let at = body_memory(g, body);
    put_three(at + ROTATION, p.rotation.xyz);
    put_number(at + ROTATION + 3u, p.rotation.w);
    put_three(at + OFFSET, p.offset);
    put_three(at + SPIN, p.spin);
    put_three(at + VELOCITY, p.velocity);
    put_three(at + TURNING, p.turning);
    put_three(at + ACCELERATION, p.acceleration);
}

fn place_member(g: Group, body: u32) {
    let member = member_at(g, body);
    let spot = member.spot;
    let kind = kind_of(spot.flags);
    let constants = g.constants + 5u * body;
    let joint = local(Given(
        spot,
        vec4<real>(links[constants]),
        vec4<real>(links[constants + 1u]).xyz,
        position(spot.q),
        rate(spot.v),
    ));
    var parent: Place = Place(vec4<real>(0.0, 0.0, 0.0, 1.0), zero3(), zero3(), zero3(), zero3(), zero3());
    if member.parent != NONE {
        parent = place_of(g, member.parent);
    }
    let rotation = turned_by(parent.rotation, joint.rotation);
    let offset = quaternion_turned(parent.rotation, joint.offset);
    let velocity = Motion(
        quaternion_turned(rotation, joint.velocity.angular),
        quaternion_turned(rotation, joint.velocity.linear),
    );
    let axes = quaternion_matrix(rotation);
    var a = velocity_product(kind, parent.spin, offset, velocity);
    var height: real = dot(upwards(), offset);
    if member.parent != NONE {
        height += number(body_memory(g, member.parent) + HEIGHT);
    }
    put_number(body_memory(g, body) + HEIGHT, height);
    let freedoms = freedoms_of(kind);
    for (var k = 0u; k < freedoms; k++) {
        let s = freedom_along(spot, k, axes);
        let qdd: real = real(state[accelerations_at() + spot.v + k]);
        a = Motion(a.angular + s.angular * qdd, a.linear + s.linear * qdd);
    }
    put_place(g, body, Place(
        rotation,
        offset,
        parent.spin + velocity.angular,
        parent.velocity + cross3(parent.spin, offset) + velocity.linear,
        parent.turning + a.angular,
        parent.acceleration + cross3(parent.turning, offset) + a.linear,
    ));
}

fn place_members(g: Group, lane: u32) {
    for (var level = 0u; level < g.levels; level++) {
        let bounds = level_at(g, level);
        let passes = passes_for(bounds.y - bounds.x);
        for (var pass_ = 0u; pass_ < passes; pass_++) {
            let body = bounds.x + pass_ * LANES + lane;
            if body < bounds.y {
                place_member(g, body);
            }
        }
        wait_for_numbers();
    }
}
