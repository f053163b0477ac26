alias real = f64;

// There is no bitcast of f64, and compilers may take it for granted that nothing is NaN: the scale
// brings every finite number into the range of f32, whose exponent is then looked at.
fn is_finite(x: real) -> bool {
    return (bitcast<u32>(f32(x * 1e-270)) & 0x7f800000u) != 0x7f800000u;
}
