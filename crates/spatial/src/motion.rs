//! Motion vectors: velocities and accelerations.

use crate::{Force, Number, Vec3};
use core::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A spatial motion vector, angular part first: a velocity [rad/s, m/s] or an acceleration
/// [rad/s^2, m/s^2] of a body, its linear part that of the body's point at the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion<T> {
    /// Angular part.
    pub angular: Vec3<T>,
    /// Linear part.
    pub linear: Vec3<T>,
}

impl<T: Number> Motion<T> {
    /// At rest.
    pub const ZERO: Self = Self::new(Vec3::ZERO, Vec3::ZERO);

    /// A motion from its parts.
    #[inline]
    #[must_use]
    pub const fn new(angular: Vec3<T>, linear: Vec3<T>) -> Self {
        Self { angular, linear }
    }

    /// Applies a function to every component.
    #[inline]
    #[must_use]
    pub fn map<U: Number>(self, f: impl Fn(T) -> U) -> Motion<U> {
        Motion::new(self.angular.map(&f), self.linear.map(&f))
    }

    /// The same velocity, or the same derivative of one, seen at the point that lies at `r` from
    /// this origin: X = [1 0; -r~ 1] (axes unchanged).
    #[inline]
    #[must_use]
    pub fn shifted(self, r: Vec3<T>) -> Self {
        Self::new(self.angular, self.linear + self.angular.cross(r))
    }

    /// Whether no component is infinite or NaN.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.angular.is_finite() && self.linear.is_finite()
    }

    /// Power \[W\] of a force acting on this velocity; the pairing of motion and force vectors.
    #[inline]
    #[must_use]
    pub fn dot(self, force: Force<T>) -> T {
        self.angular.dot(force.angular) + self.linear.dot(force.linear)
    }

    /// The motion cross product `v x m`: the rate of a motion vector fixed in a frame that moves
    /// with velocity `self` (Featherstone's crm, RBDA eq. 2.31).
    #[inline]
    #[must_use]
    pub fn cross(self, m: Self) -> Self {
        Self::new(
            self.angular.cross(m.angular),
            self.angular.cross(m.linear) + self.linear.cross(m.angular),
        )
    }

    /// The force cross product `v x* f` (Featherstone's crf, RBDA eq. 2.32).
    #[inline]
    #[must_use]
    pub fn cross_force(self, f: Force<T>) -> Force<T> {
        Force::new(
            self.angular.cross(f.angular) + self.linear.cross(f.linear),
            self.angular.cross(f.linear),
        )
    }
}

impl<T: Number> Add for Motion<T> {
    type Output = Self;
    #[inline]
    fn add(self, rhs: Self) -> Self {
        Self::new(self.angular + rhs.angular, self.linear + rhs.linear)
    }
}

impl<T: Number> AddAssign for Motion<T> {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl<T: Number> Sub for Motion<T> {
    type Output = Self;
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        Self::new(self.angular - rhs.angular, self.linear - rhs.linear)
    }
}

impl<T: Number> Neg for Motion<T> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.angular, -self.linear)
    }
}

impl<T: Number> Mul<T> for Motion<T> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: T) -> Self {
        Self::new(self.angular * rhs, self.linear * rhs)
    }
}
