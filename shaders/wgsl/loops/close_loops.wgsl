// The forces of loops worked into accelerations, or positions and then rates put back on the loops; loops/mod.rs
// and loops/closing.rs of the dynamics say how. All three solve for what is left with the same factors: those of
// the accelerations, made anew where positions gain too little from them.

const LANES = 64u;

// What is put right.
const ACCELERATIONS = 0u;
const POSITIONS = 1u;
const RATES = 2u;

const ITERATIONS = 20u;
const PROJECTIONS = 12u;
// How often factors are made anew, and rounds of all kinds.
const RENEWALS = 30u;
const ROUNDS = 512u;

// Bits of `layer.sweep`: half of the forces that go with the rates act; a step starts, which it does not from loops
// that are further open than LARGEST_START.
const HALF_TURNING = 1u;
const STARTS = 2u;
const LARGEST_START: real = 1e-2;

const LARGEST_PROXIMAL: real = 1e-2;
const LARGEST_MOVE: real = 0.5;
// Stands for what is not finite.
const INFINITE: real = 1e30;

var<workgroup> halted: u32;
var<workgroup> found: array<real, LANES>;

// The largest of all lanes' numbers, the same to each.
fn largest_of(lane: u32, value: real) -> real {
    let size = abs(value);
    found[lane] = select(INFINITE, size, is_finite(size) && size < INFINITE);
    workgroupBarrier();
    for (var step = 0u; step < 6u; step++) {
        let half = LANES >> (step + 1u);
        if lane < half {
            found[lane] = max(found[lane], found[lane + half]);
        }
        workgroupBarrier();
    }
    return workgroupUniformLoad(&found[0]);
}

// The larger of two sizes, keeping what is not a number.
fn larger(most: real, value: real) -> real {
    let size = abs(value);
    return select(size, most, size <= most);
}

// What is left of the positions of a lane's rows, over their sizes.
fn left_of_positions(g: Group, lane: u32) -> real {
    var most: real = 0.0;
    let passes = passes_for(g.rows);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            most = larger(most, number(row_memory(g, r) + VALUE) / size_of(row_at(g, r)));
        }
    }
    return most;
}

// The product of a row of J with numbers of `state`, one for each freedom.
fn along_row(g: Group, r: u32, start: u32) -> real {
    let row = row_at(g, r);
    let c = constraint_at(row.constraint);
    var sum: real = 0.0;
    for (var i = 0u; i < c.entries; i++) {
        sum += number(row.jacobian + i) * real(state[start + dof_number(g, c, i)]);
    }
    return sum;
}

// What a lane's rows ask for, scaled, to be solved; gives the largest.
fn ask(g: Group, lane: u32, mode: u32) -> real {
    var most: real = 0.0;
    let passes = passes_for(g.rows);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            let at = row_memory(g, r);
            var left: real = number(at + VALUE);
            if mode == RATES {
                left = along_row(g, r, work_qd());
            } else if mode == ACCELERATIONS {
                left = number(at + SECOND_RATE);
                if (layer.sweep & HALF_TURNING) != 0u {
                    left = 0.5 * (left + along_row(g, r, accelerations_at()));
                }
            }
            left *= -number(at + SCALE);
            multipliers[r] = left;
            most = larger(most, left);
        }
    }
    return most;
}

// The largest of a lane's row scales.
fn scales_of(g: Group, lane: u32) -> real {
    var most: real = 0.0;
    let passes = passes_for(g.rows);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            most = larger(most, number(row_memory(g, r) + SCALE));
        }
    }
    return most;
}

// The largest of the numbers that a lane's freedoms have: of `state`, or what has been solved for.
fn freedoms_have(g: Group, lane: u32, start: u32, is_solved: bool) -> real {
    var most: real = 0.0;
    let passes = passes_for(g.dofs);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let dof = pass_ * LANES + lane;
        if dof < g.dofs {
            var value: real = 0.0;
            if is_solved {
                value = number(freedom_memory(g, dof) + SOLVED);
            } else {
                value = real(state[start + words[g.dofs_at + 3u * dof]]);
            }
            most = larger(most, value);
        }
    }
    return most;
}

// What rounding may leave of positions.
fn rounding_of(g: Group) -> real { return 8.0 * EPSILON * real(f32(4u + g.most)); }

// Takes back what an attempt before has made of the state that is worked on.
fn begin_again(g: Group, lane: u32) {
    let passes = passes_for(g.bodies);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let body = pass_ * LANES + lane;
        if body < g.bodies {
            copy_joint(member_at(g, body).spot, false);
        }
    }
    storageBarrier();
}

