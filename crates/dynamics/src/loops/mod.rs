//! Closed loops and coupled joints on top of the articulated-body algorithm.
//!
//! The equations e(q) = 0 that loops add to the tree have the rates J qd. Accelerations solve
//!
//! H qdd = tau - h + J' lambda, J qdd = -dJ/dt qd,
//!
//! and with qdd = free + H^-1 J' lambda the unknown forces lambda are those of A lambda = r, where A = J H^-1 J'
//! and r is what the free motion leaves. Neither H nor its inverse is made: with the factors that the free solution
//! left, A = Y'Y, a column of Y costs one sweep up from the loop to the world, and the answer one substitution
//! (`substitute.rs`).
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

mod constraint;
mod envelope;
mod equation;

use crate::integrate::{displace, to_displacement_axes};
use crate::link::Scales;
use crate::workspace::Sweeps;
use crate::{BodyForce, Error, Forces, Workspace, Wrench, finite_results};
use constraint::Constraint;
use envelope::Envelope;
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Force, Motion};

/// mu over the largest diagonal entry of A, for loops that are nearly closed.
const PROXIMAL: f64 = 1e-8;

/// The same for loops that are wide open.
const LARGEST_PROXIMAL: f64 = 1e-2;

/// Proximal iterations at most.
const ITERATIONS: usize = 20;

/// Iterations on positions or rates with the same factors.
const PROJECTIONS: usize = 12;

/// Violation of positions over the loop's size that a step may leave where rounding or a singular
/// position keeps it from vanishing.
const ACCEPTED: f64 = 1e-9;

