//! Unit quaternions: rotation, exponential and logarithm, integration.

use crate::{Mat3, Number, Real, Vec3, vec3};
use core::ops::Mul;
use glam::DQuat;

/// A quaternion `x i + y j + z k + w`; of unit length where it stands for a rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quat<T> {
    /// Vector part.
    pub v: Vec3<T>,
    /// Scalar part.
    pub w: T,
}

impl<T: Number> Quat<T> {
    /// No rotation.
    pub const IDENTITY: Self = Self {
        v: Vec3::ZERO,
        w: T::ONE,
    };

    /// From components in the order x, y, z, w.
    #[inline]
    #[must_use]
    pub fn from_xyzw(x: T, y: T, z: T, w: T) -> Self {
        Self {
            v: vec3(x, y, z),
            w,
        }
    }

    /// Rounds a glam quaternion to this precision.
    #[inline]
    #[must_use]
    pub fn from_glam(q: DQuat) -> Self {
        Self::from_xyzw(
            T::from_f64(q.x),
            T::from_f64(q.y),
            T::from_f64(q.z),
            T::from_f64(q.w),
        )
    }

    /// The quaternion as a glam quaternion.
    #[inline]
    #[must_use]
    pub fn to_glam(self) -> DQuat
    where
        T: Real,
    {
        let v = self.v.to_glam();
        DQuat::from_xyzw(v.x, v.y, v.z, self.w.to_f64())
    }

    /// Euclidean length of the four components.
    #[inline]
    #[must_use]
    pub fn length(self) -> T {
        (self.v.length_squared() + self.w * self.w).sqrt()
    }

    /// The quaternion divided by its length, which must not be zero.
    #[inline]
    #[must_use]
    pub fn normalized(self) -> Self {
        let scale = T::ONE / self.length();
        Self {
            v: self.v * scale,
            w: self.w * scale,
        }
    }

    /// The inverse rotation.
    #[inline]
    #[must_use]
    pub fn conjugate(self) -> Self {
        Self {
            v: -self.v,
            w: self.w,
        }
    }

    /// Exponential map: the rotation by `|r|` radians about `r`.
    ///
    /// exp(r) = [sin(|r|/2) r/|r|, cos(|r|/2)]. Near zero sin(h)/|r| with h = |r|/2 is its series
    /// 1/2 - |r|^2/48 + |r|^4/3840, whose next term is below the unit roundoff where it is used.
    #[inline]
    #[must_use]
    pub fn exp(r: Vec3<T>) -> Self
    where
        T: Real,
    {
        let square = r.length_squared();
        let angle = square.sqrt();
        let (sin, cos) = (angle * T::HALF).sin_cos();
        let series_limit = T::EPSILON.sqrt().sqrt();
        let scale = if angle < series_limit {
            T::HALF - square * (T::ONE / T::from_f64(48.0) - square / T::from_f64(3840.0))
        } else {
            sin / angle
        };
        Self {
            v: r * scale,
            w: cos,
        }
    }

    /// Logarithm: the rotation vector \[rad\] of length at most pi whose [`exp`](Self::exp) this is,
    /// up to the sign of the quaternion.
    #[inline]
    #[must_use]
    pub fn log(self) -> Vec3<T>
    where
        T: Real,
    {
        let sine = self.v.length();
        // q and -q are the same rotation; the one with w >= 0 is the short way round.
        let (v, w) = if self.w < T::ZERO {
            (-self.v, -self.w)
        } else {
            (self.v, self.w)
        };
        let two = T::from_f64(2.0);
        if sine == T::ZERO {
            return v * two;
        }
        v * (two * sine.atan2(w) / sine)
    }

    /// Moves an orientation by the angular displacement `r` \[rad\] given in the turning frame's own
    /// axes: q exp(r), renormalised.
    #[inline]
    #[must_use]
    pub fn integrate(self, r: Vec3<T>) -> Self
    where
        T: Real,
    {
        (self * Self::exp(r)).normalized()
    }

    /// The rotation matrix of a unit quaternion.
    #[inline]
    #[must_use]
    pub fn to_matrix(self) -> Mat3<T> {
        let two = T::from_f64(2.0);
        let (x, y, z, w) = (self.v.x, self.v.y, self.v.z, self.w);
        let (x2, y2, z2) = (two * x, two * y, two * z);
        let (xx, yy, zz) = (x * x2, y * y2, z * z2);
        let (xy, xz, yz) = (x * y2, x * z2, y * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        Mat3::from_cols(
            vec3(T::ONE - yy - zz, xy + wz, xz - wy),
            vec3(xy - wz, T::ONE - xx - zz, yz + wx),
            vec3(xz + wy, yz - wx, T::ONE - xx - yy),
        )
    }
}

/// The Hamilton product: `a * b` turns by b first, then by a.
impl<T: Number> Mul for Quat<T> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        Self {
            v: rhs.v * self.w + self.v * rhs.w + self.v.cross(rhs.v),
            w: self.w * rhs.w - self.v.dot(rhs.v),
        }
    }
}

/// The inverse of the differential of the exponential map on rotations, to third order.
///
/// Where R(t) = R0 exp(u(t)) turns with angular velocity `w` in its own axes,
/// du/dt = w + u x w / 2 + u x (u x w) / 12 + O(|u|^4 |w|), the Bernoulli series (Hairer, Lubich and
/// Wanner, Geometric Numerical Integration, III.4, for right multiplication). A fourth-order
/// method needs no more terms: |u| is of the order of the step.
#[inline]
#[must_use]
pub fn rotation_vector_rate<T: Number>(u: Vec3<T>, w: Vec3<T>) -> Vec3<T> {
    let uw = u.cross(w);
    w + uw * T::HALF + u.cross(uw) * (T::ONE / T::from_f64(12.0))
}
