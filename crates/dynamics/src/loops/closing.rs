//! Loops put back where they belong: Newton's method on positions, then rates, in the mass metric.

use super::{Loops, PROXIMAL, largest};
use crate::integrate::{displace, to_displacement_axes};
use crate::tolerance::Method;
use vertebra_assembly::{Model, State};

/// The same for loops that hardly close, because the position is next to a singular one.
const LEAST_PROXIMAL: f64 = 1e-12;

/// The same for loops that are wide open.
const LARGEST_PROXIMAL: f64 = 1e-2;

/// Iterations on positions or rates with the same factors.
const PROJECTIONS: usize = 12;

/// Violation of positions over the loop's size that a step may leave where rounding or a singular
/// position keeps it from vanishing.
const ACCEPTED: f64 = 1e-9;

/// The same with the factors of the state before, which new ones may improve.
const ACCEPTED_STALE: f64 = 1e-13;

/// The largest displacement of one iteration, in radians and the model's lengths: beyond, Newton's method is at
/// home nowhere.
const LARGEST_MOVE: f64 = 0.5;

impl Loops {
    /// Moves a state until its loops are closed, in the mass metric of the last
    /// [`constrain`](Self::constrain), which was of this very state if its factors are `fresh`; gives the constraint
    /// furthest from closed if new factors are needed.
    pub(crate) fn close(
        &mut self,
        model: &Model,
        state: &mut State,
        method: &mut Method,
        fresh: bool,
    ) -> Option<(usize, f64)> {
        let mut last = f64::INFINITY;
        let mut found = (0, 0.0);
        for iteration in 0..=PROJECTIONS {
            self.place(model, state);
            self.evaluate(false);
            let (worst, violation, rounding) = self.worst();
            found = (worst, violation);
            let gained = violation < 0.5 * last;
            let accepted = if fresh { ACCEPTED } else { ACCEPTED_STALE };
            if violation <= rounding || (!gained && violation <= accepted) {
                break;
            }
            if !gained || iteration == PROJECTIONS {
                // Far from closed, Newton's steps are shortened in the directions that give little, by the square of
                // what is left (Yamashita and Fukushima, Computing Suppl. 15, 2001): that keeps them quadratic.
                let square = violation * violation;
                self.proximal = square.clamp(LEAST_PROXIMAL, LARGEST_PROXIMAL);
                return Some(found);
            }
            last = violation;
            for (row, residual) in self.residual.iter_mut().enumerate() {
                *residual = -self.values[row] * self.row_scales[row];
            }
            self.respond_elsewhere(method);
            self.move_on(model, state);
        }
        let closed = self.close_rates(state, method);
        (!closed && !fresh).then_some(found)
    }

    /// Forgets how far open the loops were.
    pub(crate) const fn end_closing(&mut self) {
        self.proximal = PROXIMAL;
    }

    /// Takes the part of the rates out that opens the loops; the state is the one placed last. Gives whether nothing
    /// much is left of it.
    fn close_rates(&mut self, state: &mut State, method: &mut Method) -> bool {
        let mut last = f64::INFINITY;
        for _ in 0..PROJECTIONS {
            for (rate, (&qd, &scale)) in
                (self.joint.iter_mut()).zip(state.qd.iter().zip(&self.scales.rate))
            {
                *rate = qd * scale;
            }
            self.residual.fill(0.0);
            self.subtract_response();
            let speed = largest(&self.joint) * largest(&self.row_scales);
            let left = largest(&self.residual);
            let gained = left < 0.5 * last;
            if left <= 4.0 * f64::EPSILON * speed || !gained {
                return left <= ACCEPTED * speed;
            }
            last = left;
            self.respond_elsewhere(method);
            for (qd, (&change, &scale)) in
                (state.qd.iter_mut()).zip(self.joint.iter().zip(&self.scales.rate))
            {
                *qd += change / scale;
            }
        }
        false
    }

    /// Moves the positions by what is in `joint`.
    pub(super) fn move_on(&mut self, model: &Model, state: &mut State) {
        let time = model.units().time;
        let shorter = (LARGEST_MOVE / largest(&self.joint)).min(1.0);
        for (displacement, &rate) in self.joint.iter_mut().zip(&self.scales.rate) {
            *displacement *= shorter * time / rate;
        }
        self.before.q.copy_from_slice(&state.q);
        to_displacement_axes(model, &self.before, &mut self.joint);
        displace(model, &self.before, &self.joint, state);
    }

    /// The constraint furthest from closed, how far over its size, and what rounding may leave.
    pub(super) fn worst(&self) -> (usize, f64, f64) {
        let (mut worst, mut violation, mut rounding) = (0, -1.0_f64, 0.0_f64);
        for (index, constraint) in self.constraints.iter().enumerate() {
            for row in constraint.rows.clone() {
                let left = (self.values[row] / constraint.size_of(row)).abs();
                if left > violation {
                    (worst, violation) = (index, left);
                }
                if left.is_nan() {
                    return (index, f64::INFINITY, 0.0);
                }
            }
            rounding = rounding.max(8.0 * f64::EPSILON * (4 + constraint.bodies.len()) as f64);
        }
        (worst, violation, rounding)
    }
}
