//! Closed loops and coupled joints on top of the articulated-body algorithm.
//!
//! The equations e(q) = 0 that loops add to the tree have the rates J qd. Accelerations solve
//!
//! H qdd = tau - h + J' lambda, J qdd = -dJ/dt qd,
//!
//! and with qdd = free + H^-1 J' lambda the unknown forces lambda are those of A lambda = r, where A = J H^-1 J'
//! and r is what the free motion leaves. Neither H nor its inverse is made: with the factors that the free solution
//! left, A = Y'Y, a column of Y costs one sweep up from the loop to the world, and the answer one substitution
//! (`substitute.rs`). With those of an assembly tree columns of H^-1 J' are substitutions themselves
//! (`dca/substitute.rs`).
//!
//! Loops may ask for the same thing twice, and then A is singular. It is solved by the proximal iteration of
//! Carpentier, Budhiraja and Mansard (RSS 2021): with A + mu 1, repeated on what is left,
//!
//! lambda += (A + mu 1)^-1 (r - A lambda),
//!
//! which always exists, loses a factor mu / (sigma + mu) of the error along each eigenvector of A a
//! time, and from lambda = 0 ends at the forces of least norm among those that do the same. The motion that they
//! add is the smallest in the mass metric (Gauss's principle). What is left is measured on the motion itself, in
//! f64, so that rounding of A and of factors in f32 costs iterations, not accuracy. Before that, rows are scaled: lengths by the size of their loop, all
//! of a loop by its largest compliance, so that radians and metres, light loops and heavy ones are alike.
//!
//! **Drift.** Solutions keep second rates at zero, and steps in time add their own error. After each step the positions
//! are put back by Newton's method in the mass metric, dq = H^-1 J' (A + mu 1)^-1 (-e), and then the rates by the
//! same projection; A and the factors are those of the step, refreshed where they do not gain a digit in three.
//!
//! **Turning.** Loops turn velocities, and a step of order 1 lets two things do it: the part of the loops' forces that
//! goes with the rates, -dJ/dt qd, before it, and the projection of rates after it. Take a point on a circle, which
//! moves by an angle x a step. Let a share w of that force act: it makes the velocity (1, w x), the circle's
//! direction where the step ends is (1, x), and what the projection leaves has the square
//!
//! 1 + w^2 x^2 - (1 - w)^2 x^2 = 1 + (2 w - 1) x^2    to order x^4.
//!
//! With all of the force energy grows without bound, since x grows with it; with none of it energy is lost as fast.
//! With one half neither happens ([`Integrator`](crate::Integrator)), as in RATTLE (Andersen, J. Comput. Phys. 52,
//! 1983), which puts one half at each end. Methods of higher order take all of it at each of their stages.

mod closing;
pub(crate) mod constraint;
mod envelope;
pub(crate) mod equation;
mod exact;
mod solve;
mod work;

use crate::link::Scales;
use crate::tolerance::Method;
use crate::workspace::Sweeps;
use crate::{BodyForce, Error, Forces, Wrench, finite_results};
use constraint::Constraint;
use envelope::Envelope;
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Force, Motion};

/// mu over the largest diagonal entry of A, for loops that are nearly closed.
const PROXIMAL: f64 = 1e-8;

/// Proximal iterations at most.
const ITERATIONS: usize = 20;

/// Violation over the loop's size from which a step does not start: closing the loop would move bodies by more of
/// their length than steps do that mean anything.
pub(crate) const OPEN: f64 = 1e-2;

/// How far a loop or coupling of a model is from closed.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopViolation {
    /// Name of the loop or coupling.
    pub name: String,
    /// The largest of what its equations leave: lengths over the size of the loop, which is its longest link, cosines of angles that
    /// should be right, differences of angles \[rad\].
    pub position: f64,
    /// The largest rate of those numbers [1/s].
    pub rate: f64,
}

/// The forces by which loops and couplings are kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopForces {
    /// What each loop's joint exerts on the second of its bodies, and with the opposite sign on the first: world
    /// axes, about the origin of the second frame; in the order of [`Model::loops`].
    pub loops: Vec<BodyForce>,
    /// What each coupling adds to the force of the joint that follows [N m or N], in the order of
    /// [`Model::couplings`]; the other joint has that times the negative ratio.
    pub couplings: Vec<f64>,
}

