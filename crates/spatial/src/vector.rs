//! Three-vectors over any [`Real`].

use crate::{Number, Real};
use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};
use glam::DVec3;

/// A vector of three numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec3<T> {
    /// First component.
    pub x: T,
    /// Second component.
    pub y: T,
    /// Third component.
    pub z: T,
}

/// Builds a [`Vec3`].
#[inline]
#[must_use]
pub const fn vec3<T>(x: T, y: T, z: T) -> Vec3<T> {
    Vec3 { x, y, z }
}

impl<T: Number> Vec3<T> {
    /// All zeros.
    pub const ZERO: Self = vec3(T::ZERO, T::ZERO, T::ZERO);

    /// Rounds a glam vector to this precision.
    #[inline]
    #[must_use]
    pub fn from_glam(v: DVec3) -> Self {
        vec3(v.x, v.y, v.z).map(T::from_f64)
    }

    /// The vector as a glam vector.
    #[inline]
    #[must_use]
    pub fn to_glam(self) -> DVec3
    where
        T: Real,
    {
        DVec3::new(self.x.to_f64(), self.y.to_f64(), self.z.to_f64())
    }

    /// Applies a function to every component.
    #[inline]
    #[must_use]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Vec3<U> {
        vec3(f(self.x), f(self.y), f(self.z))
    }

    /// Inner product.
    #[inline]
    #[must_use]
    pub fn dot(self, rhs: Self) -> T {
        self.x * rhs.x + self.y * rhs.y + self.z * rhs.z
    }

    /// Cross product `self x rhs`.
    #[inline]
    #[must_use]
    pub fn cross(self, rhs: Self) -> Self {
        vec3(
            self.y * rhs.z - self.z * rhs.y,
            self.z * rhs.x - self.x * rhs.z,
            self.x * rhs.y - self.y * rhs.x,
        )
    }

    /// Sum of the squares of the components.
    #[inline]
    #[must_use]
    pub fn length_squared(self) -> T {
        self.dot(self)
    }

    /// Euclidean length.
    #[inline]
    #[must_use]
    pub fn length(self) -> T {
        self.length_squared().sqrt()
    }

    /// Component by component absolute value.
    #[inline]
    #[must_use]
    pub fn abs(self) -> Self {
        self.map(T::abs)
    }

    /// Whether no component is infinite or NaN.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
    }

    /// The components in order.
    #[inline]
    #[must_use]
    pub fn to_array(self) -> [T; 3] {
        [self.x, self.y, self.z]
    }

    /// From its components in order.
    #[inline]
    #[must_use]
    pub const fn from_array([x, y, z]: [T; 3]) -> Self {
        vec3(x, y, z)
    }
}

impl<T: Number> Add for Vec3<T> {
    type Output = Self;
    #[inline]
    fn add(self, rhs: Self) -> Self {
        vec3(self.x + rhs.x, self.y + rhs.y, self.z + rhs.z)
    }
}

impl<T: Number> AddAssign for Vec3<T> {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl<T: Number> Sub for Vec3<T> {
    type Output = Self;
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        vec3(self.x - rhs.x, self.y - rhs.y, self.z - rhs.z)
    }
}

impl<T: Number> SubAssign for Vec3<T> {
    #[inline]
    fn sub_assign(&mut self, rhs: Self) {
        *self = *self - rhs;
    }
}

impl<T: Number> Neg for Vec3<T> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        vec3(-self.x, -self.y, -self.z)
    }
}

impl<T: Number> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: T) -> Self {
        vec3(self.x * rhs, self.y * rhs, self.z * rhs)
    }
}
