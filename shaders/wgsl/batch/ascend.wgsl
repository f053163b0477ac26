// Up the tree: articulated inertias and bias forces.

// The forces on a body about its joint's origin, in its axes: a wrench in these axes; force f and torque
// in world axes, and the sum T of point f' over the points where they act. The moment of R'f at the
// points is the axial vector of T R.
fn external_force(slot: u32, link: BatchLink) -> Force {
    if link.pushed == NONE {
        return force_zero();
    }
    let place = record(slot) + 4u + HAS_SPHERICAL;
    let x = scratch_at(place).xyz;
    let y = scratch_at(place + 1u).xyz;
    let z = scratch_at(place + 2u).xyz;
    let axes = mat3x3<real>(x, y, z);
    let row = plan.dofs + 21u * link.pushed;
    let tx = force3(row + 12u);
    let ty = force3(row + 15u);
    let tz = force3(row + 18u);
    let moment = vec3<real>(dot(ty, z) - dot(tz, y), dot(tz, x) - dot(tx, z), dot(tx, y) - dot(ty, x));
    return Force(
        force3(row) + force3(row + 9u) * axes + moment,
        force3(row + 3u) + force3(row + 6u) * axes,
    );
}

// What a body hands to its parent, about the parent's origin and in its axes; and traces of what arrives
// before the joint lets go, a bound of its rounding.
struct Passed {
    inertia: Inertia,
    bias: Force,
    carried: vec2<real>,
}

fn nothing_passed() -> Passed {
    return Passed(inertia_zero(), force_zero(), vec2<real>(0.0, 0.0));
}

fn passed_add(a: Passed, b: Passed) -> Passed {
    return Passed(inertia_add(a.inertia, b.inertia), force_add(a.bias, b.bias), a.carried + b.carried);
}

fn leave(place: u32, passed: Passed) {
    let inertia = passed.inertia;
    let bias = passed.bias;
    set_scratch(place, vec4<real>(inertia.angular.diagonal, passed.carried.x));
    set_scratch(place + 1u, vec4<real>(inertia.angular.off, passed.carried.y));
    set_scratch(place + 2u, vec4<real>(inertia.coupling[0], bias.angular.x));
    set_scratch(place + 3u, vec4<real>(inertia.coupling[1], bias.angular.y));
    set_scratch(place + 4u, vec4<real>(inertia.coupling[2], bias.angular.z));
    set_scratch(place + 5u, vec4<real>(inertia.linear.diagonal, bias.linear.x));
    set_scratch(place + 6u, vec4<real>(inertia.linear.off, bias.linear.y));
    set_scratch(place + 7u, vec4<real>(bias.linear.z, 0.0, 0.0, 0.0));
}

fn found(place: u32) -> Passed {
    let a = scratch_at(place);
    let b = scratch_at(place + 1u);
    let hx = scratch_at(place + 2u);
    let hy = scratch_at(place + 3u);
    let hz = scratch_at(place + 4u);
    let c = scratch_at(place + 5u);
    let d = scratch_at(place + 6u);
    return Passed(
        Inertia(Sym3(a.xyz, b.xyz), mat3x3<real>(hx.xyz, hy.xyz, hz.xyz), Sym3(c.xyz, d.xyz)),
        Force(vec3<real>(hx.w, hy.w, hz.w), vec3<real>(c.w, d.w, scratch_at(place + 7u).x)),
        vec2<real>(a.w, b.w),
    );
}

