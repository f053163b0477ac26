alias real = f32;

// By its exponent, because compilers may take it for granted that nothing is NaN.
fn is_finite(x: real) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}
