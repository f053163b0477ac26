//! Rotations in two parts, for what f64 rounds off along a chain of them.
//!
//! Of every entry the first part is a multiple of 2^-25, the second what is left, in f64. Entries of
//! rotations are at most 1, so that products of first parts and sums of three of them are exact
//! (multiples of 2^-50 below 4, 52 bits), without error-free transformations of single operations: a product of
//! matrices costs as much as four in f64, and errs by 2^-76 (the splitting of K. Ozaki, T. Ogita, S. Oishi and
//! S. M. Rump, "Error-free transformations of matrix multiplication by using fast routines of matrix
//! multiplication and its applications", Numer. Algorithms 59, 2012, at a fixed place).

use crate::sin_cos::ROUNDING;
use crate::{DoubleDouble, Mat3, Number, Real, Vec3};
use core::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// A rotation matrix, or one nearly so, to 2^-76 of its largest entry.
#[derive(Clone, Copy, Debug)]
pub struct Twofold {
    first: Mat3<f64>,
    second: Mat3<f64>,
}

impl Twofold {
    /// The same matrix, exactly.
    #[inline]
    #[must_use]
    pub fn new(m: Mat3<f64>) -> Self {
        Self::renormalized(m, Mat3::ZERO)
    }

    /// The nearest one.
    #[must_use]
    pub fn rounded(m: &Mat3<DoubleDouble>) -> Self {
        let first = m.map(|x| leading(x.hi()));
        Self {
            first,
            second: (m.map(DoubleDouble::hi) - first) + m.map(DoubleDouble::lo),
        }
    }

    /// The sum of multiples of 2^-50 and what is much smaller.
    #[inline(always)]
    fn renormalized(exact: Mat3<f64>, small: Mat3<f64>) -> Self {
        let first = (exact + small).map(leading);
        Self {
            first,
            second: (exact - first) + small,
        }
    }

    /// The product with another.
    #[inline]
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let whole = next.first + next.second;
        let small = self.first * next.second + self.second * whole;
        Self::renormalized(self.first * next.first, small)
    }

    /// The product with a turn about z by an angle \[rad\].
    #[inline]
    #[must_use]
    pub fn turned(&self, angle: f64) -> Self {
        let ([sin, sin_rest], [cos, cos_rest]) = sin_cos(angle);
        let (sin_whole, cos_whole) = (sin + sin_rest, cos + cos_rest);
        let (x, y, z) = (self.first.x_axis, self.first.y_axis, self.first.z_axis);
        let rest = &self.second;
        let exact = Mat3::from_cols(x * cos + y * sin, y * cos - x * sin, z);
        let small = Mat3::from_cols(
            (x * cos_rest + y * sin_rest) + (rest.x_axis * cos_whole + rest.y_axis * sin_whole),
            (y * cos_rest - x * sin_rest) + (rest.y_axis * cos_whole - rest.x_axis * sin_whole),
            rest.z_axis,
        );
        Self::renormalized(exact, small)
    }

    /// What is left beside a matrix that is nearly the same.
    #[inline]
    #[must_use]
    pub fn beyond(&self, m: Mat3<f64>) -> Mat3<f64> {
        (self.first - m) + self.second
    }
}

/// What rounding misses of v = w + M x: w + M x - v as if in twice the precision (Dot2 of T. Ogita,
/// S. M. Rump and S. Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26, 2005).
#[inline]
#[must_use]
pub fn missing(w: Vec3<f64>, m: &Mat3<f64>, x: Vec3<f64>, v: Vec3<f64>) -> Vec3<f64> {
    let (w, v) = (w.to_array(), v.to_array());
    let columns = [m.x_axis, m.y_axis, m.z_axis].map(Vec3::to_array);
    Vec3::from_array(core::array::from_fn(|k| {
        let start = DoubleDouble::from_sum(w[k], -v[k]);
        let (mut sum, mut rest) = (start.hi(), start.lo());
        for (column, x) in columns.iter().zip(x.to_array()) {
            if x != 0.0 {
                let product = DoubleDouble::from_product(column[k], x);
                let next = DoubleDouble::from_sum(sum, product.hi());
                (sum, rest) = (next.hi(), rest + (next.lo() + product.lo()));
            }
        }
        sum + rest
    }))
}

