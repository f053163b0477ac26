//! Sine and cosine together, in f64, without branches on the way.
//!
//! The C library's functions are as accurate but are calls, of which a sweep over joints makes one
//! each; this is inlined, and loops over it become vector code.

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// pi/2 beyond f64's [`FRAC_PI_2`], in two parts.
const REST: [f64; 2] = [6.123_233_995_736_766e-17, -1.497_384_904_859_17e-33];

/// pi/2 as the sum of 40 bits, another 40 and the next 53: a multiple of the first two by an integer
/// below 2^13 is exact.
const PARTS: [f64; 3] = {
    let first = leading_40_bits(FRAC_PI_2);
    let second = leading_40_bits((FRAC_PI_2 - first) + REST[0]);
    let third = (((FRAC_PI_2 - first) - second) + REST[0]) + REST[1];
    [first, second, third]
};

/// Angles up to here are reduced to [-pi/4, pi/4] here; there are then fewer than 2^13
/// quarter turns.
const LARGEST_ANGLE: f64 = 8192.0;

/// 1.5 2^52: a number added to it and taken away again is rounded to the nearest integer, whose last
/// bits are those of the sum.
pub(crate) const ROUNDING: f64 = 6_755_399_441_055_744.0;

const fn leading_40_bits(x: f64) -> f64 {
    f64::from_bits(x.to_bits() >> 13 << 13)
}

/// Coefficients of r^3, r^5, ... r^17 of the sine's series.
const SINE: [f64; 8] = inverse_factorials([3, 5, 7, 9, 11, 13, 15, 17], -1.0);
/// Coefficients of r^4, r^6, ... r^16 of the cosine's.
const COSINE: [f64; 7] = inverse_factorials([4, 6, 8, 10, 12, 14, 16], 1.0);

/// `first` 1/n! with alternating signs.
const fn inverse_factorials<const N: usize>(orders: [u64; N], first: f64) -> [f64; N] {
    let mut coefficients = [0.0; N];
    let (mut k, mut sign) = (0, first);
    while k < N {
        let (mut factorial, mut factor) = (1_u64, 2);
        while factor <= orders[k] {
            factorial *= factor;
            factor += 1;
        }
        // Exact: 17! is below 2^53.
        coefficients[k] = sign / factorial as f64;
        sign = -sign;
        k += 1;
    }
    coefficients
}

/// Sine and cosine of an angle \[rad\], each within 0.8 units in the last place for |angle| up to
/// 8192, and beyond as accurate as the C library's.
#[inline]
pub(crate) fn sin_cos(angle: f64) -> (f64, f64) {
    if is_reducible(angle) {
        sin_cos_reduced(angle)
    } else {
        angle.sin_cos()
    }
}

/// Not so for NaN.
#[inline]
fn is_reducible(angle: f64) -> bool {
    angle.abs() <= LARGEST_ANGLE
}

/// [`sin_cos`] of several angles.
#[inline(always)]
pub(crate) fn sin_cos_each<const N: usize>(angles: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    for k in 0..N {
        (sines[k], cosines[k]) = sin_cos_reduced(angles[k]);
    }
    for k in 0..N {
        if !is_reducible(angles[k]) {
            (sines[k], cosines[k]) = angles[k].sin_cos();
        }
    }
    (sines, cosines)
}

/// Sine and cosine of an angle up to [`LARGEST_ANGLE`].
///
/// The angle is k pi/2 + r, |r| <= pi/4: both products below are exact, so is the first difference
/// (Cody and Waite, Software Manual for the Elementary Functions, 1980), and what rounds off the
/// second is kept as `tail`. The first terms that the series leave out are below 2^-57 and 2^-58 of
/// their sums.
#[inline(always)]
fn sin_cos_reduced(angle: f64) -> (f64, f64) {
    let shifted = angle * FRAC_2_PI + ROUNDING;
    let turns = shifted - ROUNDING;
    let first = angle - turns * PARTS[0];
    let second = turns * PARTS[1];
    let r = first - second;
    // What is lost there, whichever term is the larger (Knuth's two-sum).
    let part = r - first;
    let tail = ((first - (r - part)) - (second + part)) - turns * PARTS[2];

    let square = r * r;
    let series = |coefficients: &[f64]| {
        let mut sum = 0.0;
        for &coefficient in coefficients.iter().rev() {
            sum = sum * square + coefficient;
        }
        sum
    };
    let half = 0.5 * square;
    // sin(r + t) = sin r + t cos r, cos(r + t) = cos r - t sin r; of the factors of t two terms do.
    let sin = r + (r * (square * series(&SINE)) + tail * (1.0 - half));
    let near_one = 1.0 - half;
    let cos =
        near_one + (((1.0 - near_one) - half) + (square * square * series(&COSINE) - r * tail));

    // An odd quarter turn swaps the two, a half turn changes signs: by masks, as vector code does it.
    let quadrant = shifted.to_bits();
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swapped = (sin ^ cos) & 0_u64.wrapping_sub(quadrant & 1);
    let sign = |odd: u64| (odd & 2) << 62;
    (
        f64::from_bits(sin ^ swapped ^ sign(quadrant)),
        f64::from_bits(cos ^ swapped ^ sign(quadrant.wrapping_add(1))),
    )
}

#[cfg(test)]
mod tests {
    use super::sin_cos;
    use crate::{DoubleDouble, Number, Real};
    use core::f64::consts::FRAC_PI_2;

    /// Largest error of sine and cosine in units in the last place of the result.
    fn ulps(angle: f64) -> f64 {
        let (sin, cos) = sin_cos(angle);
        let exact = DoubleDouble::sin_cos_of(angle);
        let error = |found: f64, exact: DoubleDouble| {
            let unit = f64::from_bits(exact.to_f64().abs().to_bits() + 1) - exact.to_f64().abs();
            (DoubleDouble::from_f64(found) - exact).abs().to_f64() / unit
        };
        error(sin, exact.0).max(error(cos, exact.1))
    }

    #[test]
    fn within_a_unit_in_the_last_place() {
        let mut worst = 0.0_f64;
        for k in 0..200_000_u32 {
            let x = f64::from(k);
            // Quarter turns and between, tiny, and large angles of both signs.
            for angle in [
                x * 1e-5 - 1.0,
                x * 7.1e-4 - 71.0,
                8191.9 - x * 0.0371,
                x * 1e-200,
            ] {
                worst = worst.max(ulps(angle)).max(ulps(-angle));
            }
        }
        assert!(worst <= 0.8, "{worst}");
        assert!(worst > 0.5, "the reference has no more digits: {worst}");
    }

    /// Where sine or cosine nearly vanish nothing is left but what was kept beside r.
    #[test]
    fn near_quarter_turns() {
        for k in 1..5215_u32 {
            let angle = f64::from(k) * FRAC_PI_2;
            let error = ulps(angle);
            assert!(error <= 0.8, "{k} quarter turns: {error}");
        }
    }

    #[test]
    fn zero_huge_and_no_angles() {
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
        assert_eq!(sin_cos(1e22), 1e22_f64.sin_cos());
        assert!(sin_cos(f64::NAN).0.is_nan() && sin_cos(f64::INFINITY).1.is_nan());
    }
}
