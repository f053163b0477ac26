//! Coordinate transforms between frames that differ in axes and origin.

use crate::{Force, Mat3, Motion, Number, Pose, Quat, Real, Vec3};
use core::ops::Mul;

/// Where frame B is, seen from frame A, ready to map vectors from B to A.
///
/// As a 6 x 6 matrix on motion vectors it is [R 0; r~ R R], with R the rotation and r the
/// translation (RBDA eq. 2.24 reads A to B).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform<T> {
    /// B's axes in A, by columns.
    pub rotation: Mat3<T>,
    /// B's origin in A.
    pub translation: Vec3<T>,
}

impl<T: Number> Transform<T> {
    /// B coincides with A.
    pub const IDENTITY: Self = Self {
        rotation: Mat3::IDENTITY,
        translation: Vec3::ZERO,
    };

    /// The pose in this precision; its quaternion's length, which must not be zero, is divided out.
    #[inline]
    #[must_use]
    pub fn from_pose(pose: &Pose) -> Self {
        Self {
            rotation: Quat::from_glam(pose.rotation).normalized().to_matrix(),
            translation: Vec3::from_glam(pose.translation),
        }
    }

    /// Applies a function to every number.
    #[inline]
    #[must_use]
    pub fn map<U: Number>(self, f: impl Fn(T) -> U) -> Transform<U> {
        Transform {
            rotation: self.rotation.map(&f),
            translation: self.translation.map(&f),
        }
    }

    /// Takes a point from B's coordinates to A's.
    #[inline]
    #[must_use]
    pub fn point(&self, p: Vec3<T>) -> Vec3<T> {
        self.rotation * p + self.translation
    }

    /// Takes a motion vector from B's coordinates and origin to A's.
    #[inline]
    #[must_use]
    pub fn motion(&self, m: Motion<T>) -> Motion<T> {
        let angular = self.rotation * m.angular;
        Motion::new(
            angular,
            self.rotation * m.linear + self.translation.cross(angular),
        )
    }

    /// Takes a force vector from B's coordinates and origin to A's.
    #[inline]
    #[must_use]
    pub fn force(&self, f: Force<T>) -> Force<T> {
        let linear = self.rotation * f.linear;
        Force::new(
            self.rotation * f.angular + self.translation.cross(linear),
            linear,
        )
    }

    /// Where A is, seen from B.
    #[inline]
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self {
            rotation: self.rotation.transpose(),
            translation: -self.rotation.transpose_mul(self.translation),
        }
    }

    /// Exponential map of a twist: the placement reached from the identity after unit time at the
    /// constant velocity `twist`, given in the moving frame.
    ///
    /// exp([w; v]) = (exp(w), V v) with V = 1 + (1 - cos t)/t^2 w~ + (t - sin t)/t^3 w~^2 and t = |w|
    /// (Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation, eq. 2.36).
    /// Below t = eps^(1/4) both coefficients are their series 1/2 - t^2/24 and 1/6 - t^2/120.
    #[inline]
    #[must_use]
    pub fn exp(twist: Motion<T>) -> Self
    where
        T: Real,
    {
        let (w, v) = (twist.angular, twist.linear);
        let square = w.length_squared();
        let angle = square.sqrt();
        let (first, second) = if angle < T::EPSILON.sqrt().sqrt() {
            (
                T::HALF - square / T::from_f64(24.0),
                T::ONE / T::from_f64(6.0) - square / T::from_f64(120.0),
            )
        } else {
            // 1 - cos t = 2 sin^2(t/2) keeps its digits for small angles.
            let (sin, _) = angle.sin_cos();
            let (half_sin, _) = (angle * T::HALF).sin_cos();
            (
                T::from_f64(2.0) * half_sin * half_sin / square,
                (angle - sin) / (square * angle),
            )
        };
        let wv = w.cross(v);
        Self {
            rotation: Quat::exp(w).to_matrix(),
            translation: v + wv * first + w.cross(wv) * second,
        }
    }
}

/// Composition: (A from B) * (B from C) = A from C.
impl<T: Number> Mul for Transform<T> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        Self {
            rotation: self.rotation * rhs.rotation,
            translation: self.point(rhs.translation),
        }
    }
}
