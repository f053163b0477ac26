//! Rigid placements at the public boundary, in f64 and SI units.

use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A rigid placement: where frame B is, seen from frame A.
///
/// A point with coordinates `x` in B has coordinates `rotation * x + translation` in A.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Orientation of B in A, a unit quaternion (x, y, z, w).
    pub rotation: DQuat,
    /// Origin of B in A \[m\].
    pub translation: DVec3,
}

impl Pose {
    /// B coincides with A.
    pub const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        translation: DVec3::ZERO,
    };

    /// A placement from its rotation and translation \[m\].
    #[must_use]
    pub const fn new(rotation: DQuat, translation: DVec3) -> Self {
        Self {
            rotation,
            translation,
        }
    }

    /// A placement without rotation \[m\].
    #[must_use]
    pub const fn from_translation(translation: DVec3) -> Self {
        Self::new(DQuat::IDENTITY, translation)
    }

    /// A placement without translation.
    #[must_use]
    pub const fn from_rotation(rotation: DQuat) -> Self {
        Self::new(rotation, DVec3::ZERO)
    }

    /// The placement of A seen from B.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self::new(rotation, -(rotation * self.translation))
    }

    /// The rotation as a matrix whose columns are B's axes in A.
    #[must_use]
    pub fn matrix(&self) -> DMat3 {
        DMat3::from_quat(self.rotation)
    }

    /// Takes a point from B's coordinates to A's \[m\].
    #[must_use]
    pub fn transform_point(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// Whether every number is finite and the quaternion has unit length to 1e-6.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.translation.is_finite()
            && self.rotation.is_finite()
            && (self.rotation.length() - 1.0).abs() <= 1e-6
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// Composition: (A from B) * (B from C) = A from C.
impl core::ops::Mul for Pose {
    type Output = Self;

    fn mul(self, rhs: Self) -> Self {
        Self::new(
            (self.rotation * rhs.rotation).normalize(),
            self.rotation * rhs.translation + self.translation,
        )
    }
}
