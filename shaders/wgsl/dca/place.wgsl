// Where the bodies are and how they turn; place.rs of the dynamics has the formulas. Rotations are unit
// quaternions, brought back to unit length at each product.

// How one end of a part is turned, turns and is placed, seen from another.
struct Turn {
    rotation: vec4<real>,
    spin: vec3<real>,
    position: vec3<real>,
}

fn no_turn() -> Turn {
    return Turn(vec4<real>(0.0, 0.0, 0.0, 1.0), zero3(), zero3());
}

// The product of unit quaternions is of unit length but for rounding, which one Newton step removes.
fn turned_by(a: vec4<real>, b: vec4<real>) -> vec4<real> {
    let product = quaternion_product(a, b);
    return product * (1.5 - 0.5 * dot(product, product));
}

fn then(a: Turn, b: Turn) -> Turn {
    return Turn(
        turned_by(a.rotation, b.rotation),
        a.spin + quaternion_turned(a.rotation, b.spin),
        a.position + quaternion_turned(a.rotation, b.position),
    );
}

fn put_turn(at: u32, stride: u32, turn: Turn) {
    put(at, turn.rotation);
    put(at + stride, vec4<real>(turn.spin, 0.0));
    put(at + 2u * stride, vec4<real>(turn.position, 0.0));
}

fn get_turn(at: u32, stride: u32) -> Turn {
    return Turn(fetch(at), fetch(at + stride).xyz, fetch(at + 2u * stride).xyz);
}

fn put_across(index: u32, turn: Turn) { put_turn(turns_at() + index, turns(), turn); }

fn get_across(index: u32) -> Turn { return get_turn(turns_at() + index, turns()); }

// A joint as it stands: the child in the axes of the body before, velocity in the child's axes.
struct Local {
    rotation: vec4<real>,
    offset: vec3<real>,
    velocity: Motion,
}

fn position(at: u32) -> real { return real(state[work_q() + at]); }

fn positions3(at: u32) -> vec3<real> {
    return vec3<real>(position(at), position(at + 1u), position(at + 2u));
}

fn orientation(at: u32) -> vec4<real> {
    return quaternion_normalized(vec4<real>(positions3(at), position(at + 3u)));
}

fn rate(at: u32) -> real { return real(state[work_qd() + at]); }

fn rates3(at: u32) -> vec3<real> { return vec3<real>(rate(at), rate(at + 1u), rate(at + 2u)); }

// What is read of a joint, a place ahead too.
struct Given {
    spot: Spot,
    rotation: vec4<real>,
    offset: vec3<real>,
    // Of joints of one freedom.
    position: real,
    rate: real,
}

fn given_of(slot: u32) -> Given {
    let spot = spot_of(slot);
    return Given(
        spot,
        vec4<real>(links[spot.slot]),
        vec4<real>(links[sizes.slots + spot.slot]).xyz,
        position(spot.q),
        rate(spot.v),
    );
}

fn local(given: Given) -> Local {
    var found = Local(given.rotation, given.offset, motion_zero());
    let q = given.spot.q;
    let v = given.spot.v;
    switch kind_of(given.spot.flags) {
        case REVOLUTE, SCREW: {
            let half: vec2<real> = sin_cos(0.5 * given.position);
            found.rotation = turned_by(found.rotation, vec4<real>(0.0, 0.0, half.x, half.y));
            found.velocity.angular = vec3<real>(0.0, 0.0, given.rate);
            if HAS_SCREWS {
                let pitch = pitch_of(given.spot.slot);
                let along: vec3<real> = vec3<real>(0.0, 0.0, pitch * given.position);
                found.offset += quaternion_turned(found.rotation, along);
                found.velocity.linear = vec3<real>(0.0, 0.0, pitch * given.rate);
            }
        }
        case PRISMATIC: {
            let along: vec3<real> = vec3<real>(0.0, 0.0, given.position);
            found.offset += quaternion_turned(found.rotation, along);
            found.velocity.linear = vec3<real>(0.0, 0.0, given.rate);
        }
        case SPHERICAL: {
            found.rotation = turned_by(found.rotation, orientation(q));
            found.velocity.angular = rates3(v);
        }
        case FREE: {
            found.offset += quaternion_turned(found.rotation, positions3(q));
            found.rotation = turned_by(found.rotation, orientation(q + 3u));
            found.velocity = Motion(rates3(v), rates3(v + 3u));
        }
        default: {}
    }
    return found;
}