// Ia and pa in the parent's axes of a joint about z: of Ia nothing is left about z, of pa the joint force.
fn pass_revolute(
    inertia: Inertia,
    bias: Force,
    w_force: Force,
    u_force: Force,
    force_along: real,
    c: Motion,
    u: real,
    axes: mat3x3<real>,
) -> Passed {
    let a = inertia.angular;
    let wa = w_force.angular;
    let xx = a.diagonal.x - u_force.angular.x * wa.x;
    let yy = a.diagonal.y - u_force.angular.y * wa.y;
    let xy = a.off.z - u_force.angular.x * wa.y;
    let hx = inertia.coupling[0] - u_force.linear * wa.x;
    let hy = inertia.coupling[1] - u_force.linear * wa.y;
    let ul = u_force.linear;
    let wl = w_force.linear;
    let linear = Sym3(
        inertia.linear.diagonal - ul * wl,
        inertia.linear.off - ul.yzx * wl.zxy,
    );
    let force = Force(
        vec3<real>(
            bias.angular.x + xx * c.angular.x + xy * c.angular.y + dot(hx, c.linear) + wa.x * u,
            bias.angular.y + xy * c.angular.x + yy * c.angular.y + dot(hy, c.linear) + wa.y * u,
            force_along,
        ),
        bias.linear + hx * c.angular.x + hy * c.angular.y + sym_mul(linear, c.linear) + wl * u,
    );
    let x = axes[0];
    let y = axes[1];
    let p = x * xx + y * xy;
    let q = x * xy + y * yy;
    let turned_x = axes * hx;
    let turned_y = axes * hy;
    return Passed(
        Inertia(
            Sym3(p * x + q * y, p.yzx * x.zxy + q.yzx * y.zxy),
            mat3x3<real>(
                turned_x * x.x + turned_y * y.x,
                turned_x * x.y + turned_y * y.y,
                turned_x * x.z + turned_y * y.z,
            ),
            sym_rotated(linear, axes),
        ),
        Force(axes * force.angular, axes * force.linear),
        vec2<real>(0.0, 0.0),
    );
}

