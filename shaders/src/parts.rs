//! Parts of WGSL for kernels of mechanics, over the `real` of a [`Precision`].

use crate::Precision;

/// Spatial algebra: motions, forces, inertias, changes of origin and axes.
pub const SPATIAL: &str = include_str!("../wgsl/shared/spatial.wgsl");

/// Cholesky factors of symmetric matrices of order 3 and 6. Needs [`SPATIAL`].
pub const CHOLESKY: &str = include_str!("../wgsl/shared/cholesky.wgsl");

/// Quaternions. Needs [`SPATIAL`] and [`Precision::trigonometry`].
pub const ROTATION: &str = include_str!("../wgsl/shared/rotation.wgsl");

/// The rotation vector of a quaternion. Needs [`ROTATION`].
pub const ROTATION_LOG: &str = include_str!("../wgsl/shared/rotation_log.wgsl");

/// What acts in joints: springs, dampers, rotors, friction, stops, motors. Needs [`ROTATION_LOG`] and the
/// rounding of solutions, `SOLVED_TO`, and `FIRMNESS`.
pub const ELEMENTS: &str = include_str!("../wgsl/shared/elements.wgsl");

/// Laws of spherical joints with ranges, friction and motors. Needs [`ELEMENTS`] and the precision's `EPSILON`.
pub const BALLS: &str = include_str!("../wgsl/shared/balls.wgsl");

/// Kinds of joints and their velocity products. Needs [`SPATIAL`].
pub const JOINT: &str = include_str!("../wgsl/shared/joint.wgsl");

impl Precision {
    /// Twice the unit roundoff.
    #[must_use]
    pub fn epsilon(self) -> f64 {
        match self {
            Self::F32 => f32::EPSILON.into(),
            Self::F64 => f64::EPSILON,
        }
    }

    /// The part that defines `sin_cos` and `LARGEST_ANGLE`.
    #[must_use]
    pub fn trigonometry(self) -> &'static str {
        match self {
            Self::F32 => include_str!("../wgsl/shared/trig_f32.wgsl"),
            Self::F64 => include_str!("../wgsl/shared/trig_f64.wgsl"),
        }
    }
}
