// What acts in spherical joints of models in which some have ranges, friction or motors, a lane a joint: between the
// solutions of a step, because kernels that solve have no registers left for it.

const LANES = 64u;

// Bits of `layer.ways`: forces and inertia for the solution that comes; the parts of laws that the last one asks for;
// the work of a step.
const LOADS = 1u;
const FOLLOWS = 2u;
const ACCOUNTS = 4u;

// Rows of numbers by slots, behind those of all elements: the axis of a cone and the largest swing or turn; the range
// of twists, about the inertia that is moved, and what has ranges: nothing (0), the swing (1), or one
// of these.
const CONE_ROW = 3u;
const TWIST_ROW = 4u;
const CONE_AND_TWIST: real = 2.0;
const WHOLE: real = 3.0;

// Behind what all elements are given, what E is given off its diagonal: xy, xz and yz in the places of three freedoms.
const OWN_ACROSS: u32 = 7u;

// Where the parts of both bounds are in a word of them, and that what is known of the joint is no longer nothing.
const FIRST_BOUND = 0u;
const SECOND_BOUND = 4u;
const KNOWN: u32 = 256u;

struct Laws3 {
    drives: Round,
    rubs: Round,
    first: Bound,
    second: Bound,
}

// From the rest of its spring; nothing where there is none.
fn off_from_rest(ball: Ball, q: vec4<real>) -> vec3<real> {
    if ball.stiffness == 0.0 {
        return zero3();
    }
    return ball_off(ball, q);
}

// Of an orientation and rates at the start of a step of this length; of no length for forces as they are.
fn laws_of_ball(spot: Spot, q: vec4<real>, w: vec3<real>, h: real) -> Laws3 {
    let v = spot.v;
    let gain = given_number(GAIN, v + 1u);
    let damper = given_number(DAMPER, v);
    var at = given_numbers3(PUSH, v);
    if gain != 0.0 {
        let wanted = vec4<real>(given_numbers3(POSITION, v), given_number(GAIN, v));
        at -= turned_off(wanted, q) * gain;
    }
    let drives: Round = Round(at, damper + h * gain, given_number(LIMIT, v));
    let friction = element_row(spot.slot, 0u).y;
    let bound: real = select(BOUNDLESS, friction, friction > 0.0);
    let rubs: Round = Round(zero3(), friction / SLIP, bound);
    let stop = element_row(spot.slot, 2u);
    let cone = element_row(spot.slot, CONE_ROW);
    let twist = element_row(spot.slot, TWIST_ROW);
    let kind = u32(i32(stop.z));
    var first = no_bound();
    var second = no_bound();
    if twist.w != 0.0 {
        let range: Stopped = Stopped(-BOUNDLESS, cone.w, twist.z, stop.xy, kind);
        first = bound_of(select(SWING, TURN, twist.w == WHOLE), cone.xyz, range, q, w, h);
    }
    if twist.w == CONE_AND_TWIST {
        let range: Stopped = Stopped(twist.x, twist.y, twist.z, stop.xy, kind);
        second = bound_of(TWIST, cone.xyz, range, q, w, h);
    }
    return Laws3(drives, rubs, first, second);
}

fn found_in(row: vec4<real>) -> Found { return Found(row.x, row.y, row.zw); }

fn put_found(at: u32, found: Found) {
    put(at, vec4<real>(found.share, found.mobility, found.before));
}

// E = sum of m a a', taking the largest of what is left of its diagonal: so that no entry of an axis is beyond 1. What is
// `alike` about all axes is left of each moment; where rounding of a stop's leaves no more, it is the moment.
fn keep_parted(v: u32, own: Sym3, alike: real) {
    let least: real = 16.0 * EPSILON * sym_trace(own);
    var left: vec3<real> = vec3<real>(1.0, 1.0, 1.0);
    var rest = own;
    for (var k = 0u; k < 3u; k++) {
        let nowhere: vec3<real> = vec3<real>(-BOUNDLESS, -BOUNDLESS, -BOUNDLESS);
        let d: vec3<real> = select(nowhere, rest.diagonal, left > zero3());
        var taken: vec3<real> = vec3<real>(1.0, 0.0, 0.0);
        var moment = d.x;
        if d.y > moment {
            taken = vec3<real>(0.0, 1.0, 0.0);
            moment = d.y;
        }
        if d.z > moment {
            taken = vec3<real>(0.0, 0.0, 1.0);
            moment = d.z;
        }
        left -= taken;
        var axis = taken;
        if moment > least {
            axis += sym_mul(rest, taken) * left * (1.0 / moment);
            rest = sym_sub(rest, sym_outer(axis, moment));
        } else {
            moment = alike;
        }
        put(ball_row(v, k), vec4<real>(axis, moment));
    }
}

