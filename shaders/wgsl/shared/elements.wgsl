// What acts in a joint of one freedom, in the model's units; elements/law.rs and freedom.rs of the dynamics have
// the formulas. A step takes it as a joint force and an inertia of the freedom's own.

// Rounding of the solutions on which laws are followed, and by what a hard stop exceeds the inertia of what it stops.
override SOLVED_TO: f32 = 0.0;
override FIRMNESS: f32 = 1.0;

// Rates below which dry friction holds, and at which a joint is brought back into its range.
const SLIP: real = 1e-5;
const RECOVERY: real = 1.0;
// Stands for a bound where there is none.
const BOUNDLESS: real = 1e37;

const SOFT: u32 = 1u;
const HARD: u32 = 2u;

// A range, about the inertia that is stopped at its ends, and how.
struct Stopped {
    lower: real,
    upper: real,
    moved: real,
    // Of a soft stop stiffness and damping, of a hard one restitution.
    stop: vec2<real>,
    kind: u32,
}

struct Elements {
    // Spring, damper and rotor.
    stiffness: real,
    rest: real,
    damping: real,
    armature: real,
    friction: real,
    range: Stopped,
    // Motor: its force at position and rate zero of a joint that strives for zero, gains, and what it strives for.
    push: real,
    position: real,
    gain: real,
    damper: real,
    limit: real,
}

// A joint at the start of a step of length h; of no length for forces as they are now.
struct Moment {
    q: real,
    qd: real,
    h: real,
}

// f(v) = at - slope v, but at least `least` and at most `most`.
struct Law {
    at: real,
    slope: real,
    least: real,
    most: real,
}

// Which part of a law is in force.
const SLOPE: u32 = 0u;
const LEAST: u32 = 1u;
const MOST: u32 = 2u;

// Where the parts of laws are in a word of them: of motor, friction and stop, and the part of the stop's law in
// which it does nothing.
const MOTOR_PART: u32 = 0u;
const FRICTION_PART: u32 = 2u;
const STOP_PART: u32 = 4u;
const OPEN_PART: u32 = 6u;

struct Laws {
    motor: Law,
    friction: Law,
    stop: Law,
    // The part of the stop's law in which it does nothing.
    open: u32,
}

fn part_at(parts: u32, place: u32) -> u32 { return (parts >> place) & 3u; }

fn no_law() -> Law { return Law(0.0, 0.0, 0.0, 0.0); }

fn law_force(law: Law, v: real) -> real {
    return max(min(law.at - law.slope * v, law.most), law.least);
}

// The part to be taken next if `part` led to a rate that is known to `tolerance`.
fn law_next(law: Law, part: u32, v: real, tolerance: real) -> u32 {
    let slack: real = law.slope * tolerance;
    let force: real = law.at - law.slope * v;
    if part == SLOPE {
        if force > law.most + slack {
            return MOST;
        }
        if force < law.least - slack {
            return LEAST;
        }
    } else if (part == MOST && force < law.most) || (part == LEAST && force > law.least) {
        return SLOPE;
    }
    return part;
}

// Joint force and inertia that a part makes of a step.
fn law_load(law: Law, part: u32, now: Moment) -> vec2<real> {
    if part == SLOPE {
        return vec2<real>(law.at - law.slope * now.qd, now.h * law.slope);
    }
    return vec2<real>(select(law.most, law.least, part == LEAST), 0.0);
}

// The force of a part at the rate at the end of the step.
fn law_exerted(law: Law, part: u32, v: real) -> real {
    if part == SLOPE {
        return law.at - law.slope * v;
    }
    return select(law.most, law.least, part == LEAST);
}

fn motor_law(e: Elements, now: Moment) -> Law {
    return Law(
        e.push + e.gain * (e.position - now.q),
        e.damper + now.h * e.gain,
        -e.limit,
        e.limit,
    );
}

fn friction_law(e: Elements) -> Law {
    return Law(0.0, e.friction / SLIP, -e.friction, e.friction);
}

struct Stop {
    law: Law,
    open: u32,
}

fn stop_law(e: Stopped, now: Moment) -> Stop {
    if e.kind == 0u || (e.kind == HARD && now.h == 0.0) {
        return Stop(no_law(), SLOPE);
    }
    let is_upper = e.upper - now.q <= now.q - e.lower;
    let gap: real = select(now.q - e.lower, e.upper - now.q, is_upper);
    let sign: real = select(real(-1.0), real(1.0), is_upper);
    let toward: real = sign * now.qd;
    var law: Law;
    if e.kind == SOFT {
        let is_beyond: bool = gap <= now.h * toward || gap <= 0.0;
        law.at = sign * e.stop.x * gap;
        law.slope = select(real(0.0), e.stop.y, is_beyond) + now.h * e.stop.x;
    } else {
        let reach: real = max(gap / now.h, -RECOVERY);
        var bound: real = reach;
        if e.stop.x > 0.0 && toward > reach {
            bound = min(reach, -e.stop.x * toward);
        }
        law.slope = real(FIRMNESS) * e.moved / now.h;
        law.at = sign * law.slope * bound;
    }
    law.least = -BOUNDLESS;
    law.most = BOUNDLESS;
    // A range without width holds from both sides.
    if e.upper == e.lower {
        return Stop(law, SLOPE);
    }
    if is_upper {
        law.most = 0.0;
        return Stop(law, MOST);
    }
    law.least = 0.0;
    return Stop(law, LEAST);
}

