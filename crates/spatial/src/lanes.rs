//! Several numbers side by side.

use crate::scalar::{normalized_rotation, sealed::Sealed};
use crate::sin_cos::sin_cos_each;
use crate::{Mat3, Number};
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use wide::{f32x8, f64x4, f64x8};

/// Numbers of one type, each in its lane of a vector `V`; operations act on every lane alike and round
/// as they do on a single number, so that a lane of a result has the bits it would have alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Lanes<V>(V);

/// Four f64.
pub type F64Lanes = Lanes<f64x4>;
/// Eight f32.
pub type F32Lanes = Lanes<f32x8>;
/// Eight f64, the positions and rates of [`F32Lanes`].
pub type WideLanes = Lanes<f64x8>;

impl<V> Sealed for Lanes<V> {}

macro_rules! operations {
    ($($operation:ident $method:ident),*) => {$(
        impl<V: $operation<Output = V>> $operation for Lanes<V> {
            type Output = Self;
            #[inline]
            fn $method(self, rhs: Self) -> Self {
                Self(self.0.$method(rhs.0))
            }
        }
    )*};
}
operations!(Add add, Sub sub, Mul mul, Div div);

impl<V: Copy + Add<Output = V>> AddAssign for Lanes<V> {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl<V: Copy + Sub<Output = V>> SubAssign for Lanes<V> {
    #[inline]
    fn sub_assign(&mut self, rhs: Self) {
        *self = *self - rhs;
    }
}

impl<V: Neg<Output = V>> Neg for Lanes<V> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

macro_rules! impl_lanes {
    ($vector:ident, $scalar:ident, $lanes:literal, $input:ident) => {
        impl Number for Lanes<$vector> {
            type Scalar = $scalar;
            type Input = Lanes<$input>;

            const LANES: usize = $lanes;
            const ZERO: Self = Self($vector::new([0.0; $lanes]));
            const ONE: Self = Self($vector::new([1.0; $lanes]));
            const HALF: Self = Self($vector::new([0.5; $lanes]));
            const EPSILON: Self = Self($vector::new([$scalar::EPSILON; $lanes]));

            #[inline]
            fn splat(value: $scalar) -> Self {
                Self($vector::new([value; $lanes]))
            }
            #[inline]
            fn lane(self, lane: usize) -> $scalar {
                self.0.to_array()[lane.min($lanes - 1)]
            }
            #[inline]
            fn set_lane(&mut self, lane: usize, value: $scalar) {
                self.0.as_mut_array()[lane.min($lanes - 1)] = value;
            }
            #[inline]
            fn from_input(input: Lanes<$input>) -> Self {
                Self($vector::new(input.0.to_array().map($scalar::from_f64)))
            }
            #[inline]
            fn sqrt(self) -> Self {
                Self(self.0.sqrt())
            }
            #[inline]
            fn abs(self) -> Self {
                Self(self.0.abs())
            }
            #[inline]
            fn sin_cos_of(angle: Lanes<$input>) -> (Self, Self) {
                let (sines, cosines) = sin_cos_each(&angle.0.to_array());
                let lanes = |values| Self::from_input(Lanes($input::new(values)));
                (lanes(sines), lanes(cosines))
            }
            #[inline]
            fn rotation_of(quaternion: [Lanes<$input>; 4]) -> Mat3<Self> {
                normalized_rotation(quaternion).map(Self::from_input)
            }
            #[inline]
            fn is_finite(self) -> bool {
                self.0.is_finite().all()
            }
            #[inline]
            fn exceeds(self, floor: Self) -> bool {
                self.0.simd_gt(floor.0).all() && self.is_finite()
            }
        }
    };
}

impl_lanes!(f64x4, f64, 4, f64x4);
impl_lanes!(f64x8, f64, 8, f64x8);
impl_lanes!(f32x8, f32, 8, f64x8);
