// Laws of a spherical joint with a range, friction or a motor, in the model's units; elements/ball.rs and round.rs of
// the dynamics have the formulas. With `EPSILON` of the precision.

// Shares are taken as found when they change by less than this part of themselves.
const SETTLED: real = 1e-6;
const WHOLE_TURN: real = 6.283185307179586;

// f(v) = share (at - slope v) with a share such that |f| is at most the limit.
struct Round {
    at: vec3<real>,
    slope: real,
    limit: real,
}

// What solutions say of a share.
struct Found {
    share: real,
    // 1 over the inertia that the joint moves.
    mobility: real,
    // Share and |at - slope v| of the solution before, in this step; without one the latter is negative.
    before: vec2<real>,
}

// In scale, because squares of forces may leave the range of f32.
fn length_of(v: vec3<real>) -> real {
    let most: real = max(max(abs(v.x), abs(v.y)), abs(v.z));
    if most == 0.0 {
        return most;
    }
    let scaled: vec3<real> = v * (1.0 / most);
    return most * sqrt(dot(scaled, scaled));
}

fn round_force(law: Round, v: vec3<real>) -> vec3<real> {
    let wanted = law.at - v * law.slope;
    let size = length_of(wanted);
    if size > law.limit {
        return wanted * (law.limit / size);
    }
    return wanted;
}

fn round_exerted(law: Round, share: real, v: vec3<real>) -> vec3<real> {
    return (law.at - v * law.slope) * share;
}

fn round_begun(law: Round, found: Found) -> Found {
    let is_bounded: bool = law.limit < BOUNDLESS;
    return Found(
        select(real(1.0), found.share, is_bounded),
        found.mobility,
        vec2<real>(0.0, -1.0),
    );
}

// The share that a rate at the end of a step asks for, and what it tells of the mobility.
fn round_followed(law: Round, found: Found, v: vec3<real>, h: real, tolerance: real) -> Found {
    if law.limit >= BOUNDLESS {
        return found;
    }
    let share = found.share;
    let size = length_of(law.at - v * law.slope);
    let softness = h * law.slope;
    var mobility = found.mobility;
    if found.before.y >= 0.0 {
        let less: real = found.before.y - size;
        let more: real = (size * share - found.before.y * found.before.x) * softness;
        // Solutions that differ by rounding alone say nothing.
        let is_known = abs(less) > law.slope * tolerance;
        if is_known && ((less > 0.0 && more > 0.0) || (less < 0.0 && more < 0.0)) {
            let quotient: real = less / more;
            if quotient > 0.0 && is_finite(quotient) {
                mobility = quotient;
            }
        }
    }
    let give = softness * mobility;
    let rest: real = size * (1.0 + give * share) - law.limit * give;
    var next: real = 1.0;
    if rest > law.limit {
        next = law.limit / rest;
    }
    let is_another = abs(next - share) * size > (SETTLED * size + law.slope * tolerance) * share;
    return Found(select(share, next, is_another), mobility, vec2<real>(share, size));
}

// Coordinates of an orientation that have ranges: its whole turn, the angle between an axis of the child and the same of
// the parent, and the angle about that axis.
const TURN = 0u;
const SWING = 1u;
const TWIST = 2u;

fn along_or_zero(v: vec3<real>, length: real) -> vec3<real> {
    if length < EPSILON {
        return zero3();
    }
    return v * (1.0 / length);
}

// The gradient of a coordinate, and its value.
fn coordinate_at(coordinate: u32, axis: vec3<real>, q: vec4<real>) -> vec4<real> {
    if coordinate == TURN {
        let r = quaternion_log(q);
        let angle = length_of(r);
        return vec4<real>(along_or_zero(r, angle), angle);
    }
    if coordinate == SWING {
        let back = vec4<real>(-q.xyz, q.w);
        let across = cross3(quaternion_turned(back, axis), axis);
        let sine = length_of(across);
        let angle = unit_angle(sine, dot(quaternion_turned(q, axis), axis));
        return vec4<real>(along_or_zero(across, sine), angle);
    }
    let way: real = select(real(1.0), real(-1.0), q.w < 0.0);
    let u = q.xyz * way;
    let c: real = q.w * way;
    let s: real = dot(axis, u);
    let d = s * s + c * c;
    if d < EPSILON {
        return vec4<real>(0.0, 0.0, 0.0, 0.0);
    }
    let length: real = 1.0 / sqrt(d);
    let angle: real = 2.0 * unit_angle(s * length, c * length);
    let gradient: vec3<real> = (axis * (c * c) + cross3(axis, u) * c + u * s) * (1.0 / d);
    return vec4<real>(gradient, angle);
}

// A coordinate that is kept in its range, as a step starts.
struct Bound {
    gradient: vec3<real>,
    now: Moment,
    stop: Stop,
}

fn no_bound() -> Bound { return Bound(zero3(), Moment(0.0, 0.0, 0.0), Stop(no_law(), SLOPE)); }

fn bound_of(
    coordinate: u32,
    axis: vec3<real>,
    range: Stopped,
    q: vec4<real>,
    w: vec3<real>,
    h: real,
) -> Bound {
    let found = coordinate_at(coordinate, axis, q);
    var value = found.w;
    if coordinate == TWIST {
        // Of angles a whole turn apart the one nearest to the middle of the range.
        let middle: real = 0.5 * (range.lower + range.upper);
        value -= WHOLE_TURN * round((value - middle) / WHOLE_TURN);
    }
    let now: Moment = Moment(value, dot(found.xyz, w), h);
    return Bound(found.xyz, now, stop_law(range, now));
}

// The parts of a bound's law in a word of them: the one it is on, then the one in which it does nothing.
const OPEN_PLACE: u32 = 2u;

fn bound_begun(bound: Bound, parts: u32, place: u32) -> u32 {
    let open = bound.stop.open;
    let holds = part_at(parts, place) == SLOPE && part_at(parts, place + OPEN_PLACE) == open;
    return (select(open, SLOPE, holds) << place) | (open << (place + OPEN_PLACE));
}

fn bound_followed(bound: Bound, parts: u32, place: u32, v: vec3<real>, tolerance: real) -> u32 {
    let g = bound.gradient;
    let slack = tolerance * length_of(g);
    let next = law_next(bound.stop.law, part_at(parts, place), dot(g, v), slack);
    return (next << place) | (bound.stop.open << (place + OPEN_PLACE));
}

fn bound_force(bound: Bound) -> vec3<real> {
    return bound.gradient * law_force(bound.stop.law, bound.now.qd);
}

fn bound_work(bound: Bound, part: u32, v: vec3<real>, way: vec3<real>) -> real {
    let g = bound.gradient;
    return law_exerted(bound.stop.law, part, dot(g, v)) * dot(g, way);
}

// A joint force, and the inertia that it adds.
struct Pushing {
    force: vec3<real>,
    own: Sym3,
}

fn with_bound(sum: Pushing, bound: Bound, part: u32) -> Pushing {
    let g = bound.gradient;
    let load = law_load(bound.stop.law, part, bound.now);
    return Pushing(sum.force + g * load.x, sym_add(sum.own, sym_outer(g, load.y)));
}

fn with_round(sum: Pushing, law: Round, share: real, w: vec3<real>, h: real) -> Pushing {
    let inertia: real = h * share * law.slope;
    let own = Sym3(sum.own.diagonal + vec3<real>(inertia, inertia, inertia), sum.own.off);
    return Pushing(sum.force + round_exerted(law, share, w), own);
}
