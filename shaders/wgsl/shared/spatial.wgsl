// Spatial algebra over `real`, angular part first, with the names of vertebra-spatial. Small structs
// passed by value: compilers take them apart into scalars in registers.

struct Motion {
    angular: vec3<real>,
    linear: vec3<real>,
}

struct Force {
    angular: vec3<real>,
    linear: vec3<real>,
}

// A symmetric matrix.
struct Sym3 {
    // xx, yy, zz
    diagonal: vec3<real>,
    // yz, xz, xy: each where the index that is left out stands.
    off: vec3<real>,
}

// The symmetric matrix [A H'; H C] from acceleration to force.
struct Inertia {
    // A: moment from angular acceleration.
    angular: Sym3,
    // H: force from angular acceleration.
    coupling: mat3x3<real>,
    // C: force from linear acceleration.
    linear: Sym3,
}

fn cross3(a: vec3<real>, b: vec3<real>) -> vec3<real> {
    return a.yzx * b.zxy - a.zxy * b.yzx;
}

fn zero3() -> vec3<real> {
    return vec3<real>(0.0, 0.0, 0.0);
}

fn is_finite3(v: vec3<real>) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

fn sym_zero() -> Sym3 {
    return Sym3(zero3(), zero3());
}

fn sym_column_x(s: Sym3) -> vec3<real> {
    return vec3<real>(s.diagonal.x, s.off.z, s.off.y);
}

fn sym_column_y(s: Sym3) -> vec3<real> {
    return vec3<real>(s.off.z, s.diagonal.y, s.off.x);
}

fn sym_column_z(s: Sym3) -> vec3<real> {
    return vec3<real>(s.off.y, s.off.x, s.diagonal.z);
}

fn sym_mul(s: Sym3, v: vec3<real>) -> vec3<real> {
    return s.diagonal * v + s.off.zxy * v.yzx + s.off.yzx * v.zxy;
}

fn sym_add(a: Sym3, b: Sym3) -> Sym3 {
    return Sym3(a.diagonal + b.diagonal, a.off + b.off);
}

fn sym_sub(a: Sym3, b: Sym3) -> Sym3 {
    return Sym3(a.diagonal - b.diagonal, a.off - b.off);
}

// v v' scale
fn sym_outer(v: vec3<real>, scale: real) -> Sym3 {
    let scaled = v * scale;
    return Sym3(v * scaled, v.yzx * scaled.zxy);
}

fn sym_trace(s: Sym3) -> real {
    return s.diagonal.x + s.diagonal.y + s.diagonal.z;
}

// R S R'
fn sym_rotated(s: Sym3, rotation: mat3x3<real>) -> Sym3 {
    let half = mat3x3<real>(
        rotation * sym_column_x(s),
        rotation * sym_column_y(s),
        rotation * sym_column_z(s),
    );
    // Rows of R, with which the rows of R S are multiplied.
    let rows = transpose(rotation);
    let left = transpose(half);
    return Sym3(
        vec3<real>(dot(left[0], rows[0]), dot(left[1], rows[1]), dot(left[2], rows[2])),
        vec3<real>(dot(left[1], rows[2]), dot(left[0], rows[2]), dot(left[0], rows[1])),
    );
}

// The same velocity or acceleration at the point that lies at `r` from this origin: [1 0; -r~ 1].
fn motion_shifted(m: Motion, r: vec3<real>) -> Motion {
    return Motion(m.angular, m.linear + cross3(m.angular, r));
}

fn motion_add(a: Motion, b: Motion) -> Motion {
    return Motion(a.angular + b.angular, a.linear + b.linear);
}

fn motion_sub(a: Motion, b: Motion) -> Motion {
    return Motion(a.angular - b.angular, a.linear - b.linear);
}

fn motion_zero() -> Motion {
    return Motion(zero3(), zero3());
}

// The pairing of motions and forces.
fn motion_dot(m: Motion, f: Force) -> real {
    return dot(m.angular, f.angular) + dot(m.linear, f.linear);
}

// A force given about this origin, about the point from which this origin lies at `r`: [1 r~; 0 1].
fn force_shifted_back(f: Force, r: vec3<real>) -> Force {
    return Force(f.angular + cross3(r, f.linear), f.linear);
}

