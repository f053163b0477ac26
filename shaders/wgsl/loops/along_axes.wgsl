// Joints of groups that are let go along their own axes.

fn let_go_along(spot: Spot, k: u32, axes: mat3x3<real>) -> Motion {
    return freedom_along(spot, k, axes);
}

// Numbers of a spherical joint that are given about its axes, where it is let go along others.
fn given_about_axes(spot: Spot, at: u32, stride: u32) -> vec3<real> { return zero3(); }

fn given_along(spot: Spot, k: u32, at: u32, of_axes: vec3<real>) -> real { return number(at); }

// Makes what has been solved for of it numbers about its axes.
fn put_about_axes(spot: Spot, at: u32) {}
