// qd += h qdd, then q += h qd with the new rates.
fn advance(slot: u32, kind: u32, qdd: Motion, begun: Begun) {
    let v = dof_of(slot);
    put_joint_motion(accelerations_at() + v, kind, qdd);
    let h: real = real(forces[STEP_SIZE]);
    let before = rates_before(v, kind, begun);
    let rates = motion_add(before, motion_scaled(qdd, h));
    let u = to_displacement_axes(kind, position_of(slot), motion_scaled(rates, h));
    settle(slot, kind, begun, before, rates, qdd);
    put_moved(slot, kind, u, rates, begun);
}