fn laws_of(e: Elements, now: Moment) -> Laws {
    let stop = stop_law(e.range, now);
    return Laws(motor_law(e, now), friction_law(e), stop.law, stop.open);
}

// The parts that a step starts with: a stop that held goes on holding, unless the other bound is nearer now, and
// a motor that has no limit any more is on none.
fn parts_begun(laws: Laws, parts: u32) -> u32 {
    let holds = part_at(parts, STOP_PART) == SLOPE && part_at(parts, OPEN_PART) == laws.open;
    var kept = parts & 15u;
    if laws.motor.most >= BOUNDLESS {
        kept &= 12u;
    }
    return kept | (select(laws.open, SLOPE, holds) << STOP_PART) | (laws.open << OPEN_PART);
}

// The parts that a rate at the end of the step asks for.
fn parts_followed(laws: Laws, parts: u32, v: real, tolerance: real) -> u32 {
    let motor = law_next(laws.motor, part_at(parts, MOTOR_PART), v, tolerance);
    let friction = law_next(laws.friction, part_at(parts, FRICTION_PART), v, tolerance);
    let stop = law_next(laws.stop, part_at(parts, STOP_PART), v, tolerance);
    return (motor << MOTOR_PART) | (friction << FRICTION_PART) | (stop << STOP_PART)
        | (parts & (3u << OPEN_PART));
}

// To what the rate at the end of a step is known, which changes it by `change`.
fn rate_tolerance(qd: real, change: real) -> real {
    return 4.0 * real(SOLVED_TO) * (abs(qd) + abs(change));
}

// Joint force and inertia of a step.
fn elements_load(e: Elements, laws: Laws, parts: u32, now: Moment) -> vec2<real> {
    let load: vec2<real> = vec2<real>(
        -e.stiffness * (now.q + now.h * now.qd - e.rest) - e.damping * now.qd,
        e.armature + now.h * (e.damping + now.h * e.stiffness),
    );
    if now.h == 0.0 {
        let forces: real = law_force(laws.motor, now.qd) + law_force(laws.friction, now.qd)
            + law_force(laws.stop, now.qd);
        return load + vec2<real>(forces, 0.0);
    }
    return load + law_load(laws.motor, part_at(parts, MOTOR_PART), now)
        + law_load(laws.friction, part_at(parts, FRICTION_PART), now)
        + law_load(laws.stop, part_at(parts, STOP_PART), now);
}

// Work of motors, springs, dampers, friction and stops.
struct Works {
    motors: real,
    springs: real,
    dampers: real,
    friction: real,
    stops: real,
}

// Of a step that ended with the rate v: forces at its end over the way that the mean rate makes.
fn works_of_step(e: Elements, laws: Laws, parts: u32, now: Moment, v: real) -> Works {
    let way: real = 0.5 * now.h * (now.qd + v);
    return Works(
        law_exerted(laws.motor, part_at(parts, MOTOR_PART), v) * way,
        -e.stiffness * (now.q + now.h * v - e.rest) * way,
        -e.damping * v * way,
        law_exerted(laws.friction, part_at(parts, FRICTION_PART), v) * way,
        law_exerted(laws.stop, part_at(parts, STOP_PART), v) * way,
    );
}

// Of a step between two states that took forces as they were: their mean over the way.
fn works_between(e: Elements, start: Moment, end: Moment) -> Works {
    let way: real = 0.5 * (end.q - start.q);
    let a = laws_of(e, start);
    let b = laws_of(e, end);
    return Works(
        (law_force(a.motor, start.qd) + law_force(b.motor, end.qd)) * way,
        -e.stiffness * ((start.q - e.rest) + (end.q - e.rest)) * way,
        -e.damping * (start.qd + end.qd) * way,
        0.0,
        (law_force(a.stop, start.qd) + law_force(b.stop, end.qd)) * way,
    );
}

// Elements of a spherical joint that are the same in all directions and have no bounds.
struct Ball {
    rest: vec4<real>,
    stiffness: real,
    damping: real,
    armature: real,
}

// The rotation vector from one orientation to another, in the latter's axes.
fn turned_off(rest: vec4<real>, q: vec4<real>) -> vec3<real> {
    let back = vec4<real>(-rest.xyz, rest.w);
    return quaternion_log(quaternion_normalized(quaternion_product(back, q)));
}

fn ball_off(ball: Ball, q: vec4<real>) -> vec3<real> { return turned_off(ball.rest, q); }

fn ball_force(ball: Ball, off: vec3<real>, w: vec3<real>, h: real) -> vec3<real> {
    return -((off + w * h) * ball.stiffness + w * ball.damping);
}

fn ball_inertia(ball: Ball, h: real) -> real {
    return ball.armature + h * (ball.damping + h * ball.stiffness);
}

// Of an implicit step from `before` to `w`, that started `off` from the rest.
fn ball_works_of_step(ball: Ball, off: vec3<real>, before: vec3<real>, w: vec3<real>, h: real) -> Works {
    let way: vec3<real> = (before + w) * (0.5 * h);
    return Works(
        0.0,
        -ball.stiffness * dot(off + w * h, way),
        -ball.damping * dot(w, way),
        0.0,
        0.0,
    );
}

fn ball_works_between(
    ball: Ball,
    offs: vec3<real>,
    before: vec3<real>,
    w: vec3<real>,
    h: real,
) -> Works {
    let way: vec3<real> = (before + w) * (0.5 * h);
    return Works(
        0.0,
        -0.5 * ball.stiffness * dot(offs, way),
        -0.5 * ball.damping * dot(before + w, way),
        0.0,
        0.0,
    );
}
