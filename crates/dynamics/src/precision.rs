//! The precision an algorithm works in.

use core::fmt;
use serde::{Deserialize, Serialize};
use vertebra_spatial::{DoubleDouble, Number};

/// Working precision of a solver. Inputs and results are f64 either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// 24-bit significand.
    F32,
    /// 53-bit significand.
    #[default]
    F64,
    /// 106-bit significand ([`DoubleDouble`]): the reference that tells the errors of the others.
    /// About fifty times slower than f64.
    Reference,
}

impl Precision {
    /// Twice the unit roundoff.
    #[must_use]
    pub const fn epsilon(self) -> f64 {
        match self {
            Self::F32 => f32::EPSILON as f64,
            Self::F64 => f64::EPSILON,
            Self::Reference => DoubleDouble::EPSILON.hi(),
        }
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
            Self::Reference => "reference",
        })
    }
}
