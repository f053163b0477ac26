// Joints: kinds and velocity products. In joint axes those of one freedom turn about z, slide along it or both,
// and the columns of S of a spherical or free joint are the child's axes.

const FIXED = 0u;
const REVOLUTE = 1u;
const PRISMATIC = 2u;
const SPHERICAL = 3u;
const FREE = 4u;
const SCREW = 5u;

// c of a = X a' + S qdd + c, conventional accelerations, in any axes: [w x w_J; w x (w x r) + 2 w x v_J],
// and w_J x v_J where the linear rates turn with the child. `w` is the parent's angular velocity, `r` leads
// from its origin to the child's, `joint` is the relative velocity.
fn velocity_product(kind: u32, w: vec3<real>, r: vec3<real>, joint: Motion) -> Motion {
    var turning = w + w;
    if kind == FREE {
        turning += joint.angular;
    }
    return Motion(
        cross3(w, joint.angular),
        cross3(w, cross3(w, r)) + cross3(turning, joint.linear),
    );
}

// The turn about z by an angle of this sine and cosine, after R: R Rz.
fn turned_about_z(rotation: mat3x3<real>, sine: real, cosine: real) -> mat3x3<real> {
    return mat3x3<real>(
        rotation[0] * cosine + rotation[1] * sine,
        rotation[1] * cosine - rotation[0] * sine,
        rotation[2],
    );
}