fn load_ball(spot: Spot) {
    let v = spot.v;
    let h = step_ahead();
    let q = quaternion_normalized(state4(position_now(spot.q)));
    let w = state3(rate_now(v));
    let laws = laws_of_ball(spot, q, w, h);
    let ball = ball_of(spot.slot);
    let given = given_numbers3(OWN, v);
    let across = given_numbers3(OWN_ACROSS, v);
    let inertia = ball_inertia(ball, h);
    var sum = Pushing(
        joint_forces3(v) + ball_force(ball, off_from_rest(ball, q), w, h),
        Sym3(vec3<real>(inertia, inertia, inertia), zero3()),
    );
    var alike = inertia;
    let row = fetch(ball_row(v, FORCE_ROW));
    var parts = u32(i32(row.w));
    if h == 0.0 {
        sum.force += round_force(laws.drives, w) + round_force(laws.rubs, w);
        sum.force += bound_force(laws.first) + bound_force(laws.second);
    } else {
        var motor = found_in(fetch(ball_row(v, MOTOR_ROW)));
        var friction = found_in(fetch(ball_row(v, FRICTION_ROW)));
        if (layer.ways & FOLLOWS) == 0u {
            if (parts & KNOWN) == 0u {
                let mobility: real = 1.0 / element_row(spot.slot, TWIST_ROW).z;
                motor = Found(1.0, mobility, motor.before);
                friction = motor;
            }
            motor = round_begun(laws.drives, motor);
            friction = round_begun(laws.rubs, friction);
            put_found(ball_row(v, MOTOR_ROW), motor);
            put_found(ball_row(v, FRICTION_ROW), friction);
            parts = bound_begun(laws.first, parts, FIRST_BOUND)
                | bound_begun(laws.second, parts, SECOND_BOUND) | KNOWN;
        }
        sum = with_round(sum, laws.drives, motor.share, w, h);
        sum = with_round(sum, laws.rubs, friction.share, w, h);
        alike = sum.own.diagonal.x;
        sum = with_bound(sum, laws.first, part_at(parts, FIRST_BOUND));
        sum = with_bound(sum, laws.second, part_at(parts, SECOND_BOUND));
    }
    keep_parted(v, sym_add(sum.own, Sym3(given, across.zyx)), alike);
    put(ball_row(v, FORCE_ROW), vec4<real>(sum.force, real(parts)));
}

// Of a step that was implicit in what acts.
fn settle_ball(spot: Spot, before: vec3<real>, after: vec3<real>) {
    let v = spot.v;
    let h = step_ahead();
    let q = quaternion_normalized(state4(spot.q));
    let laws = laws_of_ball(spot, q, before, h);
    let row = fetch(ball_row(v, FORCE_ROW));
    let parts = u32(i32(row.w));
    let motor = found_in(fetch(ball_row(v, MOTOR_ROW)));
    let friction = found_in(fetch(ball_row(v, FRICTION_ROW)));
    if (layer.ways & ACCOUNTS) != 0u {
        let ball = ball_of(spot.slot);
        let way: vec3<real> = (before + after) * (0.5 * h);
        var works = ball_works_of_step(ball, off_from_rest(ball, q), before, after, h);
        works.motors = dot(round_exerted(laws.drives, motor.share, after), way);
        works.friction = dot(round_exerted(laws.rubs, friction.share, after), way);
        works.stops = bound_work(laws.first, part_at(parts, FIRST_BOUND), after, way)
            + bound_work(laws.second, part_at(parts, SECOND_BOUND), after, way);
        put_works(v, works);
    }
    // What has not settled in the last attempt is taken as it is.
    if (layer.ways & FOLLOWS) == 0u || layer.attempt >= MOST_ATTEMPTS || h == 0.0 {
        return;
    }
    let change = length_of(after - before);
    let tolerance: real = rate_tolerance(length_of(before), change);
    let motor_next = round_followed(laws.drives, motor, after, h, tolerance);
    let friction_next = round_followed(laws.rubs, friction, after, h, tolerance);
    let next = bound_followed(laws.first, parts, FIRST_BOUND, after, tolerance)
        | bound_followed(laws.second, parts, SECOND_BOUND, after, tolerance) | KNOWN;
    put_found(ball_row(v, MOTOR_ROW), motor_next);
    put_found(ball_row(v, FRICTION_ROW), friction_next);
    if next != parts || motor_next.share != motor.share || friction_next.share != friction.share {
        put(ball_row(v, FORCE_ROW), vec4<real>(row.xyz, real(next)));
        control[LAST_ASKED] = layer.attempt;
    }
}

// Of a step that took forces as they were: their mean over the way.
fn account_between(spot: Spot, before: vec3<real>, after: vec3<real>) {
    let ball = ball_of(spot.slot);
    let h: real = real(forces[STEP_SIZE]);
    let way: vec3<real> = (before + after) * (0.5 * h);
    var offs = zero3();
    var motors: real = 0.0;
    var stops: real = 0.0;
    for (var end = 0u; end < 2u; end++) {
        let q = quaternion_normalized(state4(select(spot.q, work_q() + spot.q, end == 1u)));
        let w = select(before, after, end == 1u);
        let laws: Laws3 = laws_of_ball(spot, q, w, 0.0);
        offs += off_from_rest(ball, q);
        motors += 0.5 * dot(round_force(laws.drives, w), way);
        stops += 0.5 * dot(bound_force(laws.first) + bound_force(laws.second), way);
    }
    var works = ball_works_between(ball, offs, before, after, h);
    works.motors = motors;
    works.stops = stops;
    put_works(spot.v, works);
}

// Whether what stands in the state that is worked on may be no numbers.
fn has_failed() -> bool { return control[HALTED] != 0u || atomicLoad(&status[0]) != 0u; }

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = (id.y * groups.x + id.x) * LANES + lane;
    if index >= layer.count || !is_needed() {
        return;
    }
    let spot = spot_of(words[layer.starts + index]);
    if layer.ways != LOADS && !has_failed() {
        let before = state3(sizes.positions + spot.v);
        let after = state3(work_qd() + spot.v);
        if layer.attempt == 0u {
            account_between(spot, before, after);
        } else {
            settle_ball(spot, before, after);
        }
    }
    if (layer.ways & LOADS) != 0u {
        load_ball(spot);
    }
}