/// The largest displacement of one iteration, in radians and the model's lengths: beyond, Newton's method is at
/// home nowhere.
const LARGEST_MOVE: f64 = 0.5;

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
    whitened: Vec<f64>,
    matrix: Envelope,
    /// mu of the next factor.
    proximal: f64,
    /// One entry a freedom: a row spread out, forces and what they cause, accelerations.
    spread: Vec<f64>,
    joint: Vec<f64>,
    qdd: Vec<f64>,
    before: State,
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
            whitened: vec![0.0; entries],
            matrix: Envelope::new(first),
            proximal: PROXIMAL,
            spread: vec![0.0; dofs],
            joint: vec![0.0; dofs],
            qdd: vec![0.0; dofs],
            before: State::neutral(model),
        }))
    }

    /// The accelerations under the loops' forces [rad/s^2 or m/s^2], given those of the tree that
    /// [`aba`](crate::aba) has just left in a workspace.
    pub(crate) fn constrain(
        &mut self,
        model: &Model,
        state: &State,
        workspace: &mut Workspace,
    ) -> Result<&[f64], Error> {
        let free = workspace.joint_accelerations()?;
        for (k, &free) in free.iter().enumerate() {
            self.qdd[k] = free / self.scales.acceleration[k];
            self.kinematics.u[k] = self.qdd[k];
        }
        self.place(model, state);
        self.kinematics.accelerate();
        self.evaluate(true);
        self.factor(workspace);
        for (row, residual) in self.residual.iter_mut().enumerate() {
            *residual = -self.second_rates[row] * self.row_scales[row];
        }
        self.multipliers.fill(0.0);
        let rounding = f64::EPSILON * largest(&self.residual);
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let left = largest(&self.residual);
            let gained = left < 0.5 * last;
            if left <= rounding || !gained {
                break;
            }
            last = left;
            self.respond(workspace);
            for (sum, &change) in self.multipliers.iter_mut().zip(&self.change) {
                *sum += change;
            }
            for (qdd, &response) in self.qdd.iter_mut().zip(&self.joint) {
                *qdd += response;
            }
            self.subtract_response();
        }
        for (qdd, &scale) in self.qdd.iter_mut().zip(&self.scales.acceleration) {
            *qdd *= scale;
        }
        finite_results(model, "joint acceleration", &self.qdd, state.time)?;
        Ok(&self.qdd)
    }

    /// Moves a state until its loops are closed, in the mass metric of the last
    /// [`constrain`](Self::constrain); gives the constraint furthest from closed if new factors are needed.
    pub(crate) fn close(
        &mut self,
        model: &Model,
        state: &mut State,
        workspace: &mut Workspace,
    ) -> Option<(usize, f64)> {
        let mut last = f64::INFINITY;
        for iteration in 0..=PROJECTIONS {
            self.place(model, state);
            self.evaluate(false);
            let (worst, violation, rounding) = self.worst();
            let gained = violation < 0.5 * last;
            if violation <= rounding || (!gained && violation <= ACCEPTED) {
                break;
            }
            if !gained || iteration == PROJECTIONS {
                // Far from closed, Newton's steps are shortened in the directions that give little, by the square of
                // what is left (Yamashita and Fukushima, Computing Suppl. 15, 2001): that keeps them quadratic.
                let square = violation * violation;
                self.proximal = square.clamp(PROXIMAL, LARGEST_PROXIMAL);
                return Some((worst, violation));
            }
            last = violation;
            for (row, residual) in self.residual.iter_mut().enumerate() {
                *residual = -self.values[row] * self.row_scales[row];
            }
            self.respond(workspace);
            self.move_on(model, state);
        }
        self.close_rates(state, workspace);
        None
    }

    /// Forgets how far open the loops were.
    pub(crate) const fn end_closing(&mut self) {
        self.proximal = PROXIMAL;
    }

    /// Takes the part of the rates out that opens the loops; the state is the one placed last.
    fn close_rates(&mut self, state: &mut State, workspace: &mut Workspace) {
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
                break;
            }
            last = left;
            self.respond(workspace);
            for (qd, (&change, &scale)) in
                (state.qd.iter_mut()).zip(self.joint.iter().zip(&self.scales.rate))
            {
                *qd += change / scale;
            }
        }
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
                rate = rate.max((product / constraint.size_of(row)).abs());
            }
        }
        LoopViolation {
            name: self.constraints[worst].name.clone(),
            position,
            rate: rate / model.units().time,
        }
    }

    /// Name of a constraint.
    pub(crate) fn name(&self, constraint: usize) -> &str {
        &self.constraints[constraint].name
    }

    /// The forces of the last [`constrain`](Self::constrain), of least norm.
    pub(crate) fn forces(&mut self, model: &Model) -> LoopForces {
        self.take_least_norm();
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

    /// Adds the forces of the last [`constrain`](Self::constrain) to those that act.
    pub(crate) fn act(&mut self, model: &Model, forces: &mut Forces) {
        self.take_least_norm();
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

    /// Takes out of lambda what does nothing: the proximal solution of A x = A lambda. Where loops contradict each
    /// other by rounding, each iteration has left some of that there.
    fn take_least_norm(&mut self) {
        self.times_matrix();
        self.right.copy_from_slice(&self.change);
        self.multipliers.fill(0.0);
        for _ in 0..4 {
            self.times_matrix();
            for (change, &right) in self.change.iter_mut().zip(&self.right) {
                *change = right - *change;
            }
            self.matrix.solve(&mut self.change);
            for (sum, &change) in self.multipliers.iter_mut().zip(&self.change) {
                *sum += change;
            }
        }
    }

    /// A lambda, scaled, into `change`.
    fn times_matrix(&mut self) {
        self.spread.fill(0.0);
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let factor = self.multipliers[row] * self.row_scales[row];
                for (&dof, &y) in constraint
                    .dofs
                    .iter()
                    .zip(constraint.row(row, &self.whitened))
                {
                    self.spread[dof] += factor * y;
                }
            }
        }
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                self.change[row] =
                    self.row_scales[row] * constraint.times(row, &self.whitened, &self.spread);
            }
        }
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

    /// A + mu 1, scaled, and its factor.
    fn factor(&mut self, workspace: &mut Workspace) {
        self.whitened.copy_from_slice(&self.jacobian);
        for constraint in &self.constraints {
            let mut compliance = 0.0_f64;
            for row in constraint.rows.clone() {
                let y = &mut self.whitened[constraint.entries(row)];
                workspace.whiten(&constraint.bodies, y);
                let square: f64 = y.iter().map(|y| y * y).sum();
                let size = constraint.size_of(row);
                compliance = compliance.max(square / (size * size));
            }
            for row in constraint.rows.clone() {
                let size = constraint.size_of(row);
                self.row_scales[row] = if compliance > 0.0 {
                    1.0 / (size * compliance.sqrt())
                } else {
                    0.0
                };
            }
        }
        self.spread.fill(0.0);
        for (index, constraint) in self.constraints.iter().enumerate() {
            for row in constraint.rows.clone() {
                let y = constraint.row(row, &self.whitened);
                for (&dof, &y) in constraint.dofs.iter().zip(y) {
                    self.spread[dof] = y * self.row_scales[row];
                }
                let first = self.matrix.first(row);
                for other in self.constraints[..=index].iter().rev() {
                    if other.rows.end <= first {
                        break;
                    }
                    for column in other.rows.clone().filter(|&column| column <= row) {
                        let product = other.times(column, &self.whitened, &self.spread);
                        self.matrix.row_mut(row)[column - first] =
                            product * self.row_scales[column];
                    }
                }
                self.matrix.row_mut(row)[row - first] += self.proximal;
                for &dof in &constraint.dofs {
                    self.spread[dof] = 0.0;
                }
            }
        }
        self.matrix.factor(0.5 * self.proximal);
    }

    /// lambda = (A + mu 1)^-1 residual into `change`, scaled, and H^-1 J' lambda into `joint`.
    fn respond(&mut self, workspace: &mut Workspace) {
        self.change.copy_from_slice(&self.residual);
        self.matrix.solve(&mut self.change);
        self.joint.fill(0.0);
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let force = self.change[row] * self.row_scales[row];
                for (&dof, &entry) in constraint
                    .dofs
                    .iter()
                    .zip(constraint.row(row, &self.jacobian))
                {
                    self.joint[dof] += force * entry;
                }
            }
        }
        workspace.substitute(&mut self.joint);
    }

    /// residual -= J joint, scaled.
    fn subtract_response(&mut self) {
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let product = constraint.times(row, &self.jacobian, &self.joint);
                self.residual[row] -= product * self.row_scales[row];
            }
        }
    }

    /// Moves the positions by what is in `joint`.
    fn move_on(&mut self, model: &Model, state: &mut State) {
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
    fn worst(&self) -> (usize, f64, f64) {
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

/// Whether a model has loops or couplings.
pub(crate) fn has_loops(model: &Model) -> bool {
    !model.loops().is_empty() || model.couplings().next().is_some()
}

/// Refuses a model with loops or couplings.
pub(crate) fn refuse_loops(model: &Model, by: &'static str) -> Result<(), Error> {
    let first = model.loops().first().map(|closed| closed.name.clone());
    match first.or_else(|| model.couplings().next().map(|coupling| coupling.name)) {
        None => Ok(()),
        Some(name) => Err(Error::LoopsUnavailable { name, by }),
    }
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
mod tests {
    use super::*;
    use crate::{Precision, aba, crba};
    use faer::Mat;
    use glam::{DQuat, DVec3};
    use vertebra_assembly::generate::{self, RandomTree};
    use vertebra_assembly::{Closure, Random};
    use vertebra_spatial::Pose;

    fn vector(random: &mut Random) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| random.symmetric()))
    }

    fn placement(random: &mut Random) -> Pose {
        let turn = DQuat::from_scaled_axis(vector(random) * 3.0);
        Pose::new(turn, vector(random))
    }

    /// A random tree with a closure between two of its bodies, and one between one of them and the world.
    fn closed_tree(closure: Closure, seed: u64) -> Model {
        let tree = RandomTree {
            floating: seed.is_multiple_of(2),
            reach: 3,
            ..RandomTree::mixed(9)
        };
        let description = generate::random_tree(&tree, seed).unwrap().describe();
        let name = |k: usize| description.bodies[k].name.clone();
        let (one, other) = (name(4), name(8));
        let mut random = Random::new(seed + 77);
        let mut places = || [placement(&mut random), placement(&mut random)];
        let (inner, outer) = (places(), places());
        description
            .close("inner", [Some(&one), Some(&other)], inner, closure)
            .close("outer", [Some(&other), None], outer, closure)
            .build()
            .unwrap()
    }

    fn closures() -> [Closure; 8] {
        let axis = DVec3::new(0.3, -1.0, 0.4);
        let second = DVec3::new(1.0, 0.2, -0.3);
        [
            Closure::Weld,
            Closure::Ball,
            Closure::Revolute { axis },
            Closure::Prismatic { axis },
            Closure::Cylindrical { axis },
            Closure::Universal {
                first: axis,
                second,
            },
            Closure::Planar { normal: axis },
            Closure::Distance { length: 0.7 },
        ]
    }

    /// e, J qd and e'' of a state with given accelerations in the model's units.
    fn measure(loops: &mut Loops, model: &Model, state: &State, qdd: &[f64]) -> [Vec<f64>; 3] {
        loops.place(model, state);
        loops.kinematics.u.copy_from_slice(qdd);
        loops.kinematics.accelerate();
        loops.evaluate(true);
        let rates = loops.kinematics.rates.clone();
        let mut products = Vec::new();
        for constraint in &loops.constraints {
            for row in constraint.rows.clone() {
                products.push(constraint.times(row, &loops.jacobian, &rates));
            }
        }
        [loops.values.clone(), products, loops.second_rates.clone()]
    }

    /// The state after a short while h in the model's units, to second order.
    fn later(loops: &Loops, model: &Model, state: &State, qdd: &[f64], h: f64) -> State {
        let mut moved = state.clone();
        let time = h * model.units().time;
        let mut displacement: Vec<f64> = state.qd.iter().map(|rate| rate * time).collect();
        to_displacement_axes(model, state, &mut displacement);
        displace(model, state, &displacement, &mut moved);
        for (k, rate) in moved.qd.iter_mut().enumerate() {
            *rate += h * qdd[k] / loops.scales.rate[k];
        }
        moved
    }

    fn check_rates(model: &Model, state: &State, seed: u64) {
        let mut loops = Loops::of_model(model).unwrap();
        let mut random = Random::new(seed);
        let qdd: Vec<f64> = state.qd.iter().map(|_| random.symmetric()).collect();
        let [_, rates, second] = measure(&mut loops, model, state, &qdd);
        let h = 1e-5;
        let [ahead, behind] = [h, -h].map(|h| {
            let state = later(&loops, model, state, &qdd, h);
            measure(&mut loops, model, &state, &qdd)
        });
        for (exact, k) in [(&rates, 0), (&second, 1)] {
            let size = largest(exact).max(1.0);
            for row in 0..exact.len() {
                let difference = (ahead[k][row] - behind[k][row]) / (2.0 * h);
                let off = (difference - exact[row]).abs();
                assert!(
                    off <= 1e-6 * size,
                    "row {row} of rate {k}: {difference} or {}",
                    exact[row]
                );
            }
        }
    }

    #[test]
    fn rows_are_the_rates_of_their_equations() {
        for (seed, closure) in (0..).zip(closures()) {
            let model = closed_tree(closure, seed);
            check_rates(&model, &State::random(&model, seed), seed);
        }
    }

    /// A body on a screw of its own kind: a cylindrical pair of joints, held by a screw closure.
    #[test]
    fn screws_turn_and_slide_in_proportion() {
        use vertebra_assembly::{Joint, MassProperties, ModelDescription};
        let (axis, pitch) = (DVec3::new(0.6, 0.0, 0.8), 0.25);
        let mass = MassProperties::rod(1.0, 0.5, 0.1);
        let model = ModelDescription::new("screw")
            .body("nut", None, Joint::prismatic(axis), mass)
            .body("turn", Some("nut"), Joint::revolute(axis), mass)
            .close(
                "thread",
                [None, Some("turn")],
                [Pose::IDENTITY; 2],
                Closure::Screw { axis, pitch },
            )
            .build()
            .unwrap();
        let mut state = State::neutral(&model);
        // Ten turns on.
        state.q = vec![
            10.3 * core::f64::consts::TAU * pitch,
            10.3 * core::f64::consts::TAU,
        ];
        state.qd = vec![0.2 * pitch, 0.2];
        let mut loops = Loops::of_model(&model).unwrap();
        let found = loops.violation(&model, &state);
        assert!(found.position <= 1e-13 && found.rate <= 1e-13, "{found:?}");
        check_rates(&model, &state, 3);
        state.qd[0] += 0.1;
        assert!(loops.violation(&model, &state).rate > 1e-2);
    }

    /// Against the dense pseudo-inverse, with every closure there twice: forces, and the accelerations that they
    /// make.
    #[test]
    fn redundant_loops_share_their_forces_as_the_pseudo_inverse_does() {
        for (seed, closure) in (0..).zip(closures()) {
            let description = closed_tree(closure, seed).describe();
            let mut twice = description.clone();
            for closed in &description.loops {
                let mut again = closed.clone();
                again.name += " again";
                twice.loops.push(again);
            }
            let model = twice.build().unwrap();
            let mut state = State::random(&model, seed);
            state.qd.iter_mut().for_each(|rate| *rate *= 0.1);
            let forces = Forces::none(&model);
            let mut workspace = Workspace::new(&model, Precision::F64);
            let mut loops = Loops::of_model(&model).unwrap();
            let mass = crba(&model, &state, &mut workspace).unwrap().to_owned();
            aba(&model, &state, &forces, &mut workspace).unwrap();
            let free = workspace.joint_accelerations().unwrap().to_vec();
            let qdd = loops
                .constrain(&model, &state, &mut workspace)
                .unwrap()
                .to_vec();
            loops.take_least_norm();

            let (rows, dofs) = (loops.values.len(), model.dof_count());
            let mut jacobian = Mat::<f64>::zeros(rows, dofs);
            for constraint in &loops.constraints {
                for row in constraint.rows.clone() {
                    for (&dof, &entry) in constraint
                        .dofs
                        .iter()
                        .zip(constraint.row(row, &loops.jacobian))
                    {
                        jacobian[(row, dof)] = entry * loops.row_scales[row];
                    }
                }
            }
            // The mass matrix in the model's units.
            let scales = &loops.scales;
            let mass = Mat::from_fn(dofs, dofs, |i, j| {
                mass[(i, j)] * scales.acceleration[j] / scales.force[i]
            });
            use faer::linalg::solvers::Solve;
            let responses = mass.full_piv_lu().solve(jacobian.transpose());
            let delassus = &jacobian * &responses;
            let svd = delassus.svd().unwrap();
            let target = Mat::from_fn(rows, 1, |row, _| {
                -loops.second_rates[row] * loops.row_scales[row]
            });
            let turned = svd.U().transpose() * &target;
            let values = svd.S();
            let largest_value = values[0];
            let solved = Mat::from_fn(rows, 1, |k, _| {
                let value = values[k];
                if value > 1e-11 * largest_value {
                    turned[(k, 0)] / value
                } else {
                    0.0
                }
            });
            let expected = svd.V() * solved;
            let size = expected.norm_max();
            for row in 0..rows {
                let off = (loops.multipliers[row] - expected[(row, 0)]).abs();
                assert!(
                    off <= 1e-6 * size,
                    "{closure:?}, row {row}: off by {:e}",
                    off / size
                );
            }
            let change = &responses * &expected;
            let size = qdd.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for k in 0..dofs {
                let expected = free[k] + change[(k, 0)] * scales.acceleration[k];
                assert!((qdd[k] - expected).abs() <= 1e-7 * size, "{closure:?}: {k}");
            }
        }
    }

    /// The forces put on the bodies from outside make the same accelerations.
    #[test]
    fn loop_forces_are_forces() {
        for (seed, closure) in (0..).zip(closures()) {
            let model = closed_tree(closure, seed);
            let state = State::random(&model, seed);
            let mut forces = Forces::none(&model);
            let mut workspace = Workspace::new(&model, Precision::F64);
            let mut loops = Loops::of_model(&model).unwrap();
            aba(&model, &state, &forces, &mut workspace).unwrap();
            let qdd = loops
                .constrain(&model, &state, &mut workspace)
                .unwrap()
                .to_vec();
            loops.act(&model, &mut forces);
            let again = aba(&model, &state, &forces, &mut workspace).unwrap();
            let size = largest(&qdd);
            for (a, b) in qdd.iter().zip(again) {
                assert!((a - b).abs() <= 1e-7 * size, "{closure:?}: {a} or {b}");
            }
            let found = loops.forces(&model);
            assert_eq!((found.loops.len(), found.couplings.len()), (2, 0));
        }
    }
}
