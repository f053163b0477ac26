// What acts in the joints of a group: inertia of freedoms' own, as the solution had it, of D = S'U + E; and the work of a
// step.

fn own_inertia(spot: Spot, k: u32) -> real {
    switch kind_of(spot.flags) {
        case REVOLUTE, PRISMATIC, SCREW: { return own_kept(spot.v, 0u); }
        case SPHERICAL: { return turning_moment(spot.slot, spot.v, k); }
        case FREE: { return given_number(OWN, spot.v + k); }
        default: { return 0.0; }
    }
}

// Whether a joint that would let go of all it turns, or of all, does not.
fn has_own_inertia(spot: Spot) -> bool {
    let kind = kind_of(spot.flags);
    if kind != SPHERICAL && kind != FREE {
        return false;
    }
    var sum: real = 0.0;
    let freedoms = freedoms_of(kind);
    for (var k = 0u; k < freedoms; k++) {
        sum += own_inertia(spot, k);
    }
    return sum > 0.0;
}

// Work that rates do which have been put right since the step was taken.
fn account(g: Group, lane: u32) {
    let passes = passes_for(g.bodies);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let body = pass_ * LANES + lane;
        if body < g.bodies {
            let spot = member_at(g, body).spot;
            let kind = kind_of(spot.flags);
            let begun = begun_at(spot);
            let before = rates_before(spot.v, kind, begun);
            let rates = joint_motion(work_qd() + spot.v, kind);
            if layer.attempt == 0u {
                settle_between(spot.slot, kind, begun, before, rates);
            } else {
                work(spot.slot, kind, begun, before, rates);
            }
        }
    }
}

// qd' E qd / 2: loops are put back in the metric of this inertia too.
fn own_energy(spot: Spot) -> real {
    let v = work_qd() + spot.v;
    switch kind_of(spot.flags) {
        case REVOLUTE, PRISMATIC, SCREW: {
            let rate: real = real(state[v]);
            return 0.5 * own_kept(spot.v, 0u) * rate * rate;
        }
        case SPHERICAL: {
            let w = state3(v);
            return 0.5 * dot(w, moments_times(moments_kept(spot.v), w));
        }
        case FREE: {
            var sum: real = 0.0;
            for (var k = 0u; k < 6u; k++) {
                let rate: real = real(state[v + k]);
                sum += 0.5 * given_number(OWN, spot.v + k) * rate * rate;
            }
            return sum;
        }
        default: { return 0.0; }
    }
}
