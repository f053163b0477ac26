// What joints about z are if some of them are screws: the motion across the freedom s = (z, p z) of pitch p is
// (-p z, z).

fn turning_floor(slot: u32, floor: vec2<real>) -> real {
    let pitch = pitch_of(slot);
    return floor.x + floor.y * (pitch * pitch);
}

// Of a force in joint axes what acts along s / s's and across, instead of its components along z.
fn seen_along(pitch: real, f: Force) -> Force {
    var seen = f;
    seen.angular.z = (f.angular.z + pitch * f.linear.z) / (1.0 + pitch * pitch);
    seen.linear.z = f.linear.z - pitch * f.angular.z;
    return seen;
}

// The force in joint axes that has these components.
fn put_along(pitch: real, f: Force) -> Force {
    let along: real = f.angular.z / (1.0 + pitch * pitch);
    var whole = f;
    whole.angular.z = along - pitch * f.linear.z;
    whole.linear.z = pitch * along + f.linear.z;
    return whole;
}

// A symmetric matrix in the same coordinates.
fn inertia_along(pitch: real, g: Inertia) -> Inertia {
    let p = pitch;
    let scale: real = 1.0 / (1.0 + p * p);
    let a = g.angular;
    let h = g.coupling;
    let c = g.linear;
    let azz: real = a.diagonal.z;
    let hzz: real = h[2].z;
    let czz: real = c.diagonal.z;
    return Inertia(
        Sym3(
            vec3<real>(
                a.diagonal.xy,
                scale * scale * (azz + p * (hzz + hzz + p * czz)),
            ),
            vec3<real>(
                scale * (a.off.x + p * h[1].z),
                scale * (a.off.y + p * h[0].z),
                a.off.z,
            ),
        ),
        mat3x3<real>(
            vec3<real>(h[0].xy, h[0].z - p * a.off.y),
            vec3<real>(h[1].xy, h[1].z - p * a.off.x),
            vec3<real>(
                scale * (h[2].x + p * c.off.y),
                scale * (h[2].y + p * c.off.x),
                scale * (hzz + p * (czz - azz - p * hzz)),
            ),
        ),
        Sym3(
            vec3<real>(c.diagonal.xy, czz - p * (hzz + hzz - p * azz)),
            vec3<real>(c.off.x - p * h[2].y, c.off.y - p * h[2].x, c.off.z),
        ),
    );
}

fn rows_along(pitch: real, m: Matrix6) -> Matrix6 {
    var seen = m;
    let scale: real = 1.0 / (1.0 + pitch * pitch);
    for (var i = 0u; i < 3u; i++) {
        seen.aa[i].z = scale * (m.aa[i].z + pitch * m.la[i].z);
        seen.al[i].z = scale * (m.al[i].z + pitch * m.ll[i].z);
        seen.la[i].z = m.la[i].z - pitch * m.aa[i].z;
        seen.ll[i].z = m.ll[i].z - pitch * m.al[i].z;
    }
    return seen;
}

// The rate of the freedom in a motion in joint axes that has no part across it.
fn rate_along(pitch: real, m: Motion) -> real {
    return (m.angular.z + pitch * m.linear.z) / (1.0 + pitch * pitch);
}