/// The equations of one model's loops and couplings, and all memory to solve them.
#[derive(Clone, Debug)]
pub(crate) struct Loops {
    constraints: Vec<Constraint>,
    /// The state, in f64 and the model's units.
    kinematics: Box<Sweeps<f64>>,
    scales: Scales,
    /// One entry a row of J, from here on: e over the loop's size, w, second rates, and their scale.
    values: Vec<f64>,
    wrenches: Vec<Force<f64>>,
    second_rates: Vec<f64>,
    row_scales: Vec<f64>,
    /// What is left of the equations in hand, scaled; lambda, scaled; its change.
    residual: Vec<f64>,
    multipliers: Vec<f64>,
    change: Vec<f64>,
    right: Vec<f64>,
    /// J and Y, row after row, each with the freedoms of its constraint.
    jacobian: Vec<f64>,
    roots: Vec<f64>,
    matrix: Envelope,
    /// mu of the next factor, and of the one at hand.
    proximal: f64,
    factored: f64,
    /// The share w of the forces that go with the rates, in the solutions of a step.
    turning: f64,
    /// Whether the next solution is a step's first.
    starts: bool,
    /// One entry a freedom: a row spread out, forces and what they cause, accelerations.
    spread: Vec<f64>,
    joint: Vec<f64>,
    qdd: Vec<f64>,
    before: State,
    /// What acts, the forces of loops included.
    held: Option<Forces>,
}

impl Loops {
    /// The loops and couplings of a model, if it has any.
    pub(crate) fn of_model(model: &Model) -> Option<Box<Self>> {
        if !has_loops(model) {
            return None;
        }
        let kinematics = Box::new(Sweeps::new(model));
        let (constraints, rows, entries) = Constraint::of_model(model, &kinematics);
        let dofs = model.dof_count();
        // Rows begin at the first constraint with which they share a joint.
        let mut earliest = vec![usize::MAX; dofs];
        let mut first = Vec::with_capacity(rows);
        for constraint in &constraints {
            let begin = (constraint.dofs.iter()).fold(constraint.rows.start, |begin, &dof| {
                earliest[dof] = earliest[dof].min(constraint.rows.start);
                begin.min(earliest[dof])
            });
            first.extend(constraint.rows.clone().map(|_| begin));
        }
        let zeros = vec![0.0; rows];
        Some(Box::new(Self {
            constraints,
            kinematics,
            scales: Scales::of_model(model),
            values: zeros.clone(),
            wrenches: vec![Force::ZERO; rows],
            second_rates: zeros.clone(),
            row_scales: zeros.clone(),
            residual: zeros.clone(),
            multipliers: zeros.clone(),
            change: zeros.clone(),
            right: zeros,
            jacobian: vec![0.0; entries],
            roots: vec![0.0; entries],
            matrix: Envelope::new(first),
            proximal: PROXIMAL,
            factored: PROXIMAL,
            turning: 1.0,
            starts: false,
            spread: vec![0.0; dofs],
            joint: vec![0.0; dofs],
            qdd: vec![0.0; dofs],
            before: State::neutral(model),
            held: None,
        }))
    }

    /// Begins a step, in the solutions of which this share of the forces that go with the rates acts: the closing
    /// at its end makes up for the rest. It does not start from loops that are open.
    pub(crate) const fn begin_step(&mut self, turning: f64) {
        self.turning = turning;
        self.starts = true;
    }

    /// Ends a step, taken or not.
    pub(crate) const fn end_step(&mut self) {
        self.turning = 1.0;
        self.starts = false;
    }

    /// The accelerations under the loops' forces [rad/s^2 or m/s^2], given those of the tree that a method has just
    /// left.
    pub(crate) fn constrain(
        &mut self,
        model: &Model,
        state: &State,
        method: &mut Method,
    ) -> Result<&[f64], Error> {
        self.take_accelerations(model, state, method.accelerations()?);
        if core::mem::take(&mut self.starts) {
            self.refuse_open(state)?;
        }
        self.factor(method);
        self.demand();
        self.multipliers.fill(0.0);
        self.settle(method, ITERATIONS);
        self.accelerations(model, state)
    }

