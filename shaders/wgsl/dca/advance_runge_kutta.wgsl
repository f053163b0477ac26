// A stage of the classical Runge-Kutta method, on the rotation group: u' = dexp^-1(u) w, qd' = qdd.

fn advance(slot: u32, kind: u32, qdd: Motion, begun: Begun) {
    let v = dof_of(slot);
    let n = sizes.dofs;
    let displacements = accelerations_at() + n;
    let rate_sums = displacements + n;
    let acceleration_sums = rate_sums + n;
    put_joint_motion(accelerations_at() + v, kind, qdd);
    let h: real = real(forces[STEP_SIZE]);
    let start = rates_before(v, kind, begun);

    // The rate of the displacement u at which this stage stands.
    var rate = to_displacement_axes(
        kind,
        work_q() + position_of(slot),
        joint_motion(work_qd() + v, kind),
    );
    var rate_sum = rate;
    var acceleration_sum = qdd;
    if layer.stage > 0u {
        if kind == SPHERICAL || kind == FREE {
            let u = joint_motion(displacements + v, kind);
            rate.angular = rotation_vector_rate(u.angular, rate.angular);
        }
        let weight: real = select(real(2.0), real(1.0), layer.stage == 3u);
        rate_sum = motion_add(
            joint_motion(rate_sums + v, kind),
            motion_scaled(rate, weight),
        );
        acceleration_sum = motion_add(
            joint_motion(acceleration_sums + v, kind),
            motion_scaled(qdd, weight),
        );
    }
    if layer.stage == 3u {
        let sixth: real = h / 6.0;
        let u = motion_scaled(rate_sum, sixth);
        let rates = motion_add(start, motion_scaled(acceleration_sum, sixth));
        put_moved(slot, kind, u, rates, begun);
        settle_between(slot, kind, begun, start, rates);
        return;
    }
    put_joint_motion(rate_sums + v, kind, rate_sum);
    put_joint_motion(acceleration_sums + v, kind, acceleration_sum);
    let ahead: real = select(0.5 * h, h, layer.stage == 2u);
    let u = motion_scaled(rate, ahead);
    put_joint_motion(displacements + v, kind, u);
    put_moved(slot, kind, u, motion_add(start, motion_scaled(qdd, ahead)), begun);
}
