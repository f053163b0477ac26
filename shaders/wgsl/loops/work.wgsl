// What loops do to the energy of a motion; loops/work.rs of the dynamics has the formulas.

// -g
fn upwards() -> vec3<real> {
    return vec3<real>(real(forces[0]), real(forces[1]), real(forces[2]));
}

// The sum of all lanes' numbers, the same to each.
fn sum_of(lane: u32, value: real) -> real {
    workgroupBarrier();
    found[lane] = value;
    workgroupBarrier();
    for (var step = 0u; step < 6u; step++) {
        let half = LANES >> (step + 1u);
        if lane < half {
            found[lane] += found[lane + half];
        }
        workgroupBarrier();
    }
    return workgroupUniformLoad(&found[0]);
}

// Kinetic and potential energy of a group whose bodies are placed.
fn energy_of(g: Group, lane: u32) -> real {
    var sum: real = 0.0;
    let passes = passes_for(g.bodies);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let body = pass_ * LANES + lane;
        if body < g.bodies {
            let p = place_of(g, body);
            let axes = quaternion_matrix(p.rotation);
            let l = mass_of(g, body);
            let moment = axes * l.moment;
            let turning = sym_mul(sym_rotated(l.rotational, axes), p.spin);
            sum += 0.5 * (l.mass * dot(p.velocity, p.velocity) + dot(p.spin, turning));
            sum += dot(p.velocity, cross3(p.spin, moment)) + dot(upwards(), moment);
            sum += l.mass * number(body_memory(g, body) + HEIGHT);
            sum += own_energy(member_at(g, body).spot);
        }
    }
    return sum_of(lane, sum);
}

// Adds what has just been solved for to the forces along rows.
fn add_forces(g: Group, lane: u32) {
    let passes = passes_for(g.rows);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            let at = row_memory(g, r) + FORCE;
            put_number(at, number(at) + multipliers[r]);
        }
    }
}

// Work of these forces over the way that the mean rate of a semi-implicit step makes.
fn work_of_forces(g: Group, lane: u32) -> real {
    let h: real = real(forces[STEP_SIZE]);
    var sum: real = 0.0;
    let passes = passes_for(g.rows);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            let rate: real = along_row(g, r, work_qd())
                + 0.5 * h * along_row(g, r, accelerations_at());
            sum += number(row_memory(g, r) + FORCE) * rate;
        }
    }
    return h * sum_of(lane, sum);
}

// Where a group's sum of work is kept: with its first freedom, behind those of elements.
fn loop_work_at(g: Group) -> u32 {
    return works_at() + (WORKS - 1u) * sizes.dofs + words[g.dofs_at];
}

// The work of a step so far: at its start none, and then more.
fn put_loop_work(g: Group, work: real, is_start: bool) {
    let before = loop_work_at(g);
    let after = before + WORKS * sizes.dofs;
    let sum: real = real(state[select(after, before, is_start)]);
    state[after] = chunk_real(sum + work);
}
