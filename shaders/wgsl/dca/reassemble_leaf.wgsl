// A leaf in a correction.

fn with_leaf_again(is_head: bool, change: Change, slot: u32, share: real, index: u32) -> Change {
    let flags = flags_of(slot);
    let axes = quaternion_matrix(get_placed(slot).rotation);
    let arm = axes * arm_of(slot, flags);
    var leaf = get_leaf(index);
    let own = lower6(leaf.own, added_onto(slot, flags, share));
    let center: Force = force_scaled(upper6(leaf.own, own), -1.0);
    let across = motion_shifted(Motion(center.angular, center.linear), -arm);
    let apart = force_sub(change.drift, Force(across.angular, across.linear));
    let kind = kind_of(flags);
    let mask = mask_of(kind, drive_of(slot, kind));
    let y = lower6(leaf.joined.factor, force_projected(apart, axes, pitch_of(slot), mask));
    let sign: real = select(real(-1.0), real(1.0), is_head);
    leaf.joined.bias = force_add(leaf.joined.bias, y);
    put_leaf(index, leaf.own, force_add(leaf.own_bias, own), leaf.joined);
    return Change(
        force_add(change.bias, force_scaled(matrix6_transpose_mul(leaf.joined.inboard, y), sign)),
        force_add(center, matrix6_transpose_mul(leaf.joined.outboard, y)),
    );
}
