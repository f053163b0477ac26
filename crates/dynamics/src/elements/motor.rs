//! Motors, and servos of spherical joints.

use crate::Error;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// What drives a joint with one freedom, by a force between `-limit` and `limit`:
///
/// ```text
/// force + stiffness (position - q) + damping (rate - qd)
/// ```
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
        for (quantity, value) in [
            ("force of the motor", self.force),
            ("target position of the motor", self.position),
            ("target rate of the motor", self.rate),
        ] {
            check_finite(body, quantity, value)?;
        }
        check_gains(body, [self.stiffness, self.damping, self.limit])
    }
}

impl Default for Motor {
    fn default() -> Self {
        Self::OFF
    }
}

/// What drives a spherical joint, by a torque no larger than `limit`:
///
/// ```text
/// torque + stiffness r + damping (rate - w)
/// ```
///
/// with r the rotation vector from where the child is to `orientation`, the short way. All in the axes of the child's
/// joint frame, as the joint's rates w are.
///
/// Steps of [`Integrator::SemiImplicitEuler`](crate::Integrator::SemiImplicitEuler) take orientation and rate at the
/// end of the step, the former to first order in what the step turns, so that no gains are too stiff for it.
///
/// ```
/// use glam::DQuat;
/// use vertebra_assembly::{Joint, MassProperties, ModelDescription};
/// use vertebra_dynamics::{Simulation, SphericalMotor};
///
/// let arm = MassProperties::rod(2.0, 0.4, 0.03);
/// let model = ModelDescription::new("shoulder").body("arm", None, Joint::spherical(), arm).build()?;
/// let body = model.last_body();
/// let mut simulation = Simulation::new(model)?;
/// let raised = DQuat::from_rotation_y(1.2);
/// simulation.set_spherical_motor(body, SphericalMotor::orientation(raised, 2e4, 2e3))?;
/// for _ in 0..1000 {
///     simulation.step(1e-3)?;
/// }
/// let found = DQuat::from_slice(&simulation.state()?.q);
/// assert!(found.angle_between(raised) < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SphericalMotor {
    /// Torque whatever the orientation [N m].
    pub torque: DVec3,
    /// Orientation it strives for, from the child's joint frame to the parent's.
    pub orientation: DQuat,
    /// Rate it strives for [rad/s].
    pub rate: DVec3,
    /// Torque an angle [N m/rad].
    pub stiffness: f64,
    /// Torque a rate [N m s/rad].
    pub damping: f64,
    /// Largest torque [N m]; infinite for no bound but the joint's own
    /// ([`JointLimits::effort`](vertebra_assembly::JointLimits::effort)).
    pub limit: f64,
}

impl SphericalMotor {
    /// No torque.
    pub const OFF: Self = Self {
        torque: DVec3::ZERO,
        orientation: DQuat::IDENTITY,
        rate: DVec3::ZERO,
        stiffness: 0.0,
        damping: 0.0,
        limit: f64::INFINITY,
    };

    /// A given torque [N m].
    #[must_use]
    pub const fn torque(torque: DVec3) -> Self {
        Self {
            torque,
            ..Self::OFF
        }
    }

    /// Strives for a rate [rad/s] with a gain [N m s/rad].
    #[must_use]
    pub const fn velocity(rate: DVec3, gain: f64) -> Self {
        Self {
            rate,
            damping: gain,
            ..Self::OFF
        }
    }

    /// Strives for an orientation with a stiffness [N m/rad] and a damping [N m s/rad] (a PD controller).
    #[must_use]
    pub const fn orientation(orientation: DQuat, stiffness: f64, damping: f64) -> Self {
        Self {
            orientation,
            stiffness,
            damping,
            ..Self::OFF
        }
    }

    /// Strives for a rate [rad/s] too, as one that follows a motion does.
    #[must_use]
    pub const fn at_rate(mut self, rate: DVec3) -> Self {
        self.rate = rate;
        self
    }

    /// Bounds the torque [N m].
    #[must_use]
    pub const fn limited(mut self, limit: f64) -> Self {
        self.limit = limit;
        self
    }

    /// Whether it does nothing whatever the state.
    pub(super) fn is_off(&self) -> bool {
        self.torque == DVec3::ZERO && self.stiffness == 0.0 && self.damping == 0.0
    }

    pub(super) fn check(&self, body: &str) -> Result<(), Error> {
        for (quantity, vector) in [
            ("torque of the motor", self.torque),
            ("target rate of the motor", self.rate),
        ] {
            for value in vector.to_array() {
                check_finite(body, quantity, value)?;
            }
        }
        let length = self.orientation.length();
        if length.is_nan() || (length - 1.0).abs() > UNIT {
            return Err(Error::BadMotor {
                body: body.to_owned(),
                quantity: "length of the quaternion that the motor strives for",
                value: length,
            });
        }
        check_gains(body, [self.stiffness, self.damping, self.limit])
    }
}

impl Default for SphericalMotor {
    fn default() -> Self {
        Self::OFF
    }
}

/// How far from 1 a quaternion's length may be.
const UNIT: f64 = 1e-6;

fn check_finite(body: &str, quantity: &'static str, value: f64) -> Result<(), Error> {
    if value.is_finite() {
        return Ok(());
    }
    Err(Error::BadMotor {
        body: body.to_owned(),
        quantity,
        value,
    })
}

/// Stiffness, damping and limit, of which the last may be infinite.
fn check_gains(body: &str, [stiffness, damping, limit]: [f64; 3]) -> Result<(), Error> {
    for (quantity, value, most) in [
        ("stiffness of the motor", stiffness, f64::MAX),
        ("damping of the motor", damping, f64::MAX),
        ("limit of the motor", limit, f64::INFINITY),
    ] {
        // NaN is in no range.
        if !(0.0..=most).contains(&value) {
            return Err(Error::BadMotor {
                body: body.to_owned(),
                quantity,
                value,
            });
        }
    }
    Ok(())
}
