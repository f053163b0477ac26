//! Double-double arithmetic: numbers of 106 bits as unevaluated sums of two f64.
//!
//! The reference precision, in which an algorithm written over [`Real`] says what its f64 version
//! got wrong. With u = 2^-53 the operations err, relative to their exact results, by at most
//! 3 u^2 (sum), 5 u^2 (product), 25/8 u^2 (root), and a few u^2 (quotient): Joldes, Muller and
//! Popescu, Tight and rigorous error bounds for basic building blocks of double-word arithmetic,
//! ACM TOMS 44 (2017); Lefevre et al., Accurate calculation of Euclidean norms using double-word
//! arithmetic, ACM TOMS 49 (2023).

use crate::scalar::{normalized_rotation, single_lane};
use crate::{Mat3, Number, Real};
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number `hi + lo` with |lo| at most half a unit in the last place of `hi`.
///
/// The range is that of f64, less some room: products beyond 2^996 and terms below 2^-969 lose the
/// low part. Overflow gives a number that is not [finite](Number::is_finite).
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct DoubleDouble {
    hi: f64,
    lo: f64,
}

impl DoubleDouble {
    /// The sum of two f64, exactly.
    #[inline]
    #[must_use]
    pub fn from_sum(a: f64, b: f64) -> Self {
        two_sum(a, b)
    }

    /// The product of two f64, exactly.
    #[inline]
    #[must_use]
    pub fn from_product(a: f64, b: f64) -> Self {
        two_prod(a, b)
    }

    /// The nearest f64.
    #[inline]
    #[must_use]
    pub const fn hi(self) -> f64 {
        self.hi
    }

    /// What is left of the number beside [`hi`](Self::hi).
    #[inline]
    #[must_use]
    pub const fn lo(self) -> f64 {
        self.lo
    }

    /// Product with an f64 (Joldes, Muller and Popescu, algorithm 7: error 3/2 u^2).
    #[inline]
    fn scaled(self, factor: f64) -> Self {
        let high = two_prod(self.hi, factor);
        let low = self.lo * factor;
        let sum = quick_two_sum(high.hi, low);
        quick_two_sum(sum.hi, high.lo + sum.lo)
    }
}

/// a + b exactly (Knuth, TAOCP 4.2.2, theorem B).
#[inline]
fn two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    let b_part = hi - a;
    let lo = (a - (hi - b_part)) + (b - b_part);
    DoubleDouble { hi, lo }
}

/// a + b exactly, where |a| >= |b| or a = 0 (Dekker 1971).
#[inline]
fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    DoubleDouble {
        hi,
        lo: b - (hi - a),
    }
}

/// a b exactly.
///
/// With a fused multiply-add in the instruction set that is one instruction. Without, `mul_add` is
/// a call into software that may take a hundred times as long, and Dekker's product with
/// Veltkamp's splitting takes 17 plain operations. Both are exact, hence the same bits.
#[inline]
fn two_prod(a: f64, b: f64) -> DoubleDouble {
    let hi = a * b;
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
        return DoubleDouble {
            hi,
            lo: a.mul_add(b, -hi),
        };
    }
    let ((a_hi, a_lo), (b_hi, b_lo)) = (split(a), split(b));
    let lo = a_lo * b_lo - (((hi - a_hi * b_hi) - a_lo * b_hi) - a_hi * b_lo);
    DoubleDouble { hi, lo }
}

/// Two halves of at most 26 bits each (Veltkamp 1968).
#[inline]
fn split(a: f64) -> (f64, f64) {
    const FACTOR: f64 = 134_217_729.0; // 2^27 + 1
    let scaled = FACTOR * a;
    let hi = scaled - (scaled - a);
    (hi, a - hi)
}

impl Add for DoubleDouble {
    type Output = Self;
    /// Joldes, Muller and Popescu, algorithm 6: accurate under cancellation too.
    #[inline]
    fn add(self, rhs: Self) -> Self {
        let high = two_sum(self.hi, rhs.hi);
        let low = two_sum(self.lo, rhs.lo);
        let sum = quick_two_sum(high.hi, high.lo + low.hi);
        quick_two_sum(sum.hi, low.lo + sum.lo)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        self + -rhs
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    /// Joldes, Muller and Popescu, algorithm 10.
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        let high = two_prod(self.hi, rhs.hi);
        let cross = self.hi * rhs.lo + self.lo * rhs.hi;
        quick_two_sum(high.hi, high.lo + cross)
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    /// Long division: three quotients of 53 bits, each from the remainder the ones before it leave.
    #[inline]
    fn div(self, rhs: Self) -> Self {
        let first = self.hi / rhs.hi;
        let mut remainder = self - rhs.scaled(first);
        let second = remainder.hi / rhs.hi;
        remainder -= rhs.scaled(second);
        let third = remainder.hi / rhs.hi;
        quick_two_sum(first, second) + Self::from_f64(third)
    }
}

impl AddAssign for DoubleDouble {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl SubAssign for DoubleDouble {
    #[inline]
    fn sub_assign(&mut self, rhs: Self) {
        *self = *self - rhs;
    }
}

impl Number for DoubleDouble {
    single_lane!();

