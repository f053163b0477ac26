// What a solution means for the elements: the parts of their laws that it asks for, and the work of the step.

override MOST_ATTEMPTS: u32 = 1u;

fn put_works(v: u32, works: Works) {
    let numbers = array<real, 5>(
        works.motors,
        works.springs,
        works.dampers,
        works.friction,
        works.stops,
    );
    let n = sizes.dofs;
    for (var k = 0u; k < 5u; k++) {
        let sum = works_at() + k * n + v;
        state[sum + WORKS * n] = chunk_real(real(state[sum]) + numbers[k]);
    }
}

fn is_single(kind: u32) -> bool { return kind == REVOLUTE || kind == PRISMATIC || kind == SCREW; }

// Work of a step that is implicit in the elements, from the rates `before` to `rates`.
fn work(slot: u32, kind: u32, begun: Begun, before: Motion, rates: Motion) {
    let v = dof_of(slot);
    let h = step_ahead();
    if is_single(kind) {
        let e = elements_of(slot, v);
        let now = Moment(begun.position, begun.rate, h);
        let parts = parts_in(fetch(last_row(v)));
        put_works(v, works_of_step(e, laws_of(e, now), parts, now, rates.angular.x));
    } else if kind == SPHERICAL {
        work_turning(slot, before.angular, rates.angular);
    }
}

// After such a step.
fn settle(slot: u32, kind: u32, begun: Begun, before: Motion, rates: Motion, qdd: Motion) {
    work(slot, kind, begun, before, rates);
    if is_single(kind) {
        let v = dof_of(slot);
        let h = step_ahead();
        let laws = laws_of(elements_of(slot, v), Moment(begun.position, begun.rate, h));
        let row = fetch(last_row(v));
        let parts = parts_in(row);
        let tolerance = rate_tolerance(begun.rate, h * qdd.angular.x);
        let next = parts_followed(laws, parts, rates.angular.x, tolerance);
        // What has not settled in the last attempt is taken as it is.
        if next != parts && layer.attempt < MOST_ATTEMPTS {
            put(last_row(v), vec4<real>(row.xy, real(next), row.w));
            control[LAST_ASKED] = layer.attempt;
        }
    }
}

// After a step that took them as they were at its stages, to the position that is now worked on.
fn settle_between(slot: u32, kind: u32, begun: Begun, before: Motion, rates: Motion) {
    let v = dof_of(slot);
    let q = position_of(slot);
    if is_single(kind) {
        let end: Moment = Moment(real(state[work_q() + q]), rates.angular.x, 0.0);
        let start: Moment = Moment(begun.position, begun.rate, 0.0);
        put_works(v, works_between(elements_of(slot, v), start, end));
    } else if kind == SPHERICAL {
        work_turning_between(slot, before.angular, rates.angular);
    }
}
