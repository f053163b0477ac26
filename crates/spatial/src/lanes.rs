//! Several numbers side by side.

use crate::scalar::{normalized_rotation, round_to_f32, sealed::Sealed};
use crate::sin_cos::sin_cos_each;
use crate::{Mat3, Number, Real};
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `N` numbers of one type, each in its lane; operations act on every lane alike and round as they do
/// on a single number, so that a lane of a result has the bits it would have alone.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes<T, const N: usize>(pub [T; N]);

impl<T, const N: usize> Sealed for Lanes<T, N> {}

impl<T: Real, const N: usize> Default for Lanes<T, N> {
    fn default() -> Self {
        Self([T::ZERO; N])
    }
}

impl<T: Real, const N: usize> Lanes<T, N> {
    #[inline(always)]
    fn each(self, rhs: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut result = [T::ZERO; N];
        for k in 0..N {
            result[k] = f(self.0[k], rhs.0[k]);
        }
        Self(result)
    }
}

macro_rules! lane_by_lane {
    ($($operation:ident $method:ident),*) => {$(
        impl<T: Real, const N: usize> $operation for Lanes<T, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, rhs: Self) -> Self {
                self.each(rhs, T::$method)
            }
        }
    )*};
}
lane_by_lane!(Add add, Sub sub, Mul mul, Div div);

impl<T: Real, const N: usize> AddAssign for Lanes<T, N> {
    #[inline(always)]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl<T: Real, const N: usize> SubAssign for Lanes<T, N> {
    #[inline(always)]
    fn sub_assign(&mut self, rhs: Self) {
        *self = *self - rhs;
    }
}

impl<T: Real, const N: usize> Neg for Lanes<T, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(T::neg))
    }
}

macro_rules! impl_lanes {
    ($scalar:ident, $round:expr) => {
        impl<const N: usize> Number for Lanes<$scalar, N> {
            type Scalar = $scalar;
            type Input = Lanes<f64, N>;

            const LANES: usize = N;
            const ZERO: Self = Self([0.0; N]);
            const ONE: Self = Self([1.0; N]);
            const HALF: Self = Self([0.5; N]);
            const EPSILON: Self = Self([$scalar::EPSILON; N]);

            #[inline(always)]
            fn splat(value: $scalar) -> Self {
                Self([value; N])
            }
            #[inline(always)]
            fn lane(self, lane: usize) -> $scalar {
                self.0[lane.min(N - 1)]
            }
            #[inline(always)]
            fn set_lane(&mut self, lane: usize, value: $scalar) {
                self.0[lane.min(N - 1)] = value;
            }
            #[inline(always)]
            fn from_input(input: Lanes<f64, N>) -> Self {
                Self(input.0.map($round))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(self.0.map($scalar::sqrt))
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(self.0.map($scalar::abs))
            }
            #[inline(always)]
            fn sin_cos_of(angle: Lanes<f64, N>) -> (Self, Self) {
                let (sines, cosines) = sin_cos_each(&angle.0);
                (
                    Self::from_input(Lanes(sines)),
                    Self::from_input(Lanes(cosines)),
                )
            }
            #[inline(always)]
            fn rotation_of(quaternion: [Lanes<f64, N>; 4]) -> Mat3<Self> {
                normalized_rotation(quaternion).map(Self::from_input)
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                self.0.iter().fold(true, |all, x| all & x.is_finite())
            }
            #[inline(always)]
            fn exceeds(self, floor: Self) -> bool {
                let pairs = self.0.iter().zip(&floor.0);
                pairs.fold(true, |all, (x, floor)| all & (x > floor) & x.is_finite())
            }
        }
    };
}

impl_lanes!(f32, round_to_f32);
impl_lanes!(f64, core::convert::identity);