fn apply(g: Group, lane: u32, mode: u32, part: real) {
    let passes = passes_for(g.bodies);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let body = pass_ * LANES + lane;
        if body < g.bodies {
            if mode == POSITIONS {
                move_member(g, body, part);
            } else {
                add_solved(g, body, select(work_qd(), accelerations_at(), mode == ACCELERATIONS));
            }
        }
    }
    storageBarrier();
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = id.y * groups.x + id.x;
    if index >= layer.count || !is_group_needed(lane) {
        return;
    }
    if lane == 0u {
        halted = control[HALTED];
    }
    if workgroupUniformLoad(&halted) != 0u {
        return;
    }
    let g = group_at(words[layer.starts + index]);
    fetch_numbers(g, lane);
    if !is_first_attempt() {
        begin_again(g, lane);
    }
    let own_slot = words[g.bodies_at];
    var mode = layer.ways;
    var last = INFINITE;
    var iteration = 0u;
    var attempt = 0u;
    var proximal = PROXIMAL;
    var rounding = rounding_of(g);
    var is_done = false;
    var is_stale = false;
    var has_overflowed = false;
    var energy: real = 0.0;
    for (var round_ = 0u; round_ < ROUNDS; round_++) {
        place_members(g, lane);
        if layer.ways == POSITIONS && round_ == 0u {
            energy = energy_of(g, lane);
        }
        evaluate_rows(g, lane);
        var renews = is_stale || (mode == ACCELERATIONS && round_ == 0u);
        is_stale = false;
        if renews && (layer.sweep & STARTS) != 0u {
            if largest_of(lane, left_of_positions(g, lane)) > LARGEST_START {
                break;
            }
        }
        if mode == POSITIONS {
            let violation = largest_of(lane, left_of_positions(g, lane));
            let gained: bool = violation < 0.5 * last;
            let accepted = select(ACCEPTED, ACCEPTED_STALE, attempt == 0u);
            if violation <= rounding || (!gained && violation <= accepted) {
                mode = RATES;
                last = INFINITE;
                iteration = 0u;
            } else if !gained || iteration == PROJECTIONS {
                attempt += 1u;
                if attempt == RENEWALS || violation >= INFINITE {
                    break;
                }
                // Far from closed, steps are shortened in the directions that give little.
                proximal = clamp(violation * violation, PROXIMAL, LARGEST_PROXIMAL);
                renews = true;
                iteration = 0u;
                last = violation;
            } else {
                last = violation;
            }
        }
        if renews {
            factor(g, lane, proximal);
        }
        let left = largest_of(lane, ask(g, lane, mode));
        if mode == ACCELERATIONS && iteration == 0u {
            rounding = EPSILON * left;
        }
        if mode == RATES {
            let speed: real = largest_of(lane, freedoms_have(g, lane, work_qd(), false))
                * largest_of(lane, scales_of(g, lane));
            rounding = 4.0 * EPSILON * speed;
            // Where the step's factors leave too much, it is begun again with new ones.
            is_stale = attempt == 0u && left > ACCEPTED * speed
                && (left >= 0.5 * last || iteration == PROJECTIONS);
        }
        if is_stale {
            mode = POSITIONS;
            attempt = 1u;
            rounding = rounding_of(g);
            last = INFINITE;
            iteration = 0u;
            continue;
        }
        if mode != POSITIONS {
            let most = select(PROJECTIONS, ITERATIONS, mode == ACCELERATIONS);
            is_done = left <= rounding || left >= 0.5 * last || iteration == most;
            // Otherwise the first iteration would end here, with the loops left open.
            has_overflowed = has_overflowed || left >= 0.5 * INFINITE;
            if is_done {
                break;
            }
            last = left;
        }
        solve_matrix(g, lane);
        add_forces(g, lane);
        substitute(g, lane);
        var part: real = 1.0;
        if mode == POSITIONS {
            let farthest = largest_of(lane, freedoms_have(g, lane, 0u, true));
            part = min(real(1.0), LARGEST_MOVE / max(farthest, LARGEST_MOVE));
        }
        apply(g, lane, mode, part);
        iteration += 1u;
    }
    keep_numbers(g, lane);
    var loop_work: real = 0.0;
    if layer.ways == POSITIONS {
        account(g, lane);
        place_members(g, lane);
        loop_work = energy_of(g, lane) - energy;
    } else if (layer.sweep & HALF_TURNING) != 0u {
        loop_work = work_of_forces(g, lane);
    }
    let start = select(work_qd(), accelerations_at(), layer.ways == ACCELERATIONS);
    let most = largest_of(lane, freedoms_have(g, lane, start, false));
    if lane == 0u {
        if layer.ways == POSITIONS || (layer.sweep & STARTS) != 0u {
            put_loop_work(g, loop_work, layer.ways != POSITIONS);
        }
        if !is_done {
            fail(OPEN, own_slot);
        }
        if most >= INFINITE || has_overflowed {
            fail(OVERFLOW, own_slot);
        }
    }
}
