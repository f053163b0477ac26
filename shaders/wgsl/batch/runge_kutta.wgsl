// A step of the classical Runge-Kutta method, on the rotation group by Munthe-Kaas (BIT 38, 1998):
// u' = dexp^-1(u) w, qd' = qdd from u = 0. The state of a stage stands where the step ends. `result` has
// rows of displacements u, of sums of their rates, and of sums of accelerations.

const STAGES: u32 = 4u;

fn work(row: u32) -> real {
    return result[row * plan.stride + item];
}

fn set_work(row: u32, value: real) {
    result[row * plan.stride + item] = value;
}

fn work3(row: u32) -> vec3<real> {
    return vec3<real>(work(row), work(row + 1u), work(row + 2u));
}

// Adds to a sum, which starts with the first stage.
fn summed(row: u32, value: real) -> real {
    var sum: real = value;
    if stage == 1u || stage == 2u {
        sum = 2.0 * value;
    }
    if stage != 0u {
        sum += work(row);
    }
    set_work(row, sum);
    return sum;
}

fn summed3(row: u32, v: vec3<real>) -> vec3<real> {
    return vec3<real>(summed(row, v.x), summed(row + 1u, v.y), summed(row + 2u, v.z));
}

// How far the next stage looks ahead; after the last a sixth of the step, for the sums.
fn ahead() -> real {
    if stage == 2u {
        return time_step();
    }
    if stage == 3u {
        return time_step() * 0.16666666666666666;
    }
    return time_step() * 0.5;
}

fn finish_one(slot: u32, link: BatchLink, qdd: real) {
    let row = plan.positions + link.dof;
    var rate: real = state_at(source + row);
    var acceleration: real = qdd;
    let rate_sum = summed(plan.dofs + link.dof, rate);
    let acceleration_sum = summed(2u * plan.dofs + link.dof, acceleration);
    if stage == 3u {
        rate = rate_sum;
        acceleration = acceleration_sum;
    }
    put(slot, row, state_at(start + row) + ahead() * acceleration);
    put(slot, link.position, state_at(start + link.position) + ahead() * rate);
}

fn finish_several(slot: u32, link: BatchLink, qdd: Motion) {
    let row = plan.positions + link.dof;
    var u = zero3();
    if stage != 0u {
        u = work3(link.dof);
    }
    var rate = Motion(rotation_vector_rate(u, state3(source + row)), zero3());
    var acceleration = qdd;
    let is_free = link.kind == FREE;
    if is_free {
        rate.linear = displacement_axes(link, state3(source + row + 3u));
    }
    let rates_at = plan.dofs + link.dof;
    let accelerations_at = 2u * plan.dofs + link.dof;
    var rate_sum = Motion(summed3(rates_at, rate.angular), zero3());
    var acceleration_sum = Motion(summed3(accelerations_at, qdd.angular), zero3());
    if is_free {
        rate_sum.linear = summed3(rates_at + 3u, rate.linear);
        acceleration_sum.linear = summed3(accelerations_at + 3u, qdd.linear);
    }
    if stage == 3u {
        rate = rate_sum;
        acceleration = acceleration_sum;
    }
    u = rate.angular * ahead();
    set_work(link.dof, u.x);
    set_work(link.dof + 1u, u.y);
    set_work(link.dof + 2u, u.z);
    put3(slot, row, state3(start + row) + acceleration.angular * ahead());
    if is_free {
        put3(slot, row + 3u, state3(start + row + 3u) + acceleration.linear * ahead());
    }
    displace(slot, link, u, rate.linear * ahead());
}
