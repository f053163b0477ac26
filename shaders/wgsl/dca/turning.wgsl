// Spherical joints some of which have ranges, friction or motors: `load_balls` has found out what acts in them.

// E as a sum of moments m a a'. The axes a, in those of the joint, are columns of a triangle's with rows in any order.
struct Moments {
    axes: mat3x3<real>,
    sizes: vec3<real>,
}

struct Turning {
    force: vec3<real>,
    own: Moments,
}

// Of a joint six fours, in the places of its three freedoms: axes and their moments; the force, and the parts that the
// laws of its stops are on; what is known of the shares of its motor and its friction.
const FORCE_ROW = 3u;
const MOTOR_ROW = 4u;
const FRICTION_ROW = 5u;

fn ball_row(v: u32, row: u32) -> u32 { return sizes.balls + row / 3u * sizes.dofs + v + row % 3u; }

fn moments_kept(v: u32) -> Moments {
    let a = fetch(ball_row(v, 0u));
    let b = fetch(ball_row(v, 1u));
    let c = fetch(ball_row(v, 2u));
    return Moments(mat3x3<real>(a.xyz, b.xyz, c.xyz), vec3<real>(a.w, b.w, c.w));
}

// They are kept already.
fn keep_moments(v: u32, own: Moments) {}

fn load_turning(slot: u32, q: u32, v: u32) -> Turning {
    return Turning(fetch(ball_row(v, FORCE_ROW)).xyz, moments_kept(v));
}

fn is_turning_held(own: Moments) -> bool { return is_held3(own.sizes); }

fn with_moments(s: Sym3, own: Moments, axes: mat3x3<real>) -> Sym3 {
    let a = axes * own.axes;
    return sym_add(
        sym_add(s, sym_outer(a[0], own.sizes.x)),
        sym_add(sym_outer(a[1], own.sizes.y), sym_outer(a[2], own.sizes.z)),
    );
}

fn moments_times(own: Moments, qdd: vec3<real>) -> vec3<real> {
    return own.axes * (own.sizes * (qdd * own.axes));
}

// The columns d that have d'a = 1 with the axis of the same number and zero with others. The determinant of the axes
// is 1 or -1.
fn across_axes(a: mat3x3<real>) -> mat3x3<real> {
    let x = cross3(a[1], a[2]);
    return mat3x3<real>(x, cross3(a[2], a[0]), cross3(a[0], a[1])) * dot(a[0], x);
}

// By its components along the axes, about each of which the moment holds by itself.
fn drive_turning(load: Turning) -> Drive {
    return split3(load.force * across_axes(load.own.axes), load.own.sizes);
}

// The columns along which a leaf's joint transmits forces.
fn joint_basis(kind: u32, v: u32, axes: mat3x3<real>) -> mat3x3<real> {
    if kind == SPHERICAL {
        return axes * moments_kept(v).axes;
    }
    return axes;
}

fn turning_moment(slot: u32, v: u32, k: u32) -> real { return fetch(ball_row(v, k)).w; }

// `load_balls` sums it up.
fn work_turning(slot: u32, before: vec3<real>, rates: vec3<real>) {}

fn work_turning_between(slot: u32, before: vec3<real>, rates: vec3<real>) {}
