//! What errors are measured by where loads balance.
//!
//! Errors of joint accelerations are relative to the largest of them. In equilibrium (a model that hangs or is
//! held, a body that turns steadily) there is none to speak of: what is left is the rounding of the loads, of
//! which no digit means anything, and no precision has a small error beside it. So errors are never measured by
//! less than the loads cause where nothing balances them: the acceleration of gravity, the square of the
//! largest rate, and the largest push over the mass of the whole, each in the model's units of length and time.
//! Forces in joints need not be counted. They accelerate something unless one of the others balances them.
//!
//! In the same way what is left of equations is measured by no less than [`least_forces`].

use crate::Forces;
use crate::link::Scales;
use vertebra_assembly::{JointKind, Model};

/// The least joint acceleration that errors are measured by [rad/s^2 or m/s^2], for rates in SI and pushes as
/// [`largest_push`] has them.
pub(crate) fn least_acceleration(model: &Model, scales: &Scales, qd: &[f64], push: f64) -> f64 {
    let rates = qd
        .iter()
        .zip(&scales.rate)
        .map(|(qd, scale)| (qd * scale).abs());
    let rate = rates.fold(0.0, f64::max);
    let least = gravity(model).max(rate * rate).max(push);
    (scales.acceleration.iter()).fold(0.0, |largest, scale| largest.max(least * scale))
}

/// The least force that what is left of each body's equations is measured by: the largest weight, of itself and of the bodies whose
/// forces its joint transmits, in the model's units.
///
/// Accelerations are computed without gravity, so that of what only falls all terms of the equations are rounding of these: of a
/// body's own weight, and where it has little or none, of those that it carries.
pub(crate) fn least_forces(model: &Model) -> Vec<f64> {
    let gravity = gravity(model);
    let bodies = model.bodies();
    let own = bodies
        .iter()
        .map(|body| body.mass.mass / model.units().mass * gravity);
    let mut least: Vec<f64> = own.collect();
    for (index, body) in bodies.iter().enumerate().rev() {
        if let Some(parent) = body.parent
            && body.joint.kind != JointKind::Free
        {
            least[parent.index()] = least[parent.index()].max(least[index]);
        }
    }
    least
}

/// Its acceleration in the model's units.
fn gravity(model: &Model) -> f64 {
    model.gravity().length() / model.units().acceleration()
}

/// The largest acceleration that an external force alone would give a mass like the whole model's, in the
/// model's units.
pub(crate) fn largest_push(model: &Model, forces: &Forces) -> f64 {
    let units = model.units();
    let masses = model
        .bodies()
        .iter()
        .map(|body| body.mass.mass / units.mass);
    let largest = forces.acting().fold(0.0_f64, |largest, (_, wrench)| {
        let force = wrench.force.length() / units.force();
        largest
            .max(force)
            .max(wrench.torque.length() / units.energy())
    });
    if largest == 0.0 {
        0.0
    } else {
        largest / masses.sum::<f64>()
    }
}
