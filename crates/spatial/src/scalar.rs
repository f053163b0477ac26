//! The scalar an algorithm is written for, once.

use crate::sin_cos::{sin_cos, sin_cos_each};
use crate::{Mat3, Quat};
use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

pub(crate) mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
    impl Sealed for crate::DoubleDouble {}
}

/// What the solvers' sweeps compute with: a [`Real`] number, or several of one type side by side
/// ([`Lanes`](crate::Lanes)), on which all operations act lane by lane.
///
/// Sealed: precision is an option of a solver, not something its user implements.
pub trait Number:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialEq
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
    /// The number in one lane; the type itself if it has only one.
    type Scalar: Real;
    /// f64 in as many lanes, in which positions, rates and forces are given.
    type Input: Number<Scalar = f64>;

    /// How many numbers it holds.
    const LANES: usize;
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 1/2.
    const HALF: Self;
    /// Twice the unit roundoff, which bounds the relative error of one operation.
    const EPSILON: Self;

    /// The same number in every lane.
    fn splat(value: Self::Scalar) -> Self;
    /// The number in a lane, counted from 0; any lane beyond the last is the last.
    fn lane(self, lane: usize) -> Self::Scalar;
    /// Replaces the number in a lane, as [`lane`](Self::lane) counts them.
    fn set_lane(&mut self, lane: usize, value: Self::Scalar);
    /// The nearest number of this type, in every lane.
    fn from_f64(value: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(value))
    }
    /// The nearest number of this type, lane by lane.
    fn from_input(input: Self::Input) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Sine and cosine of an angle given in f64 \[rad\], accurate in this precision: rounding a large
    /// angle first would lose the digits that matter.
    fn sin_cos_of(angle: Self::Input) -> (Self, Self);
    /// [`sin_cos_of`](Self::sin_cos_of) of several angles, as many as there are and there is room for.
    #[inline]
    fn sin_cos_of_each(angles: &[Self::Input], results: &mut [(Self, Self)]) {
        for (result, &angle) in results.iter_mut().zip(angles) {
            *result = Self::sin_cos_of(angle);
        }
    }
    /// Rotation matrix of a quaternion x, y, z, w of about unit length, computed in f64 at least.
    fn rotation_of(quaternion: [Self::Input; 4]) -> Mat3<Self>;
    /// Neither infinite nor NaN, in every lane.
    fn is_finite(self) -> bool;
    /// Finite and greater than `floor`, in every lane.
    fn exceeds(self, floor: Self) -> bool;
}

/// A real number type in which the algorithms run: `f32`, `f64` or
/// [`DoubleDouble`](crate::DoubleDouble).
pub trait Real: Number<Scalar = Self, Input = f64> + PartialOrd {
    /// The same precision, f64 at least: for constants, which are rounded once they are complete,
    /// for sums, and for measuring errors.
    type Wide: Real<Wide = Self::Wide>;

    /// The nearest number of this type.
    fn narrow(wide: Self::Wide) -> Self;
    /// The same number, or the nearest one, in f64.
    fn to_f64(self) -> f64;
    /// The same number.
    fn widen(self) -> Self::Wide;
    /// The nearest number of another type.
    fn cast<U: Real>(self) -> U;
    /// Sine and cosine of an angle \[rad\].
    fn sin_cos(self) -> (Self, Self);
    /// Four-quadrant arctangent of `self / other` \[rad\].
    fn atan2(self, other: Self) -> Self;
}

/// What a [`Real`] is as a [`Number`] of one lane.
macro_rules! single_lane {
    () => {
        type Scalar = Self;
        type Input = f64;

        const LANES: usize = 1;

        #[inline]
        fn splat(value: Self) -> Self {
            value
        }
        #[inline]
        fn lane(self, _lane: usize) -> Self {
            self
        }
        #[inline]
        fn set_lane(&mut self, _lane: usize, value: Self) {
            *self = value;
        }
        #[inline]
        fn from_input(input: f64) -> Self {
            Self::from_f64(input)
        }
        #[inline]
        fn exceeds(self, floor: Self) -> bool {
            self > floor && self.is_finite()
        }
    };
}
pub(crate) use single_lane;

/// Rotation matrix of a quaternion x, y, z, w after division by its length.
#[inline]
pub(crate) fn normalized_rotation<T: Number>([x, y, z, w]: [T; 4]) -> Mat3<T> {
    Quat::from_xyzw(x, y, z, w).normalized().to_matrix()
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding to the working precision is the purpose"
)]
#[inline]
pub(crate) fn round_to_f32(value: f64) -> f32 {
    value as f32
}

macro_rules! impl_real {
    ($scalar:ident, $round:expr) => {
        impl Number for $scalar {
            single_lane!();

            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const HALF: Self = 0.5;
            const EPSILON: Self = Self::EPSILON;

            #[inline]
            fn from_f64(value: f64) -> Self {
                $round(value)
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
            fn sin_cos_of(angle: f64) -> (Self, Self) {
                let (sin, cos) = sin_cos(angle);
                ($round(sin), $round(cos))
            }
            #[inline]
            fn sin_cos_of_each(angles: &[f64], results: &mut [(Self, Self)]) {
                for (angles, results) in angles.chunks(8).zip(results.chunks_mut(8)) {
                    let mut padded = [0.0; 8];
                    padded[..angles.len()].copy_from_slice(angles);
                    let (sines, cosines) = sin_cos_each(&padded);
                    for ((result, sin), cos) in results.iter_mut().zip(sines).zip(cosines) {
                        *result = ($round(sin), $round(cos));
                    }
                }
            }
            #[inline]
            fn rotation_of(quaternion: [f64; 4]) -> Mat3<Self> {
                normalized_rotation(quaternion).map($round)
            }
            #[inline]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
        }

        impl Real for $scalar {
            type Wide = f64;

            #[inline]
            fn narrow(wide: f64) -> Self {
                $round(wide)
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
            fn cast<U: Real>(self) -> U {
                U::from_f64(f64::from(self))
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                Self::sin_cos_of(f64::from(self))
            }
            #[inline]
            fn atan2(self, other: Self) -> Self {
                self.atan2(other)
            }
        }
    };
}

impl_real!(f32, round_to_f32);
impl_real!(f64, core::convert::identity);
