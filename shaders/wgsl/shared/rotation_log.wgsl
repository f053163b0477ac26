// The angle that has this sine and cosine, between -pi and pi.
//
// It is the driver's in f32, some digits of it, then corrected once: with s, c the sine and cosine that are wanted
// and those of the estimate p, sin(angle - p) = s cos p - c sin p, of which the arcsine's series ends below rounding
// for any estimate within 5e-3.
fn unit_angle(sine: real, cosine: real) -> real {
    let estimate: real = real(atan2(f32(sine), f32(cosine)));
    let turn: vec2<real> = sin_cos(estimate);
    let off: real = sine * turn.y - cosine * turn.x;
    let square = off * off;
    return estimate + off * (1.0 + square * (0.16666666666666666 + square * 0.075));
}

// The rotation vector r of a unit quaternion, the short way: [sin(|r|/2) r/|r|, cos(|r|/2)].
fn quaternion_log(q: vec4<real>) -> vec3<real> {
    let way: real = select(real(1.0), real(-1.0), q.w < 0.0);
    let v = q.xyz * way;
    let sine: real = sqrt(dot(v, v));
    let half: real = unit_angle(sine, q.w * way);
    // Of tiny ones the sine is the angle.
    let is_tiny: bool = sine < 1e-18;
    let scale: real = select(2.0 * half / select(sine, real(1.0), is_tiny), real(2.0), is_tiny);
    return v * scale;
}