    /// Factors of a state that a method has just solved.
    pub(crate) fn refresh(&mut self, model: &Model, state: &State, method: &mut Method) {
        self.place(model, state);
        self.evaluate(false);
        self.factor(method);
    }

    /// Takes accelerations [rad/s^2 or m/s^2], and evaluates the equations with them.
    fn take_accelerations(&mut self, model: &Model, state: &State, given: &[f64]) {
        for (k, &given) in given.iter().enumerate() {
            self.qdd[k] = given / self.scales.acceleration[k];
        }
        self.place(model, state);
        self.evaluate_accelerations();
    }

    /// The loops' second rates under the accelerations at hand.
    fn evaluate_accelerations(&mut self) {
        self.kinematics.u.copy_from_slice(&self.qdd);
        self.kinematics.accelerate();
        self.evaluate(true);
    }

    /// The accelerations found, from now on in SI.
    fn accelerations(&mut self, model: &Model, state: &State) -> Result<&[f64], Error> {
        for (qdd, &scale) in self.qdd.iter_mut().zip(&self.scales.acceleration) {
            *qdd *= scale;
        }
        finite_results(model, "joint acceleration", &self.qdd, state.time)?;
        Ok(&self.qdd)
    }

    /// What the loops ask of accelerations beside the tree's, scaled.
    fn demand(&mut self) {
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                // The second rate without what goes with the rates.
                let bare = constraint.times(row, &self.jacobian, &self.qdd);
                let turning = self.second_rates[row] - bare;
                self.residual[row] = -(bare + self.turning * turning) * self.row_scales[row];
            }
        }
    }

    /// Refuses to start a step from open loops.
    fn refuse_open(&self, state: &State) -> Result<(), Error> {
        let (worst, violation, _) = self.worst();
        if violation <= OPEN {
            return Ok(());
        }
        Err(Error::LoopOpen {
            name: self.constraints[worst].name.clone(),
            violation,
            limit: OPEN,
            time: state.time,
        })
    }

    /// How far a state is from closed: the worst constraint.
    pub(crate) fn violation(&mut self, model: &Model, state: &State) -> LoopViolation {
        self.place(model, state);
        self.evaluate(false);
        let (worst, position, _) = self.worst();
        self.joint.copy_from_slice(&self.kinematics.rates);
        let mut rate = 0.0_f64;
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let product = constraint.times(row, &self.jacobian, &self.joint);
                let of_row = (product / constraint.size_of(row)).abs();
                // Overflowed, which `max` would drop; the position of such a row is infinite too.
                rate = rate.max(if of_row.is_nan() {
                    f64::INFINITY
                } else {
                    of_row
                });
            }
        }
        LoopViolation {
            name: self.constraints[worst].name.clone(),
            position,
            rate: rate / model.units().time,
        }
    }

    /// Name of the constraint with an equation that depends most on those before it in the last factor.
    pub(crate) fn nearest_singular(&self) -> &str {
        let least = |constraint: &&Constraint| {
            let pivots = constraint.rows.clone().map(|row| self.matrix.pivot(row));
            pivots.fold(f64::INFINITY, f64::min)
        };
        let nearest = (self.constraints.iter()).min_by(|a, b| least(a).total_cmp(&least(b)));
        nearest.map_or("", |constraint| &constraint.name)
    }

    /// Name of a constraint.
    pub(crate) fn name(&self, constraint: usize) -> &str {
        &self.constraints[constraint].name
    }

    /// The forces of the last [`constrain`](Self::constrain), of least norm.
    pub(crate) fn forces(&mut self, model: &Model, method: &mut Method) -> LoopForces {
        self.take_least_norm(method);
        let units = model.units();
        let mut forces = LoopForces::default();
        for constraint in &self.constraints {
            if let Some([row, ..]) = constraint.coupled() {
                let scale = self.scales.force[constraint.first_dof()];
                forces.couplings.push(self.multiplier(row) * scale);
            } else {
                forces
                    .loops
                    .push(BodyForce::in_si(self.wrench(constraint), units).unwrap_or_default());
            }
        }
        forces
    }

    /// Adds the forces of the last [`constrain`](Self::constrain), of least norm, to those that act.
    pub(crate) fn act(&mut self, model: &Model, method: &mut Method, forces: &mut Forces) {
        self.take_least_norm(method);
        self.act_as_they_are(model, forces);
    }

    /// The forces that act with those of the last solution.
    pub(crate) fn with_own(&mut self, model: &Model, forces: &Forces) -> &Forces {
        let mut held = (self.held.take()).unwrap_or_else(|| Forces::none(model));
        held.copy_from(forces);
        self.act_as_they_are(model, &mut held);
        self.held.insert(held)
    }

    fn act_as_they_are(&self, model: &Model, forces: &mut Forces) {
        let units = model.units();
        for constraint in &self.constraints {
            let wrench = self.wrench(constraint);
            for (body, point, sign) in constraint.points(&self.kinematics) {
                let wrench = wrench * sign;
                let acting = Wrench::at_point(
                    wrench.linear.to_glam() * units.force(),
                    point.to_glam() * units.length,
                );
                forces.push(
                    body,
                    acting.with_torque(wrench.angular.to_glam() * units.energy()),
                );
            }
            if let Some([row, ..]) = constraint.coupled() {
                for (&dof, &entry) in constraint
                    .dofs
                    .iter()
                    .zip(constraint.row(row, &self.jacobian))
                {
                    forces.joint[dof] += entry * self.multiplier(row) * self.scales.force[dof];
                }
            }
        }
    }

    /// What a loop's joint exerts on its second body, about the second frame's origin, in the model's units.
    fn wrench(&self, constraint: &Constraint) -> Force<f64> {
        let mut sum = Force::ZERO;
        for row in constraint.rows.clone() {
            sum += self.wrenches[row] * self.multiplier(row);
        }
        sum
    }

    fn multiplier(&self, row: usize) -> f64 {
        self.multipliers[row] * self.row_scales[row]
    }

    /// Kinematics of a state.
    fn place(&mut self, model: &Model, state: &State) {
        let length = model.units().length;
        (self.kinematics).set_state(&state.q, &state.qd, length, &self.scales.rate);
        self.kinematics.set_positions_and_velocities();
        for constraint in &mut self.constraints {
            constraint.read_positions(&state.q);
        }
    }

    /// Values, wrenches, second rates and J.
    fn evaluate(&mut self, accelerating: bool) {
        for constraint in &self.constraints {
            constraint.evaluate(
                &self.kinematics,
                accelerating,
                &mut self.values,
                &mut self.wrenches,
                &mut self.second_rates,
                &mut self.jacobian,
            );
        }
    }
}