// The articulated inertia and bias force of a body, and what its joint passes on.
fn ascend(slot: u32, seen: Seen, arriving: Passed) -> Passed {
    let link = seen.link;
    let at = record(slot);
    let w = seen.first.xyz;
    let child = placement(seen, vec2<real>(seen.first.w, seen.second.w));
    let across = joint_velocity(seen);
    // w_parent x w_J, of which w_J x w_J is nothing.
    let c = Motion(cross3(w, across.angular), seen.second.xyz);

    let constant = 4u + 6u * slot;
    let body = constants[constant];
    let rotational = Sym3(constants[constant + 1u].xyz, constants[constant + 2u].xyz);
    var here: Passed = passed_add(
        arriving,
        Passed(
            inertia_rigid(rotational, body.xyz, body.w),
            turning_force(rotational, body.xyz, w),
            vec2<real>(sym_trace(rotational), 3.0 * body.w),
        ),
    );
    if HAS_FORCES != 0u {
        here.bias = force_sub(here.bias, external_force(slot, link));
    }
    let handoffs = record(plan.levels * LANES);
    for (var k = 0u; k < link.gathered; k++) {
        here = passed_add(here, found(handoffs + 8u * (link.first + k)));
    }
    let inertia = here.inertia;
    let bias = here.bias;
    let floor = here.carried * real(FLOOR);
    let carried = vec2<real>(
        sym_trace(inertia.angular) + dot(child.origin, child.origin) * sym_trace(inertia.linear),
        sym_trace(inertia.linear),
    );

    var passed: Passed;
    let row = link.dof;
    if HAS_FREE != 0u && link.kind == FREE {
        // Everything is let go but what drives the joint: a = IA^-1 (tau - pA).
        let driven = Force(force3(row), force3(row + 3u));
        let factor = cholesky6(inertia, floor.x, floor.y);
        if !factor.positive {
            fail(slot, SINGULAR);
        }
        let a = cholesky6_solve(factor, force_sub(driven, bias));
        set_scratch(at + 2u, vec4<real>(a.angular, 0.0));
        set_scratch(at + 3u, vec4<real>(a.linear, 0.0));
        passed.inertia = inertia_zero();
        passed.bias = Force(child.axes * driven.angular, child.axes * driven.linear);
    } else if HAS_SPHERICAL != 0u && link.kind == SPHERICAL {
        // D = A, U = [A; H]: of Ia only C - H A^-1 H' is left, of the moment the joint's.
        let driven = force3(row);
        let factor = cholesky3(inertia.angular, floor.x);
        if !factor.positive {
            fail(slot, SINGULAR);
        }
        let rows = transpose(inertia.coupling);
        let lower_x = cholesky3_lower(factor, rows[0]);
        let lower_y = cholesky3_lower(factor, rows[1]);
        let lower_z = cholesky3_lower(factor, rows[2]);
        let response = cholesky3_solve(factor, driven - bias.angular);
        set_scratch(at + 2u, vec4<real>(cholesky3_upper(factor, lower_x), response.x));
        set_scratch(at + 3u, vec4<real>(cholesky3_upper(factor, lower_y), response.y));
        set_scratch(at + 4u, vec4<real>(cholesky3_upper(factor, lower_z), response.z));
        let linear = Sym3(
            inertia.linear.diagonal
                - vec3<real>(dot(lower_x, lower_x), dot(lower_y, lower_y), dot(lower_z, lower_z)),
            inertia.linear.off
                - vec3<real>(dot(lower_y, lower_z), dot(lower_x, lower_z), dot(lower_x, lower_y)),
        );
        let force = bias.linear + inertia.coupling * response + sym_mul(linear, c.linear);
        passed.inertia = inertia_zero();
        passed.inertia.linear = sym_rotated(linear, child.axes);
        passed.bias = Force(child.axes * driven, child.axes * force);
    } else if HAS_PRISMATIC != 0u && link.kind == PRISMATIC {
        let h = inertia.coupling;
        let u_force = Force(vec3<real>(h[0].z, h[1].z, h[2].z), sym_column_z(inertia.linear));
        let d: real = inertia.linear.diagonal.z;
        let is_firm = d > floor.y;
        if !is_firm {
            fail(slot, SINGULAR);
        }
        let d_inverse: real = 1.0 / select(real(1.0), d, is_firm);
        let along: real = seen.other;
        let u = along - bias.linear.z;
        let w_force = force_scaled(u_force, d_inverse);
        set_scratch(at + 2u, vec4<real>(w_force.angular, u * d_inverse));
        set_scratch(at + 3u, vec4<real>(w_force.linear, 0.0));
        var left = inertia_less_outer(inertia, u_force, d_inverse);
        left.linear.diagonal.z = 0.0;
        left.linear.off.x = 0.0;
        left.linear.off.y = 0.0;
        left.coupling[0].z = 0.0;
        left.coupling[1].z = 0.0;
        left.coupling[2].z = 0.0;
        var force = force_add(force_add(bias, inertia_mul(left, c)), force_scaled(w_force, u));
        force.linear.z = along;
        passed.inertia = inertia_rotated(left, child.axes);
        passed.bias = Force(child.axes * force.angular, child.axes * force.linear);
    } else {
        let u_force = Force(sym_column_z(inertia.angular), inertia.coupling[2]);
        let d: real = inertia.angular.diagonal.z;
        let is_firm = d > floor.x;
        if !is_firm && link.kind == REVOLUTE {
            fail(slot, SINGULAR);
        }
        let d_inverse: real = 1.0 / select(real(1.0), d, is_firm);
        let along: real = seen.other;
        let u = along - bias.angular.z;
        let w_force = force_scaled(u_force, d_inverse);
        set_scratch(at + 2u, vec4<real>(w_force.angular, u * d_inverse));
        set_scratch(at + 3u, vec4<real>(w_force.linear, 0.0));
        passed = pass_revolute(inertia, bias, w_force, u_force, along, c, u, child.axes);
    }
    return Passed(
        inertia_shifted_back(passed.inertia, child.origin),
        force_shifted_back(passed.bias, child.origin),
        carried,
    );
}
