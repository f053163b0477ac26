//! The scalar an algorithm is written for, once.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
    impl Sealed for crate::DoubleDouble {}
}

/// A real number type in which the algorithms run: `f32`, `f64` or
/// [`DoubleDouble`](crate::DoubleDouble).
///
/// Sealed: precision is an option of a solver, not something its user implements.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + SubAssign
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// The same precision, f64 at least: for constants, which are rounded once they are complete,
    /// for sums, and for measuring errors.
    type Wide: Real<Wide = Self::Wide>;

    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 1/2.
    const HALF: Self;
    /// Twice the unit roundoff, which bounds the relative error of one operation.
    const EPSILON: Self;

    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;
    /// The same number, or the nearest one, in f64.
    fn to_f64(self) -> f64;
    /// The same number.
    fn widen(self) -> Self::Wide;
    /// The nearest number of this type.
    fn narrow(wide: Self::Wide) -> Self;
    /// The nearest number of another type.
    fn cast<U: Real>(self) -> U;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Sine and cosine of an angle \[rad\].
    fn sin_cos(self) -> (Self, Self);
    /// Sine and cosine of an angle given in f64 \[rad\], accurate in this precision: rounding a large
    /// angle first would lose the digits that matter.
    fn sin_cos_of(angle: f64) -> (Self, Self);
    /// [`sin_cos_of`](Self::sin_cos_of) of several angles, as many as there are and there is room for.
    fn sin_cos_of_each(angles: &[f64], results: &mut [(Self, Self)]) {
        for (result, &angle) in results.iter_mut().zip(angles) {
            *result = Self::sin_cos_of(angle);
        }
    }
    /// Four-quadrant arctangent of `self / other` \[rad\].
    fn atan2(self, other: Self) -> Self;
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding to the working precision is the purpose"
)]
#[inline]
fn round_to_f32(value: f64) -> f32 {
    value as f32
}

macro_rules! impl_real {
    ($scalar:ident, $round:expr) => {
        impl Real for $scalar {
            type Wide = f64;

            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const HALF: Self = 0.5;
            const EPSILON: Self = Self::EPSILON;

            #[inline]
            fn from_f64(value: f64) -> Self {
                $round(value)
            }
            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn widen(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn narrow(wide: f64) -> Self {
                $round(wide)
            }
            #[inline]
            fn cast<U: Real>(self) -> U {
                U::from_f64(f64::from(self))
            }
            #[inline]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                Self::sin_cos_of(f64::from(self))
            }
            #[inline]
            fn sin_cos_of(angle: f64) -> (Self, Self) {
                let (sin, cos) = crate::sin_cos::sin_cos(angle);
                ($round(sin), $round(cos))
            }
            fn sin_cos_of_each(angles: &[f64], results: &mut [(Self, Self)]) {
                for (angles, results) in angles.chunks(8).zip(results.chunks_mut(8)) {
                    let mut padded = [0.0; 8];
                    padded[..angles.len()].copy_from_slice(angles);
                    let (sines, cosines) = crate::sin_cos::sin_cos_each(&padded);
                    for ((result, sin), cos) in results.iter_mut().zip(sines).zip(cosines) {
                        *result = ($round(sin), $round(cos));
                    }
                }
            }
            #[inline]
            fn atan2(self, other: Self) -> Self {
                self.atan2(other)
            }
            #[inline]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
        }
    };
}

impl_real!(f32, round_to_f32);
impl_real!(f64, core::convert::identity);
