// Accelerations are all that is asked for.
fn advance(slot: u32, kind: u32, qdd: Motion, begun: Begun) {
    put_joint_motion(accelerations_at() + dof_of(slot), kind, qdd);
}