/// The nearest multiple of 2^-25.
#[inline(always)]
fn leading(x: f64) -> f64 {
    const UNIT: f64 = ROUNDING / 33_554_432.0; // 2^25
    (x + UNIT) - UNIT
}

/// Steps of the table in a turn: as many as eight bits tell apart.
const STEPS: usize = 256;

/// Sine of so many steps in two parts; an entry [`QUARTER`] later is its cosine.
static TABLE: LazyLock<[[f64; 2]; STEPS + QUARTER]> = LazyLock::new(|| {
    core::array::from_fn(|k| {
        let step = DoubleDouble::from_sum(STEP, STEP_REST);
        let (sin, _) = (step * DoubleDouble::from_f64(k as f64)).sin_cos();
        parts(sin)
    })
});

const QUARTER: usize = STEPS / 4;

/// A step, pi/128, and what f64 leaves of it.
const STEP: f64 = FRAC_PI_2 / 64.0;
const STEP_REST: f64 = 6.123_233_995_736_766e-17 / 64.0;

/// A step as the sum of 33 bits, another 33 and the rest: a multiple of the first two by an integer below
/// 2^20 is exact.
const STEP_PARTS: [f64; 3] = {
    let first = f64::from_bits(STEP.to_bits() >> 20 << 20);
    let second = (STEP - first) + STEP_REST;
    let second = f64::from_bits(second.to_bits() >> 20 << 20);
    [first, second, ((STEP - first) - second) + STEP_REST]
};

/// Angles up to here are fewer than 2^20 steps.
const LARGEST_ANGLE: f64 = 16_384.0;

fn parts(x: DoubleDouble) -> [f64; 2] {
    let first = leading(x.hi());
    [first, (x.hi() - first) + x.lo()]
}

