// Rotations: unit quaternions x, y, z, w, their matrices, and how they move. With `sin_cos` of the
// precision's trigonometry.

// The Hamilton product: turns by b first, then by a.
fn quaternion_product(a: vec4<real>, b: vec4<real>) -> vec4<real> {
    return vec4<real>(
        b.xyz * a.w + a.xyz * b.w + cross3(a.xyz, b.xyz),
        a.w * b.w - dot(a.xyz, b.xyz),
    );
}

fn quaternion_normalized(q: vec4<real>) -> vec4<real> {
    return q * (1.0 / sqrt(dot(q, q)));
}

// The matrix of a unit quaternion.
fn quaternion_matrix(q: vec4<real>) -> mat3x3<real> {
    let twice = q.xyz + q.xyz;
    let square = q.xyz * twice;
    let mixed = q.yzx * twice.zxy;
    let real_part = twice * q.w;
    let sum = mixed + real_part;
    let difference = mixed - real_part;
    return mat3x3<real>(
        vec3<real>(1.0 - square.y - square.z, sum.z, difference.y),
        vec3<real>(difference.z, 1.0 - square.x - square.z, sum.x),
        vec3<real>(sum.y, difference.x, 1.0 - square.x - square.y),
    );
}

// R v
fn quaternion_turned(q: vec4<real>, v: vec3<real>) -> vec3<real> {
    let half = cross3(q.xyz, v) + v * q.w;
    return v + 2.0 * cross3(q.xyz, half);
}

// The rotation by |r| about r: [sin(|r|/2) r/|r|, cos(|r|/2)]. Below |r| = 1/64 sin(h)/|r| is its series
// 1/2 - |r|^2/48 + |r|^4/3840 - |r|^6/645120, whose next term is below 2^-77.
fn quaternion_exp(r: vec3<real>) -> vec4<real> {
    let square: real = dot(r, r);
    let angle: real = sqrt(square);
    let turn: vec2<real> = sin_cos(0.5 * angle);
    let series: real = 0.5 - square * (0.020833333333333332
        - square * (0.00026041666666666666 - square * 1.5500992063492063e-06));
    let is_small: bool = angle < 0.015625;
    let scale: real = select(turn.x / select(angle, real(1.0), is_small), series, is_small);
    return vec4<real>(r * scale, turn.y);
}

// Moves an orientation by the angular displacement `r`, given in the turning frame's own axes.
fn quaternion_integrated(q: vec4<real>, r: vec3<real>) -> vec4<real> {
    return quaternion_normalized(quaternion_product(q, quaternion_exp(r)));
}

// du/dt where R = R0 exp(u) turns with angular velocity `w` in its own axes, to third order in u:
// w + u x w / 2 + u x (u x w) / 12 (Hairer, Lubich and Wanner, Geometric Numerical Integration, III.4).
fn rotation_vector_rate(u: vec3<real>, w: vec3<real>) -> vec3<real> {
    let uw = cross3(u, w);
    return w + uw * 0.5 + cross3(u, uw) * 0.08333333333333333;
}
