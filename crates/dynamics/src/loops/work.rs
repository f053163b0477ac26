//! What loops do to the energy of a motion.
//!
//! Loops that stay closed do no work. Steps in time leave them, by as much as their order says, and are put back.
//! What that changes of the energy is measured on both states, the kinetic energy in the metric M + E of the factors: rates are put
//! back by an impulse J'mu = (M + E) (qd' - qd), of which E (qd' - qd) is what a spring, a damper or a motor that is implicit
//! in the rates then does otherwise in the step, and is counted there. Semi-implicit Euler moves off the loops by the very
//! rates that their forces make, to first order: with J the rates' rows and lambda the forces of the step,
//!
//! W = h lambda' J (qd + qd') / 2,
//!
//! which, as of elements, accounts for kinetic energy to rounding where inertia is constant.

use super::Loops;
use vertebra_assembly::{Model, State};

impl Loops {
    /// Work of the forces of the last solution in a step of `h` \[s\] between two states \[J\].
    pub(crate) fn work(&mut self, model: &Model, [start, end]: [&State; 2], h: f64) -> f64 {
        let units = model.units();
        let rates = start.qd.iter().zip(&end.qd).zip(&self.scales.rate);
        for (mean, ((before, after), scale)) in self.joint.iter_mut().zip(rates) {
            *mean = 0.5 * (before + after) * scale;
        }
        let mut power = 0.0;
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let rate = constraint.times(row, &self.jacobian, &self.joint);
                power += self.multiplier(row) * rate;
            }
        }
        power * h / units.time * units.energy()
    }

    /// Kinetic and potential energy of a state \[J\].
    pub(crate) fn energy(&mut self, model: &Model, state: &State) -> f64 {
        self.place(model, state);
        let sums = self.kinematics.mechanics(model);
        sums.kinetic_energy + sums.potential_energy
    }
}
