// A chunk in a correction: what changes of rakes' bias forces change of its own. Nothing else does.

// Of a rake, about its carrier's handle.
fn added_by(rake: u32) -> Force {
    let added = fetch_two(added_at() + rake, sizes.rakes);
    let head = words[sizes.rake_words + rake];
    if head == NONE {
        return added;
    }
    return force_shifted_back(added, get_placed(head).offset);
}

fn resum_rakes(sum: u32) {
    let at = sizes.sum_words + 3u * sum;
    put_added(words[at + 2u], force_add(added_by(words[at]), added_by(words[at + 1u])));
}

// Of all that is raked onto a body.
fn added_onto(slot: u32, flags: u32, share: real) -> Force {
    var sum = force_zero();
    if (flags & CARRIES) != 0u {
        for (var i = 0u; i < 2u; i++) {
            let rake = rake_onto(slot, i);
            if rake != NONE {
                sum = force_add(sum, added_by(rake));
            }
        }
    }
    return force_scaled(sum, share);
}

// A change of the bias force and of the tip's acceleration.
struct Change {
    bias: Force,
    drift: Force,
}

fn let_one_go_again(change: Change, s: Motion, v: u32) -> Change {
    let at = freedoms_at() + v;
    let record = get4(at, sizes.dofs);
    let rest = fetch(at + 3u * sizes.dofs);
    let drive: real = -motion_dot(s, change.bias);
    let response: real = drive * rest.y;
    put(at + 3u * sizes.dofs, vec4<real>(rest.x + drive, rest.yzw));
    return Change(
        force_add(change.bias, force_scaled(Force(record.a, record.b), response)),
        force_add(change.drift, force_scaled(Force(record.c, record.d), response)),
    );
}

fn let_go_again(change: Change, spot: Spot, axes: mat3x3<real>) -> Change {
    switch kind_of(spot.flags) {
        case REVOLUTE, SCREW: {
            return let_one_go_again(change, turning_axis(spot.slot, axes[2]), spot.v);
        }
        case PRISMATIC: {
            return let_one_go_again(change, Motion(zero3(), axes[2]), spot.v);
        }
        case SPHERICAL: { return let_turning_go_again(change, spot.v); }
        case FREE: { return let_all_go_again(change, spot.v); }
        default: { return change; }
    }
}

fn reassemble_chunk(chunk: u32) {
    let slots = slots_of(chunk);
    let ends = chunk_word(chunk, ENDS);
    let cut = chunk_word(chunk, INBOARD);
    let inner = chunk_word(chunk, INNER);
    let leaf = chunk_word(chunk, LEAF);
    let rake = chunk_word(chunk, RAKE);
    let index = chunk_word(chunk, NODE);
    let is_inner = (ends & FROM_CUT) != 0u;
    let last_share: real = select(real(1.0), real(0.5), (ends & IS_HALVED) != 0u);
    var length = slots.length;
    if (ends & TO_LEAF) != 0u {
        length -= 1u;
    }
    var change = Change(force_zero(), force_zero());
    for (var i = 0u; i < length; i++) {
        let place = length - 1u - i;
        let spot = spot_of(slot_at(slots, place));
        let placed = get_placed(spot.slot);
        let axes = quaternion_matrix(placed.rotation);
        let share: real = select(real(1.0), last_share, place + 1u == slots.length);
        change.bias = force_add(change.bias, added_onto(spot.slot, spot.flags, share));
        change.bias = force_shifted_back(change.bias, axes * arm_of(spot.slot, spot.flags));
        change = let_go_again(change, spot, axes);
        if is_inner || place > 0u {
            change.bias = force_shifted_back(change.bias, placed.offset);
        }
    }
    if is_inner {
        let onto: Force = added_onto(cut, flags_of(cut), 0.5);
        var inverse = get_inverse(inner);
        let y = lower6(inverse.factor, force_add(change.bias, onto));
        inverse.bias = force_add(inverse.bias, y);
        put_inverse(inner, inverse);
        change.bias = force_scaled(upper6(inverse.factor, y), -1.0);
        change.drift = force_sub(change.drift, matrix6_transpose_mul(inverse.far, y));
    }
    if (ends & TO_LEAF) != 0u {
        change = with_leaf_again(!is_inner, change, slot_at(slots, length), last_share, leaf);
    }
    if index != NONE {
        let at = change_at(index);
        let b1 = change.bias;
        let b2 = change.drift;
        tree_put_vectors(at, b1.angular, b1.linear, b2.angular, b2.linear);
        if rake != NONE {
            let to = head_at(rake) + 15u * sizes.path_rakes;
            put_two(to, sizes.path_rakes, force_add(fetch_two(to, sizes.path_rakes), b1));
        }
    } else if rake != NONE {
        put_added(rake, change.bias);
    }
}
