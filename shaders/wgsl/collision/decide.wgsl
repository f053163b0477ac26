// Whether two triangles meet, as far as single precision can be sure of it.
//
// Signs of determinants decide, as in the exact test of the host (Guigue and Devillers 2003): on which
// side of each triangle's plane the corners of the other lie, and how the ends of the parts that they
// have of the line where the planes meet are ordered. A sign counts only if the determinant is larger
// than a bound on its error; else the pair is left to the host.
//
// A determinant is w . (u x v) with two edges, one maybe rotated, and one difference w of a point of A
// and a point of B. Let u and v be off by at most e_u and e_v in each coordinate, w by e_w, all
// differences rounded. Whatever the order of operations, fused or not, with results rounded to a
// neighbouring number (2^-23): each of the six products goes through at most 10 roundings, so that the
// determinant is off by at most 1.25e-6 times its permanent (1.193e-6 and the roundings of the
// permanent), and the errors of the vectors add at most
//
//     e_w sum(permanent normal) + (e_u |v| + e_v |u|) (|w| + 3 e_w)        with |x| = |x|_1
//
// and terms of second order, for which the coefficients of e_u, e_v and e_w have room. Everything is
// first multiplied by a power of two that brings the largest difference into [1, 2): products that
// underflow add less than 2^-118.

const RELATIVE: f32 = 1.25e-6;
const UNDERFLOW: f32 = 7.7037198e-34; // 2^-110

struct Corners {
    p: vec3<f32>,
    q: vec3<f32>,
    r: vec3<f32>,
}

// A triangle of B, seen from A.
struct Posed {
    corners: Corners,
    // q - p and r - p, rotated as such.
    to_q: vec3<f32>,
    to_r: vec3<f32>,
    // Errors of a corner's coordinate and of an edge's.
    error: f32,
    edge_error: f32,
}

// u x v, with what its products with others are off by.
struct Plane {
    normal: vec3<f32>,
    permanent: vec3<f32>,
    // e_u |v| + e_v |u|.
    error: f32,
}

fn sum(v: vec3<f32>) -> f32 {
    return v.x + v.y + v.z;
}

fn plane(u: vec3<f32>, v: vec3<f32>, u_error: f32, v_error: f32) -> Plane {
    let left = u.yzx * v.zxy;
    let right = u.zxy * v.yzx;
    let error = u_error * sum(abs(v)) + v_error * sum(abs(u));
    return Plane(left - right, abs(left) + abs(right), error);
}

// The sign of a determinant, or 0 if it is not certain.
fn side(plane: Plane, w: vec3<f32>, w_error: f32) -> i32 {
    let value = dot(plane.normal, w);
    let size = abs(w);
    let bound: f32 = RELATIVE * dot(plane.permanent, size)
        + w_error * sum(plane.permanent)
        + plane.error * (sum(size) + 3.0 * w_error)
        + UNDERFLOW;
    return select(0, 1, value > bound) - select(0, 1, value < -bound);
}

// The sign of (q - p) x (r - p), or 0 if it is not certain, for points off by at most half of `error` in each
// coordinate: as for `side`, with fewer roundings.
fn turn(p: vec2<f32>, q: vec2<f32>, r: vec2<f32>, unit: f32, error: f32) -> i32 {
    let u = (q - p) * unit;
    let v = (r - p) * unit;
    let left = u.x * v.y;
    let right = u.y * v.x;
    let bound: f32 = RELATIVE * (abs(left) + abs(right))
        + error * (abs(u.x) + abs(u.y) + abs(v.x) + abs(v.y) + 4.0 * error)
        + UNDERFLOW;
    return select(0, 1, left - right > bound) - select(0, 1, left - right < -bound);
}

// The axis along which a normal is longest.
fn longest_axis(normal: vec3<f32>) -> u32 {
    let size = abs(normal);
    let axis = select(0u, 1u, size.y > size.x);
    return select(axis, 2u, size.z > max(size.x, size.y));
}

// A point, projected along an axis.
fn flat(p: vec3<f32>, axis: u32) -> vec2<f32> {
    if axis == 0u {
        return p.yz;
    }
    if axis == 1u {
        return p.zx;
    }
    return p.xy;
}

// Whether a triangle of a plane lies strictly beyond the edge of another from p to q, whose third corner is r.
fn beyond(
    p: vec2<f32>,
    q: vec2<f32>,
    r: vec2<f32>,
    other: array<vec2<f32>, 3>,
    unit: f32,
    error: f32,
) -> bool {
    let outside = -turn(p, q, r, unit, error);
    return outside != 0
        && turn(p, q, other[0], unit, error) == outside
        && turn(p, q, other[1], unit, error) == outside
        && turn(p, q, other[2], unit, error) == outside;
}