    const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    const ONE: Self = Self { hi: 1.0, lo: 0.0 };
    const HALF: Self = Self { hi: 0.5, lo: 0.0 };
    /// 2^-102: half of it bounds the error of one operation.
    const EPSILON: Self = Self {
        hi: f64::EPSILON * f64::EPSILON * 4.0,
        lo: 0.0,
    };

    #[inline]
    fn from_f64(value: f64) -> Self {
        Self { hi: value, lo: 0.0 }
    }

    /// One Newton step from the f64 root, whose square is subtracted exactly.
    #[inline]
    fn sqrt(self) -> Self {
        let root = self.hi.sqrt();
        if root == 0.0 {
            return Self::ZERO;
        }
        let square = two_prod(root, root);
        let remainder = ((self.hi - square.hi) - square.lo) + self.lo;
        quick_two_sum(root, remainder / (2.0 * root))
    }

    #[inline]
    fn abs(self) -> Self {
        if self.hi < 0.0 { -self } else { self }
    }

    fn sin_cos_of(angle: f64) -> (Self, Self) {
        Self::from_f64(angle).sin_cos()
    }

    fn rotation_of(quaternion: [f64; 4]) -> Mat3<Self> {
        normalized_rotation(quaternion.map(Self::from_f64))
    }

    #[inline]
    fn is_finite(self) -> bool {
        self.hi.is_finite() && self.lo.is_finite()
    }
}

impl Real for DoubleDouble {
    type Wide = Self;

    #[inline]
    fn narrow(wide: Self) -> Self {
        wide
    }

    #[inline]
    fn to_f64(self) -> f64 {
        // `hi` unless an overflow has left the parts at odds.
        self.hi + self.lo
    }

    #[inline]
    fn widen(self) -> Self {
        self
    }

    #[inline]
    fn cast<U: Real>(self) -> U {
        U::from_f64(self.hi) + U::from_f64(self.lo)
    }

    fn sin_cos(self) -> (Self, Self) {
        sin_cos(self)
    }

    /// One Newton step from the f64 angle a: tan(angle - a) = (y cos a - x sin a)/(x cos a + y sin a),
    /// of the order of 1e-16, where the tangent is its argument to 50 digits. 0 at the origin.
    fn atan2(self, other: Self) -> Self {
        let (y, x) = (self, other);
        if y == Self::ZERO && x == Self::ZERO {
            return Self::ZERO;
        }
        let start = Self::from_f64(y.hi.atan2(x.hi));
        let (sin, cos) = sin_cos(start);
        start + (y * cos - x * sin) / (x * cos + y * sin)
    }
}

/// pi/2 as the sum of four f64, to 212 bits.
const HALF_PI: [f64; 4] = [
    core::f64::consts::FRAC_PI_2,
    6.123_233_995_736_766e-17,
    -1.497_384_904_859_169_8e-33,
    5.562_271_104_316_826e-50,
];

/// Angles beyond this, where neighbouring f64 lie a radian apart, get the functions of f64.
const LARGEST_ANGLE: f64 = 4_503_599_627_370_496.0; // 2^52

/// Sine and cosine, each to a few units of 2^-104 absolutely, and relatively for |x| <= pi/4.
///
/// x = k pi/2 + r with |r| <= pi/4: k times each part of pi/2 is an exact double-double, and their
/// difference loses 3 u^2 of |x| 2^-53 at most. Then the Taylor series, nested:
/// sin r = r (1 - r^2/(2 3) (1 - r^2/(4 5) (...))), cos r = 1 - r^2/(1 2) (1 - r^2/(3 4) (...)).
/// The first terms left out are (pi/4)^31/31! and (pi/4)^30/30!, below 2^-123 and 2^-118.
fn sin_cos(x: DoubleDouble) -> (DoubleDouble, DoubleDouble) {
    let reducible = x.hi.abs() < LARGEST_ANGLE;
    if !reducible {
        let (sin, cos) = x.hi.sin_cos();
        return (DoubleDouble::from_f64(sin), DoubleDouble::from_f64(cos));
    }
    let turns = (x.hi * core::f64::consts::FRAC_2_PI).round();
    let mut r = x;
    for part in HALF_PI {
        r -= two_prod(turns, part);
    }
    let square = r * r;
    let nested = |first: u32| {
        let mut sum = DoubleDouble::ONE;
        for step in (0..14).rev() {
            let a = f64::from(first + 2 * step);
            sum = DoubleDouble::ONE - square * sum / DoubleDouble::from_f64(a * (a + 1.0));
        }
        sum
    };
    let (sin, cos) = (r * nested(2), nested(1));
    match turns.rem_euclid(4.0) {
        0.0 => (sin, cos),
        1.0 => (cos, -sin),
        2.0 => (-sin, -cos),
        _ => (-cos, sin),
    }
}