/// Sine and cosine of an angle \[rad\], each in two parts, to 2^-64.
///
/// The angle is k pi/128 + d, |d| <= pi/256: the products with k are exact, and what the second difference
/// rounds off is kept. Of sin(k pi/128 + d) = S cos d + C sin d the largest terms are S and C d, exact for
/// the leading parts, of C 2^-25 and of d 2^-32; the rest is below 2^-12. The first terms that the series
/// leave out are below 2^-71 and 2^-66.
#[inline]
fn sin_cos(angle: f64) -> ([f64; 2], [f64; 2]) {
    let reducible = angle.abs() <= LARGEST_ANGLE;
    if !reducible {
        let (sin, cos) = DoubleDouble::sin_cos_of(angle);
        return (parts(sin), parts(cos));
    }
    let shifted = angle * (1.0 / STEP) + ROUNDING;
    let steps = shifted - ROUNDING;
    let first = angle - steps * STEP_PARTS[0];
    let second = steps * STEP_PARTS[1];
    let d = first - second;
    let part = d - first;
    let tail = ((first - (d - part)) - (second + part)) - steps * STEP_PARTS[2];

    const UNIT: f64 = ROUNDING / 4_294_967_296.0; // 2^32
    let leading_d = (d + UNIT) - UNIT;
    let square = d * d;
    let beyond_d = d * square * (-1.0 / 6.0 + square * (1.0 / 120.0 - square * (1.0 / 5040.0)));
    let beyond_one = square * (-0.5 + square * (1.0 / 24.0 - square * (1.0 / 720.0))) - d * tail;
    let small = ((d - leading_d) + tail) + beyond_d;

    // The integer is in the last bits of the sum.
    let index = (shifted.to_bits() & 0xff) as usize;
    let (sin, cos) = (TABLE[index], TABLE[index + QUARTER]);
    let sum = |[own, own_rest]: [f64; 2], [other, other_rest]: [f64; 2]| {
        let exact = other * leading_d;
        let rest = own_rest
            + (other * small + other_rest * (leading_d + small) + (own + own_rest) * beyond_one);
        let first = leading(own + (exact + rest));
        [first, ((own - first) + exact) + rest]
    };
    (sum(sin, cos), sum(cos, sin.map(|x| -x)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3;

    /// A stream of numbers in [-1, 1).
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    fn off(found: [f64; 2], exact: DoubleDouble) -> f64 {
        (DoubleDouble::from_sum(found[0], found[1]) - exact)
            .abs()
            .to_f64()
    }

    #[test]
    fn sines_and_cosines() {
        let mut number = numbers();
        let mut worst = 0.0_f64;
        for k in 0..40_000 {
            let scale = [1e-9, 0.01, 1.0, 10.0, 1e3, 16_383.0, 1e6][k % 7];
            let angle = number() * scale;
            let (sin, cos) = sin_cos(angle);
            let exact = DoubleDouble::sin_cos_of(angle);
            for [first, rest] in [sin, cos] {
                assert_eq!((first * 33_554_432.0).fract(), 0.0);
                assert!(rest.abs() <= 1.01 / 67_108_864.0, "{angle}: {rest:e}");
            }
            worst = worst.max(off(sin, exact.0)).max(off(cos, exact.1));
        }
        let bound = 2.0_f64.powi(-64);
        assert!(worst <= bound, "{worst:e}");
        assert!(sin_cos(f64::NAN).0[0].is_nan());
    }

    /// Against the same products in 106 bits.
    #[test]
    fn chains_of_turns() {
        let mut number = numbers();
        let mut exact = Mat3::<DoubleDouble>::IDENTITY;
        let mut found = Twofold::new(Mat3::IDENTITY);
        let largest = |m: Mat3<f64>| {
            [m.x_axis, m.y_axis, m.z_axis]
                .map(|v| v.abs().to_array())
                .concat()
                .into_iter()
                .fold(0.0, f64::max)
        };
        for k in 1..300 {
            let axes = DoubleDouble::rotation_of([number(), number(), number(), number()]);
            let angle = 4.0 * number();
            let (sin, cos) = DoubleDouble::sin_cos_of(angle);
            let (zero, one) = (DoubleDouble::ZERO, DoubleDouble::ONE);
            let turn = Mat3::from_cols(
                vec3(cos, sin, zero),
                vec3(-sin, cos, zero),
                vec3(zero, zero, one),
            );
            exact = exact * axes * turn;
            found = found.then(&Twofold::rounded(&axes)).turned(angle);
            let rounded = exact.map(Real::to_f64);
            let beyond = (exact - rounded.map(DoubleDouble::from_f64)).map(Real::to_f64);
            let error = largest(found.beyond(rounded) - beyond);
            assert!(error <= 2.0_f64.powi(-63) * f64::from(k), "{k}: {error:e}");
        }
    }

    #[test]
    fn what_a_sum_misses() {
        let m = Mat3::from_cols(
            vec3(0.1, 0.2, 0.3),
            vec3(0.4, 0.5, 0.6),
            vec3(0.7, 0.8, 0.9),
        );
        let (w, x) = (vec3(1e3, -1e3, 0.25), vec3(0.3, 0.0, -7.1));
        let v = w + m * x;
        let missed = missing(w, &m, x, v);
        let exact = w.map(DoubleDouble::from_f64)
            + m.map(DoubleDouble::from_f64) * x.map(DoubleDouble::from_f64);
        let beyond = (exact - v.map(DoubleDouble::from_f64)).map(Real::to_f64);
        // A few units of 2^-106 of the largest term.
        let error = (missed - beyond)
            .abs()
            .to_array()
            .into_iter()
            .fold(0.0, f64::max);
        assert!(error <= 1e3 * 2.0_f64.powi(-103), "{error:e}");
        assert!(missed.length() > 0.0);
    }
}
