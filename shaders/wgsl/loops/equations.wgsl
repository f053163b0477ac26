// The equations of loops and couplings with their second rates, and their rows of J; equation.rs and
// constraint.rs of the dynamics have the formulas.

// A frame of a closure in motion: in world axes, its origin seen from that of the innermost body that carries both
// ends.
struct Moving {
    axes: mat3x3<real>,
    origin: vec3<real>,
    spin: vec3<real>,
    velocity: vec3<real>,
    turning: vec3<real>,
    acceleration: vec3<real>,
    // From the body's origin.
    arm: vec3<real>,
}

// The end of a constraint whose chain of bodies is given.
fn moving(g: Group, body: u32, chain: u32, length: u32, constants: u32) -> Moving {
    let rotation = vec4<real>(links[constants]);
    let at = vec4<real>(links[constants + 1u]).xyz;
    let zero = zero3();
    if body == NONE {
        return Moving(quaternion_matrix(rotation), at, zero, zero, zero, zero, zero);
    }
    let p = place_of(g, body);
    let arm = quaternion_turned(p.rotation, at);
    var origin = arm;
    for (var i = 0u; i < length; i++) {
        origin += three(body_memory(g, words[chain + i]) + OFFSET);
    }
    return Moving(
        quaternion_matrix(turned_by(p.rotation, rotation)),
        origin,
        p.spin,
        p.velocity + cross3(p.spin, arm),
        p.turning,
        p.acceleration + cross3(p.turning, arm) + cross3(p.spin, cross3(p.spin, arm)),
        arm,
    );
}

struct Equation {
    value: real,
    // The force pair about the second origin that acts on the second body.
    wrench: Force,
    second_rate: real,
}

// The second rate of an axis that is fixed in a frame.
fn second_rate_of(u: vec3<real>, frame: Moving) -> vec3<real> {
    return cross3(frame.turning, u) + cross3(frame.spin, cross3(frame.spin, u));
}

// e = u d for an axis u of the first frame.
fn along(u: vec3<real>, a: Moving, b: Moving) -> Equation {
    let d = b.origin - a.origin;
    return Equation(
        dot(u, d),
        Force(zero3(), u),
        dot(u, b.acceleration - a.acceleration)
            + 2.0 * dot(cross3(a.spin, u), b.velocity - a.velocity)
            + dot(second_rate_of(u, a), d),
    );
}

// The angle of a direction, from that of f32 by two steps of the tangent's.
fn angle_of(y: real, x: real) -> real {
    var angle: real = real(atan2(f32(y), f32(x)));
    for (var i = 0u; i < 2u; i++) {
        let turn: vec2<real> = sin_cos(angle);
        let tangent: real = (y * turn.y - x * turn.x) / (x * turn.y + y * turn.x);
        angle += tangent - tangent * tangent * tangent / 3.0;
    }
    return angle;
}

fn equation_of(row: Row, a: Moving, b: Moving) -> Equation {
    let given: real = vec4<real>(links[row.constants]).x;
    switch row.kind {
        case POINT: { return along(column_of(a.axes, row.axes.x), a, b); }
        case PERPENDICULAR: {
            let one = column_of(a.axes, row.axes.x);
            let other = column_of(b.axes, row.axes.y);
            return Equation(
                dot(one, other),
                Force(cross3(other, one), zero3()),
                dot(second_rate_of(one, a), other) + dot(one, second_rate_of(other, b))
                    + 2.0 * dot(cross3(a.spin, one), cross3(b.spin, other)),
            );
        }
        case THREAD: {
            let z = a.axes[2];
            let slide = along(z, a, b);
            let x = b.axes[0];
            let angle = angle_of(dot(x, a.axes[1]), dot(x, a.axes[0]));
            let turning: real = dot(b.turning - a.turning, z)
                + dot(b.spin - a.spin, cross3(a.spin, z));
            // Turns that are whole cannot be told from none.
            let turn: real = 6.283185307179586 * given;
            let value: real = slide.value - given * angle;
            let has_pitch: bool = given != 0.0;
            let whole: real = select(
                real(0.0),
                round(value / select(real(1.0), turn, has_pitch)),
                has_pitch,
            );
            return Equation(
                value - whole * turn,
                Force(z * -given, z),
                slide.second_rate - given * turning,
            );
        }
        default: {
            let d = b.origin - a.origin;
            let velocity = b.velocity - a.velocity;
            let distance: real = sqrt(dot(d, d));
            let is_apart: bool = distance > 0.0;
            let inverse: real = select(
                real(0.0),
                1.0 / select(real(1.0), distance, is_apart),
                is_apart,
            );
            // Origins that coincide have no direction between them: any will part them.
            let u = select(a.axes[0], d * inverse, is_apart);
            let closing: real = dot(u, velocity);
            let across: real = dot(velocity, velocity) - closing * closing;
            return Equation(
                distance - given,
                Force(zero3(), u),
                dot(u, b.acceleration - a.acceleration) + max(across, real(0.0)) * inverse,
            );
        }
    }
}

fn dof_number(g: Group, c: Constraint, entry: u32) -> u32 {
    return words[g.dofs_at + 3u * words[c.dofs_at + entry]];
}

fn evaluate_coupling(g: Group, r: u32, row: Row, c: Constraint) {
    let constants = vec4<real>(links[c.constants]);
    let at = row_memory(g, r);
    put_number(row.jacobian + c.ends.x, real(1.0));
    put_number(row.jacobian + c.ends.y, constants.x);
    put_number(
        at + VALUE,
        position(c.positions.x) + constants.x * position(c.positions.y) - constants.y,
    );
    let own: real = real(state[accelerations_at() + dof_number(g, c, c.ends.x)]);
    let other: real = real(state[accelerations_at() + dof_number(g, c, c.ends.y)]);
    put_number(at + SECOND_RATE, own + constants.x * other);
}

fn evaluate_row(g: Group, r: u32) {
    let row = row_at(g, r);
    let c = constraint_at(row.constraint);
    for (var i = 0u; i < c.entries; i++) {
        put_number(row.jacobian + i, real(0.0));
    }
    if row.kind == COUPLING {
        evaluate_coupling(g, r, row, c);
        return;
    }
    let a = moving(g, c.ends.x, c.chains, c.first, c.constants);
    let b = moving(g, c.ends.y, c.chains + c.first, c.second, c.constants + 2u);
    let found = equation_of(row, a, b);
    let at = row_memory(g, r);
    put_number(at + VALUE, found.value);
    put_number(at + SECOND_RATE, found.second_rate);
    var entry = row.jacobian;
    let reach = a.arm + b.origin - a.origin;
    var f: Force = force_scaled(force_shifted_back(found.wrench, reach), -1.0);
    let length = c.first + c.second;
    for (var i = 0u; i < length; i++) {
        if i == c.first {
            f = force_shifted_back(found.wrench, b.arm);
        }
        let body = words[c.chains + i];
        let spot = member_at(g, body).spot;
        let p = place_of(g, body);
        let axes = quaternion_matrix(p.rotation);
        let freedoms = freedoms_of(kind_of(spot.flags));
        for (var k = 0u; k < freedoms; k++) {
            put_number(entry + k, motion_dot(freedom_along(spot, k, axes), f));
        }
        entry += freedoms;
        f = force_shifted_back(f, p.offset);
    }
}

fn evaluate_rows(g: Group, lane: u32) {
    let passes = passes_for(g.rows);
    for (var pass_ = 0u; pass_ < passes; pass_++) {
        let r = pass_ * LANES + lane;
        if r < g.rows {
            evaluate_row(g, r);
        }
    }
    wait_for_numbers();
}