// From the joint's origin to the handle point, in joint axes; of a body referred to its joint zero.
fn arm_of(slot: u32, flags: u32) -> vec3<real> {
    if (flags & AT_CENTER) == 0u {
        return zero3();
    }
    return vec4<real>(links[2u * sizes.slots + slot]).xyz;
}

// A body in the world: as place.rs has it, but for inertia and forces.
struct Placed {
    rotation: vec4<real>,
    spin: vec3<real>,
    // From the handle that the joint hangs from to the joint's origin.
    offset: vec3<real>,
    bias_acceleration: Motion,
}

fn put_placed(slot: u32, placed: Placed) {
    let c = placed.bias_acceleration;
    put4(slot, sizes.slots, placed.spin, placed.offset, c.linear, c.angular);
    put(3u * sizes.slots + slot, placed.rotation);
}

fn get_placed(slot: u32) -> Placed {
    let four = get4(slot, sizes.slots);
    return Placed(fetch(3u * sizes.slots + slot), four.a, four.b, Motion(four.d, four.c));
}

// What a join hangs from, then what is across another part, if there is one.
fn under(join: u32, across: u32) -> Turn {
    let start = get_turn(unders_at() + join, sizes.joins);
    if across == NONE {
        return start;
    }
    return then(start, get_across(across));
}

// How the body is turned that carries a path.
fn carried(slot: u32) -> Turn {
    let placed = get_placed(slot);
    return Turn(placed.rotation, placed.spin, fetch(carriers_at() + slot).xyz);
}

// What a chunk hangs from.
fn under_chunk(chunk: u32) -> Turn {
    let join = chunk_word(chunk, UNDER);
    if join != NONE {
        return under(join, chunk_word(chunk, ACROSS));
    }
    if (chunk_word(chunk, ENDS) & FROM_CARRIER) != 0u {
        return carried(chunk_word(chunk, INBOARD));
    }
    return no_turn();
}

// Places the bodies of a chunk.
fn place_chunk(chunk: u32) {
    let slots = slots_of(chunk);
    var parent = under_chunk(chunk);
    var next = given_of(slot_at(slots, 0u));
    var ahead = slot_ahead(slots, 1u);
    for (var place = 0u; place < slots.length; place++) {
        let given = next;
        next = given_of(ahead);
        ahead = slot_ahead(slots, place + 2u);
        let slot = given.spot.slot;
        let flags = given.spot.flags;
        let kind = kind_of(flags);
        let joint = local(given);
        let rotation = turned_by(parent.rotation, joint.rotation);
        let offset = quaternion_turned(parent.rotation, joint.offset);
        let velocity = Motion(
            quaternion_turned(rotation, joint.velocity.angular),
            quaternion_turned(rotation, joint.velocity.linear),
        );
        let c = velocity_product(kind, parent.spin, offset, velocity);
        let placed = Placed(rotation, parent.spin + velocity.angular, offset, c);
        put_placed(slot, placed);
        let origin = parent.position + offset;
        write_pose(slot, rotation, origin);
        parent = Turn(
            rotation,
            placed.spin,
            origin + quaternion_turned(rotation, arm_of(slot, flags)),
        );
        if (flags & CARRIES) != 0u {
            put(carriers_at() + slot, vec4<real>(parent.position, 0.0));
        }
    }
}
