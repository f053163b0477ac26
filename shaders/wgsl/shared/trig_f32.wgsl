// Sine and cosine within 1.5e-7 for angles up to LARGEST_ANGLE, where neighbouring numbers are 0.008
// apart; what WGSL promises of its own is 4.9e-4.
//
// The angle is k pi/2 + r with |r| <= pi/4: the first two parts of pi/2 have 8 bits each, so that their
// multiples by k < 2^16 and the first two differences are exact (Cody and Waite, Software Manual for the
// Elementary Functions, 1980). The series end below 2.5e-9 of their sums.

const LARGEST_ANGLE: real = 65536.0;

// Sine, then cosine.
fn sin_cos(angle: real) -> vec2<real> {
    let turns: real = round(angle * 0.63661975);
    let r: real = ((angle - turns * 1.5703125) - turns * 0.0004825592041015625)
        - turns * 1.2675907e-6;
    let square = r * r;
    let sine: real = r + r * square
        * (-0.16666667 + square * (8.3333333e-3 + square * (-1.9841270e-4 + square * 2.7557319e-6)));
    let cosine: real = (1.0 - 0.5 * square) + square * square
        * (4.1666668e-2 + square * (-1.3888889e-3 + square * (2.4801587e-5 - square * 2.7557319e-7)));
    let quadrant = u32(i32(turns));
    let odd = (quadrant & 1u) != 0u;
    let s: real = select(sine, cosine, odd);
    let c: real = select(cosine, sine, odd);
    return vec2<real>(
        select(s, -s, (quadrant & 2u) != 0u),
        select(c, -c, ((quadrant + 1u) & 2u) != 0u),
    );
}