/// Whether a model has loops or couplings.
pub(crate) fn has_loops(model: &Model) -> bool {
    !model.loops().is_empty() || model.couplings().next().is_some()
}

/// The names of a model's loops and couplings.
pub(crate) fn names(model: &Model) -> impl Iterator<Item = String> + '_ {
    let loops = model.loops().iter().map(|closed| closed.name.clone());
    loops.chain(model.couplings().map(|coupling| coupling.name))
}

/// The name of a model's first loop or coupling.
pub(crate) fn first_loop(model: &Model) -> Option<String> {
    names(model).next()
}

/// Refuses a model that has this for a first loop.
pub(crate) fn refuse_looped(
    first: Option<&String>,
    by: &'static str,
    remedy: &'static str,
) -> Result<(), Error> {
    match first {
        None => Ok(()),
        Some(name) => Err(Error::LoopsUnavailable {
            name: name.clone(),
            by,
            remedy,
        }),
    }
}

/// Refuses a model with loops or couplings.
#[cfg(feature = "gpu")]
pub(crate) fn refuse_loops(
    model: &Model,
    by: &'static str,
    remedy: &'static str,
) -> Result<(), Error> {
    refuse_looped(first_loop(model).as_ref(), by, remedy)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| {
        let value = value.abs();
        // Keeps what is not a number.
        if value <= largest { largest } else { value }
    })
}

/// Seen at the point `arm` away from a body's origin: its velocity and its acceleration as an observer at rest
/// sees it.
pub(crate) fn seen_at(
    s: &Sweeps<f64>,
    body: usize,
    arm: vertebra_spatial::Vec3<f64>,
) -> (Motion<f64>, Motion<f64>) {
    let w = s.spin[body];
    let mut acceleration = (s.acceleration[body] - s.base).shifted(arm);
    acceleration.linear += w.cross(w.cross(arm));
    (s.velocity[body].shifted(arm), acceleration)
}

#[cfg(test)]
mod tests;