// Whether two triangles are certain to be apart because their shadows along an axis are: for those that are
// in one plane, or nearly.
fn shadows_apart(a: Corners, b: Corners, axis: u32, unit: f32, error: f32) -> bool {
    let s = array<vec2<f32>, 3>(flat(a.p, axis), flat(a.q, axis), flat(a.r, axis));
    let t = array<vec2<f32>, 3>(flat(b.p, axis), flat(b.q, axis), flat(b.r, axis));
    return beyond(s[0], s[1], s[2], t, unit, error)
        || beyond(s[1], s[2], s[0], t, unit, error)
        || beyond(s[2], s[0], s[1], t, unit, error)
        || beyond(t[0], t[1], t[2], s, unit, error)
        || beyond(t[1], t[2], t[0], s, unit, error)
        || beyond(t[2], t[0], t[1], s, unit, error);
}

// The power of two that brings a normal number into [1, 2).
fn to_unit(size: f32) -> f32 {
    return bitcast<f32>(0x7f000000u - (bitcast<u32>(size) & 0x7f800000u));
}

// The corner alone on its side, and those that follow it.
fn from_hub(t: Corners, sides: vec3<i32>) -> Corners {
    if sides.x == sides.y {
        return Corners(t.r, t.p, t.q);
    }
    if sides.x == sides.z {
        return Corners(t.q, t.r, t.p);
    }
    return t;
}

fn hub_is_positive(sides: vec3<i32>) -> bool {
    // The two others outweigh it.
    return sides.x + sides.y + sides.z < 0;
}

fn decide(a: Corners, b: Posed) -> u32 {
    let u = a.q - a.p;
    let v = a.r - a.p;
    let from_b = Corners(a.p - b.corners.p, a.q - b.corners.p, a.r - b.corners.p);
    let from_a = Corners(b.corners.p - a.p, b.corners.q - a.p, b.corners.r - a.p);
    var largest = max(max(abs(u), abs(v)), max(abs(b.to_q), abs(b.to_r)));
    largest = max(largest, max(max(abs(from_b.p), abs(from_b.q)), abs(from_b.r)));
    largest = max(largest, max(abs(from_a.q), abs(from_a.r)));
    // Not less than FLUSH, since no error is.
    let unit = to_unit(max(max(largest.x, largest.y), max(largest.z, b.error)));
    let error = b.error * unit;
    let b_error = b.edge_error * unit;
    let a_error = FLUSH * unit;

    let plane_b = plane(b.to_q * unit, b.to_r * unit, b_error, b_error);
    let sides_a = vec3<i32>(
        side(plane_b, from_b.p * unit, error),
        side(plane_b, from_b.q * unit, error),
        side(plane_b, from_b.r * unit, error),
    );
    if abs(sides_a.x + sides_a.y + sides_a.z) == 3 {
        return MISS;
    }
    let plane_a = plane(u * unit, v * unit, a_error, a_error);
    let sides_b = vec3<i32>(
        side(plane_a, from_a.p * unit, error),
        side(plane_a, from_a.q * unit, error),
        side(plane_a, from_a.r * unit, error),
    );
    if abs(sides_b.x + sides_b.y + sides_b.z) == 3 {
        return MISS;
    }
    if any(sides_a == vec3<i32>(0)) || any(sides_b == vec3<i32>(0)) {
        let longer = dot(plane_b.normal, plane_b.normal) > dot(plane_a.normal, plane_a.normal);
        let axis = longest_axis(select(plane_a.normal, plane_b.normal, longer));
        return select(OPEN, MISS, shadows_apart(a, b.corners, axis, unit, 2.0 * error));
    }
    // Each has one corner, its hub, on one side of the other's plane and two on the other: the ends of
    // its part of the line are on the edges from the hub. Of det(x, w, z), with the edges x and z from
    // hub to end and w from hub to hub, the host's `exact.rs` says why its sign is their order.
    let hub_a = from_hub(a, sides_a);
    let hub_b = from_hub(b.corners, sides_b);
    let edges: Corners = from_hub(Corners(vec3<f32>(0.0), b.to_q, b.to_r), sides_b);
    let positive_a = hub_is_positive(sides_a);
    let positive_b = hub_is_positive(sides_b);
    let w = (hub_b.p - hub_a.p) * unit;
    let x_q = (hub_a.q - hub_a.p) * unit;
    let x_r = (hub_a.r - hub_a.p) * unit;
    let z_q = (edges.q - edges.p) * unit;
    let z_r = (edges.r - edges.p) * unit;
    let first: Plane = plane(
        select(z_q, z_r, positive_b), select(x_q, x_r, positive_a), 2.0 * b_error, a_error);
    let second: Plane = plane(
        select(z_r, z_q, positive_b), select(x_r, x_q, positive_a), 2.0 * b_error, a_error);
    let same = select(-1, 1, positive_a == positive_b);
    let first_order = same * side(first, w, error);
    let second_order = -same * side(second, w, error);
    if first_order < 0 || second_order < 0 {
        return MISS;
    }
    return select(OPEN, HIT, first_order > 0 && second_order > 0);
}
