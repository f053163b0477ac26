//! Numbers as devices keep them.

use bytemuck::Pod;
use vertebra_shaders::Precision;

/// A floating-point type of WGSL.
pub(super) trait Scalar: Pod {
    const PRECISION: Precision;

    fn from_f64(value: f64) -> Self;
    fn to_f64(self) -> f64;
}

impl Scalar for f32 {
    const PRECISION: Precision = Precision::F32;

    #[expect(clippy::cast_possible_truncation, reason = "to the nearest")]
    fn from_f64(value: f64) -> Self {
        value as Self
    }

    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Scalar for f64 {
    const PRECISION: Precision = Precision::F64;

    fn from_f64(value: f64) -> Self {
        value
    }

    fn to_f64(self) -> f64 {
        self
    }
}
