//! Force vectors: wrenches and momenta.

use crate::{Number, Vec3};
use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// A spatial force vector, angular part first: moment about the origin [N m] and force \[N\], or
/// angular [N m s] and linear momentum [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Force<T> {
    /// Moment about the origin.
    pub angular: Vec3<T>,
    /// Force.
    pub linear: Vec3<T>,
}

impl<T: Number> Force<T> {
    /// No force.
    pub const ZERO: Self = Self::new(Vec3::ZERO, Vec3::ZERO);

    /// A force from its moment and its force part.
    #[inline]
    #[must_use]
    pub const fn new(angular: Vec3<T>, linear: Vec3<T>) -> Self {
        Self { angular, linear }
    }

    /// Whether no component is infinite or NaN.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.angular.is_finite() && self.linear.is_finite()
    }

    /// Applies a function to every component.
    #[inline]
    #[must_use]
    pub fn map<U: Number>(self, f: impl Fn(T) -> U) -> Force<U> {
        Force::new(self.angular.map(&f), self.linear.map(&f))
    }

    /// A force given about this origin, about the point from which this origin lies at `r`:
    /// X' = [1 r~; 0 1], the transpose of [`Motion::shifted`](crate::Motion::shifted)'s X.
    #[inline]
    #[must_use]
    pub fn shifted_back(self, r: Vec3<T>) -> Self {
        Self::new(self.angular + r.cross(self.linear), self.linear)
    }
}

impl<T: Number> Add for Force<T> {
    type Output = Self;
    #[inline]
    fn add(self, rhs: Self) -> Self {
        Self::new(self.angular + rhs.angular, self.linear + rhs.linear)
    }
}

impl<T: Number> AddAssign for Force<T> {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl<T: Number> Sub for Force<T> {
    type Output = Self;
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        Self::new(self.angular - rhs.angular, self.linear - rhs.linear)
    }
}

impl<T: Number> SubAssign for Force<T> {
    #[inline]
    fn sub_assign(&mut self, rhs: Self) {
        *self = *self - rhs;
    }
}

impl<T: Number> Neg for Force<T> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.angular, -self.linear)
    }
}

impl<T: Number> Mul<T> for Force<T> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: T) -> Self {
        Self::new(self.angular * rhs, self.linear * rhs)
    }
}
