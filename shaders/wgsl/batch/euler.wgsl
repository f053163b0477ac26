// A semi-implicit Euler step: qd += h qdd, then q += h qd with the new rates.

const STAGES: u32 = 1u;

fn finish_one(slot: u32, link: BatchLink, qdd: real) {
    let row = plan.positions + link.dof;
    let rate: real = state_at(start + row) + time_step() * qdd;
    put(slot, row, rate);
    put(slot, link.position, state_at(start + link.position) + time_step() * rate);
}

fn finish_several(slot: u32, link: BatchLink, qdd: Motion) {
    let row = plan.positions + link.dof;
    let angular = state3(start + row) + qdd.angular * time_step();
    put3(slot, row, angular);
    var linear = zero3();
    if link.kind == FREE {
        linear = state3(start + row + 3u) + qdd.linear * time_step();
        put3(slot, row + 3u, linear);
    }
    displace(slot, link, angular * time_step(), displacement_axes(link, linear) * time_step());
}
