// A leaf in a correction: `bias` about its joint, the rest of its chunk gathered in `change`; where that and the leaf
// meet, accelerations differ across the joint's freedoms.

// The acceleration that a leaf's joint hangs from, at the joint.
fn given_to_leaf(chunk: u32, slots: Slots, placed: Placed) -> Motion {
    let ends = chunk_word(chunk, ENDS);
    if slots.length > 1u {
        return motion_shifted(solved(slot_at(slots, slots.length - 2u)), placed.offset);
    }
    if (ends & FROM_CUT) != 0u {
        return motion_shifted(end_at(chunk_word(chunk, BEFORE), OUTBOARD), placed.offset);
    }
    var carrier = NONE;
    if (ends & FROM_CARRIER) != 0u {
        carrier = chunk_word(chunk, INBOARD);
    }
    let a = hanging(slot_at(slots, 0u), carrier);
    return Motion(a.angular, a.linear);
}

fn with_leaf_again(chunk: u32, slots: Slots, change: Change, bias: Force) -> Change {
    let slot = slot_at(slots, slots.length - 1u);
    let index = chunk_word(chunk, LEAF);
    let spot = spot_of(slot);
    let placed = get_placed(slot);
    let axes = quaternion_matrix(placed.rotation);
    let arm = axes * arm_of(slot, spot.flags);
    let kind = kind_of(spot.flags);
    var leaf = get_leaf(index);
    let own = lower6(leaf.own, force_shifted_back(bias, -arm));
    let center: Force = force_scaled(upper6(leaf.own, own), -1.0);
    let across = motion_shifted(Motion(center.angular, center.linear), -arm);
    let qdd = joint_motion(accelerations_at() + spot.v, kind);
    let matched = motion_add(
        motion_add(given_to_leaf(chunk, slots, placed), placed.bias_acceleration),
        across_joint(spot, axes, qdd),
    );
    let differing = motion_sub(motion_sub(matched, solved(slot)), across);
    let apart = force_add(change.drift, Force(differing.angular, differing.linear));
    let mask = mask_of(kind, drive_of(slot, kind));
    let basis = joint_basis(kind, spot.v, axes);
    let y = lower6(leaf.joined.factor, force_projected(apart, basis, pitch_of(slot), mask));
    let is_head = (chunk_word(chunk, ENDS) & FROM_CUT) == 0u;
    let sign: real = select(real(-1.0), real(1.0), is_head);
    leaf.joined.bias = y;
    put_leaf(index, leaf.own, own, leaf.joined);
    return Change(
        change.whole,
        force_add(change.bias, force_scaled(matrix6_transpose_mul(leaf.joined.inboard, y), sign)),
        force_add(center, matrix6_transpose_mul(leaf.joined.outboard, y)),
    );
}
