// Spherical joints of groups, let go so that their own inertia is one number a freedom: with E = A m A' of moments m
// the rates z of w = A'^-1 z have it, and forces A^-1 tau.

fn turned_columns(v: u32) -> mat3x3<real> { return across_axes(moments_kept(v).axes); }

fn let_go_along(spot: Spot, k: u32, axes: mat3x3<real>) -> Motion {
    if kind_of(spot.flags) == SPHERICAL {
        return Motion(axes * column_of(turned_columns(spot.v), k), zero3());
    }
    return freedom_along(spot, k, axes);
}

fn three_apart(at: u32, stride: u32) -> vec3<real> {
    return vec3<real>(number(at), number(at + stride), number(at + 2u * stride));
}

// Numbers of a spherical joint that are given about its axes, where it is let go along others.
fn given_about_axes(spot: Spot, at: u32, stride: u32) -> vec3<real> {
    if kind_of(spot.flags) == SPHERICAL {
        return three_apart(at, stride);
    }
    return zero3();
}

fn given_along(spot: Spot, k: u32, at: u32, of_axes: vec3<real>) -> real {
    if kind_of(spot.flags) == SPHERICAL {
        return dot(column_of(turned_columns(spot.v), k), of_axes);
    }
    return number(at);
}

// Makes what has been solved for of it numbers about its axes.
fn put_about_axes(spot: Spot, at: u32) {
    if kind_of(spot.flags) == SPHERICAL {
        let rates = turned_columns(spot.v) * three_apart(at, FREEDOM);
        put_number(at, rates.x);
        put_number(at + FREEDOM, rates.y);
        put_number(at + 2u * FREEDOM, rates.z);
    }
}
