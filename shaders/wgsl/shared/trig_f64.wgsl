// Sine and cosine within 3e-16 for angles up to 2^20, and beyond within that and the rounding of the
// angle. SPIR-V has none for f64.
//
// The angle is k pi/2 + r with |r| <= pi/4: the first two parts of pi/2 have 33 bits each, so that their
// multiples by k < 2^20 and the first difference are exact (Cody and Waite, Software Manual for the
// Elementary Functions, 1980). The series end below 2^-57 of their sums.

const LARGEST_ANGLE: real = 1073741824.0;

// Sine, then cosine.
fn sin_cos(angle: real) -> vec2<real> {
    let turns: real = round(angle * 0.6366197723675814);
    let r: real = ((angle - turns * 1.5707963267341256) - turns * 6.077100506303966e-11)
        - turns * 2.0222662487959506e-21;
    let square = r * r;
    let high_sine: real = -2.505210838544172e-08 + square * (1.6059043836821613e-10
        + square * (-7.647163731819816e-13 + square * 2.8114572543455206e-15));
    let sine: real = r + r * square * (-0.16666666666666666 + square * (0.008333333333333333
        + square * (-0.0001984126984126984 + square * (2.7557319223985893e-06 + square * high_sine))));
    let high_cosine: real = -2.755731922398589e-07 + square * (2.08767569878681e-09
        + square * (-1.1470745597729725e-11 + square * 4.779477332387385e-14));
    let cosine: real = (1.0 - 0.5 * square) + square * square * (0.041666666666666664
        + square * (-0.001388888888888889 + square * (2.48015873015873e-05 + square * high_cosine)));
    let quadrant = u32(i32(turns));
    let odd = (quadrant & 1u) != 0u;
    let s: real = select(sine, cosine, odd);
    let c: real = select(cosine, sine, odd);
    return vec2<real>(
        select(s, -s, (quadrant & 2u) != 0u),
        select(c, -c, ((quadrant + 1u) & 2u) != 0u),
    );
}
