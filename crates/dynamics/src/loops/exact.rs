//! Loops to a tolerance.
//!
//! A tree is solved to its tolerance under forces that are given, those of loops among them. What is left of the loops'
//! own equations then is measured on that solution, and the response to it, with the factors at hand, corrects both
//! forces and accelerations: iterative refinement of
//!
//! H qdd - J' lambda = tau - h,   J qdd = -dJ/dt qd,
//!
//! as `tolerance.rs` does it for the first line alone, with the same estimate: the change that a correction makes is the
//! error before it. Lambda acts as force pairs on the bodies, so that the residual of the bodies' equations includes
//! it. Corrections do not see the rounding of the loops' own equations; second rates as large as that are responded to, and bound
//! the estimate from below. The residual of a loop is the most that one of its equations leaves over the largest sum of terms' sizes, and the larger
//! of this and of the tree's is the one reported. Changes are measured by no less than the loads would cause (`balance.rs`): a linkage that hangs at
//! rest has no acceleration to measure them by.

use super::constraint::Constraint;
use super::{ITERATIONS, Loops};
use crate::balance::{largest_push, least_acceleration};
use crate::refine::relative;
use crate::residual::worst_of;
use crate::tolerance::{CAUTION, Ladder, Method, NOISE, SWEEPS};
use crate::{Error, Forces};
use vertebra_assembly::{Model, State};

impl Loops {
    /// The accelerations under the loops' forces [rad/s^2 or m/s^2], to the tolerance of a ladder.
    pub(crate) fn constrain_to_tolerance(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
        ladder: &mut Ladder,
    ) -> Result<&[f64], Error> {
        let least = self.least(model, state, forces);
        ladder.solve(model, state, forces)?;
        if let Some(method) = ladder.method() {
            self.constrain(model, state, method)?;
        }
        let (mut error, mut before) = (0.0, 1.0);
        for _ in 0..SWEEPS {
            let held = self.with_own(model, forces);
            let solved = ladder.solve(model, state, held)?;
            self.take_accelerations(model, state, solved);
            let mut change = 0.0;
            if let Some(method) = ladder.method() {
                change = self.correct(method, least);
            }
            if change > 0.5 * before {
                // Not one digit is known.
                error = 1.0;
                break;
            }
            error = change * (CAUTION * change / before).min(1.0);
            if error <= ladder.tolerance() {
                break;
            }
            before = change;
        }
        self.evaluate_accelerations();
        let residual = self.left();
        if let Some(method) = ladder.method() {
            error = error.max(NOISE * self.rounding(method, least));
        }
        ladder.add(residual, error)?;
        self.accelerations(model, state)
    }

    /// How far off accelerations are that a tree has under the forces of the last solution: what a correction of these by the factors
    /// at hand changes, and what rounding of the loops' equations leaves of it.
    #[cfg(feature = "gpu")]
    pub(crate) fn error(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
        (qdd, method): (&[f64], &mut Method),
    ) -> f64 {
        let least = self.least(model, state, forces);
        self.take_accelerations(model, state, qdd);
        let change = self.correct(method, least);
        change.max(NOISE * self.rounding(method, least))
    }

    /// Corrects the forces, and the accelerations that a tree has under them: by how much, as part of the largest and of no less
    /// than `least` [rad/s^2 or m/s^2].
    fn correct(&mut self, method: &mut Method, least: f64) -> f64 {
        self.demand();
        self.spread.copy_from_slice(&self.qdd);
        self.settle(method, ITERATIONS);
        self.changed(least)
    }

    /// The least acceleration that errors are measured by.
    fn least(&self, model: &Model, state: &State, forces: &Forces) -> f64 {
        let push = largest_push(model, forces);
        least_acceleration(model, &self.scales, &state.qd, push)
    }

    /// What the rounding of the loops' equations, which are in f64 whatever solves the tree, leaves of accelerations: the
    /// response to second rates as large as that, as part of the largest and of no less than `least` [rad/s^2 or m/s^2].
    fn rounding(&mut self, method: &mut Method, least: f64) -> f64 {
        for (index, constraint) in self.constraints.iter().enumerate() {
            for row in constraint.rows.clone() {
                let (_, size) = self.terms(constraint, row);
                // Signs that do not go with those of the neighbours.
                let sign = if (index + row) % 3 == 1 { -1.0 } else { 1.0 };
                self.residual[row] = sign * f64::EPSILON * size * self.row_scales[row];
            }
        }
        self.respond(method);
        let (mut change, mut largest) = (0.0_f64, least);
        let both = self.joint.iter().zip(&self.qdd);
        for ((&response, &qdd), &scale) in both.zip(&self.scales.acceleration) {
            change = worst_of(change, response.abs() * scale);
            largest = largest.max(qdd.abs() * scale);
        }
        relative(change, largest)
    }

    /// What an equation leaves, and the sum of its terms' sizes.
    fn terms(&self, constraint: &Constraint, row: usize) -> (f64, f64) {
        let entries = constraint.row(row, &self.jacobian);
        let terms = (entries.iter().zip(&constraint.dofs)).map(|(j, &dof)| j * self.qdd[dof]);
        let (bare, size) = terms.fold((0.0, 0.0_f64), |(sum, size), term| {
            (sum + term, size + term.abs())
        });
        let turning = self.turning * (self.second_rates[row] - bare);
        (bare + turning, size + turning.abs())
    }

    /// The largest part of the sizes of its terms that an equation leaves; those of a loop share the largest size, since those
    /// across a plane in which all moves have terms that are rounding.
    fn left(&self) -> f64 {
        let of_constraint = |constraint: &Constraint| {
            let rows = constraint.rows.clone();
            let terms = rows.map(|row| {
                let (left, size) = self.terms(constraint, row);
                (left * self.row_scales[row], size * self.row_scales[row])
            });
            let (left, size) = terms.fold((0.0_f64, 0.0_f64), |(left, size), (row, own)| {
                (worst_of(left, row.abs()), worst_of(size, own))
            });
            if !size.is_finite() {
                // Beside what has overflowed nothing is known.
                1.0
            } else if size == 0.0 {
                0.0
            } else {
                left / size
            }
        };
        (self.constraints.iter())
            .map(of_constraint)
            .fold(0.0, worst_of)
    }

    /// By how much accelerations differ from those in `spread`, as part of the largest in SI and of no less than `least`
    /// [rad/s^2 or m/s^2].
    fn changed(&self, least: f64) -> f64 {
        let (mut change, mut largest) = (0.0_f64, least);
        let both = self.qdd.iter().zip(&self.spread);
        for ((&qdd, &was), &scale) in both.zip(&self.scales.acceleration) {
            change = worst_of(change, (qdd - was).abs() * scale);
            largest = largest.max(qdd.abs() * scale);
        }
        relative(change, largest)
    }
}