fn force_add(a: Force, b: Force) -> Force {
    return Force(a.angular + b.angular, a.linear + b.linear);
}

fn force_sub(a: Force, b: Force) -> Force {
    return Force(a.angular - b.angular, a.linear - b.linear);
}

fn force_scaled(f: Force, factor: real) -> Force {
    return Force(f.angular * factor, f.linear * factor);
}

fn force_zero() -> Force {
    return Force(zero3(), zero3());
}

fn inertia_zero() -> Inertia {
    return Inertia(sym_zero(), mat3x3<real>(zero3(), zero3(), zero3()), sym_zero());
}

// A rigid body: A about the origin, H = -h~, C = m 1.
fn inertia_rigid(rotational: Sym3, moment: vec3<real>, mass: real) -> Inertia {
    let h = moment;
    return Inertia(
        rotational,
        mat3x3<real>(
            vec3<real>(0.0, -h.z, h.y),
            vec3<real>(h.z, 0.0, -h.x),
            vec3<real>(-h.y, h.x, 0.0),
        ),
        Sym3(vec3<real>(mass, mass, mass), zero3()),
    );
}

fn inertia_add(a: Inertia, b: Inertia) -> Inertia {
    return Inertia(
        sym_add(a.angular, b.angular),
        a.coupling + b.coupling,
        sym_add(a.linear, b.linear),
    );
}

fn inertia_mul(inertia: Inertia, a: Motion) -> Force {
    return Force(
        sym_mul(inertia.angular, a.angular) + a.linear * inertia.coupling,
        inertia.coupling * a.angular + sym_mul(inertia.linear, a.linear),
    );
}

// IA - U U' scale
fn inertia_less_outer(inertia: Inertia, u: Force, scale: real) -> Inertia {
    let scaled = u.angular * scale;
    let h = inertia.coupling;
    return Inertia(
        sym_sub(inertia.angular, sym_outer(u.angular, scale)),
        mat3x3<real>(
            h[0] - u.linear * scaled.x,
            h[1] - u.linear * scaled.y,
            h[2] - u.linear * scaled.z,
        ),
        sym_sub(inertia.linear, sym_outer(u.linear, scale)),
    );
}

// X' IA X: the inertia at the point from which this one's lies at `r`. H' = H - C r~ and, by columns,
// A'_ij = A_ij + (r x H_j)_i + (r x H'_i)_j.
fn inertia_shifted_back(inertia: Inertia, r: vec3<real>) -> Inertia {
    let h = inertia.coupling;
    let cx = sym_column_x(inertia.linear);
    let cy = sym_column_y(inertia.linear);
    let cz = sym_column_z(inertia.linear);
    let coupling = mat3x3<real>(
        h[0] + cz * r.y - cy * r.z,
        h[1] + cx * r.z - cz * r.x,
        h[2] + cy * r.x - cx * r.y,
    );
    let x = cross3(r, h[0]);
    let y = cross3(r, h[1]);
    let z = cross3(r, h[2]);
    let new_x = cross3(r, coupling[0]);
    let new_y = cross3(r, coupling[1]);
    let new_z = cross3(r, coupling[2]);
    return Inertia(
        Sym3(
            inertia.angular.diagonal + vec3<real>(x.x + new_x.x, y.y + new_y.y, z.z + new_z.z),
            inertia.angular.off + vec3<real>(z.y + new_y.z, z.x + new_x.z, y.x + new_x.y),
        ),
        coupling,
        inertia.linear,
    );
}

// Q IA Q' with Q = [R 0; 0 R]: the same inertia in the axes that R maps to.
fn inertia_rotated(inertia: Inertia, rotation: mat3x3<real>) -> Inertia {
    return Inertia(
        sym_rotated(inertia.angular, rotation),
        rotation * inertia.coupling * transpose(rotation),
        sym_rotated(inertia.linear, rotation),
    );
}

// The force that keeps a rigid body turning with `w` when the point at its origin does not accelerate:
// [w x I w; w x (w x h)].
fn turning_force(rotational: Sym3, moment: vec3<real>, w: vec3<real>) -> Force {
    return Force(
        cross3(w, sym_mul(rotational, w)),
        cross3(w, cross3(w, moment)),
    );
}
