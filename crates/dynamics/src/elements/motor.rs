//! Motors.

use crate::Error;
use serde::{Deserialize, Serialize};

/// What drives a joint with one freedom: force = `force` + `stiffness` (`position` - q)
/// + `damping` (`rate` - qd), between -`limit` and `limit`.
///
/// Steps of [`Integrator::SemiImplicitEuler`](crate::Integrator::SemiImplicitEuler) take position and
/// rate at the end of the step, so that no gains are too stiff for it; a motor that its limit holds back
/// exerts that limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Force whatever the position [N m or N].
    pub force: f64,
    /// Position it strives for [rad or m].
    pub position: f64,
    /// Rate it strives for [rad/s or m/s].
    pub rate: f64,
    /// Force a displacement [N m/rad or N/m].
    pub stiffness: f64,
    /// Force a rate [N m s/rad or N s/m].
    pub damping: f64,
    /// Largest force [N m or N]; infinite for no bound but the joint's own
    /// ([`JointLimits::effort`](vertebra_assembly::JointLimits::effort)).
    pub limit: f64,
}

impl Motor {
    /// No force.
    pub const OFF: Self = Self {
        force: 0.0,
        position: 0.0,
        rate: 0.0,
        stiffness: 0.0,
        damping: 0.0,
        limit: f64::INFINITY,
    };

    /// A given force [N m or N].
    #[must_use]
    pub const fn torque(force: f64) -> Self {
        Self { force, ..Self::OFF }
    }

    /// Strives for a rate [rad/s or m/s] with a gain [N m s/rad or N s/m].
    #[must_use]
    pub const fn velocity(rate: f64, gain: f64) -> Self {
        Self {
            rate,
            damping: gain,
            ..Self::OFF
        }
    }

    /// Strives for a position [rad or m] with a stiffness [N m/rad or N/m] and a damping
    /// [N m s/rad or N s/m] (a PD controller).
    #[must_use]
    pub const fn position(position: f64, stiffness: f64, damping: f64) -> Self {
        Self {
            position,
            stiffness,
            damping,
            ..Self::OFF
        }
    }

    /// Bounds the force [N m or N].
    #[must_use]
    pub const fn limited(mut self, limit: f64) -> Self {
        self.limit = limit;
        self
    }

    /// Whether it does nothing whatever the state.
    pub(super) fn is_off(&self) -> bool {
        self.force == 0.0 && self.stiffness == 0.0 && self.damping == 0.0
    }

    pub(super) fn check(&self, body: &str) -> Result<(), Error> {
        for (quantity, value, may_be_negative) in [
            ("force of the motor", self.force, true),
            ("target position of the motor", self.position, true),
            ("target rate of the motor", self.rate, true),
            ("stiffness of the motor", self.stiffness, false),
            ("damping of the motor", self.damping, false),
        ] {
            if !value.is_finite() || (value < 0.0 && !may_be_negative) {
                return Err(Error::BadMotor {
                    body: body.to_owned(),
                    quantity,
                    value,
                });
            }
        }
        // A limit may be infinite, but no NaN.
        if self.limit >= 0.0 {
            return Ok(());
        }
        Err(Error::BadMotor {
            body: body.to_owned(),
            quantity: "limit of the motor",
            value: self.limit,
        })
    }
}

impl Default for Motor {
    fn default() -> Self {
        Self::OFF
    }
}
