// Spherical joints in which all that acts is alike in all directions: springs, dampers and rotors.

// Inertia about each of the joint's axes.
alias Moments = vec3<real>;

struct Turning {
    force: vec3<real>,
    own: Moments,
}

fn load_turning(slot: u32, q: u32, v: u32) -> Turning {
    let ball = ball_of(slot);
    let h = step_ahead();
    let off = ball_off(ball, state4(position_now(q)));
    let force = ball_force(ball, off, state3(rate_now(v)), h);
    let inertia = ball_inertia(ball, h);
    return Turning(
        joint_forces3(v) + force,
        given_numbers3(OWN, v) + vec3<real>(inertia, inertia, inertia),
    );
}

fn is_turning_held(own: Moments) -> bool { return is_held3(own); }

fn with_moments(s: Sym3, own: Moments, axes: mat3x3<real>) -> Sym3 {
    return with_own3(s, own, axes);
}

fn moments_times(own: Moments, qdd: vec3<real>) -> vec3<real> { return own * qdd; }

fn moments_kept(v: u32) -> Moments { return own_kept3(v); }

fn keep_moments(v: u32, own: Moments) { keep_own3(v, own); }

fn drive_turning(load: Turning) -> Drive { return split3(load.force, load.own); }

// The columns along which a leaf's joint transmits forces.
fn joint_basis(kind: u32, v: u32, axes: mat3x3<real>) -> mat3x3<real> { return axes; }

fn turning_moment(slot: u32, v: u32, k: u32) -> real {
    return given_number(OWN, v + k) + ball_inertia(ball_of(slot), step_ahead());
}

fn work_turning(slot: u32, before: vec3<real>, rates: vec3<real>) {
    let ball = ball_of(slot);
    let off = ball_off(ball, state4(position_of(slot)));
    put_works(dof_of(slot), ball_works_of_step(ball, off, before, rates, step_ahead()));
}

fn work_turning_between(slot: u32, before: vec3<real>, rates: vec3<real>) {
    let ball = ball_of(slot);
    let q = position_of(slot);
    let offs = ball_off(ball, state4(q)) + ball_off(ball, state4(work_q() + q));
    let h: real = real(forces[STEP_SIZE]);
    put_works(dof_of(slot), ball_works_between(ball, offs, before, rates, h));
}
