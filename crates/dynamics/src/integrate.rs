//! Integrators. Quaternions move along the rotation group, never off it.

use crate::residual::worst_of;
use crate::{Elements, Error, Forces, Solver};
use vertebra_assembly::{JointKind, Model, State};
use vertebra_spatial::{Quat, Vec3, rotation_vector_rate, vec3};

/// How a step in time is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// qd += h qdd(q, qd), then q += h qd with the new rates: order 1, one evaluation a step.
    #[default]
    SemiImplicitEuler,
    /// The classical Runge-Kutta method, on the rotation group by Munthe-Kaas (BIT 38, 1998): order
    /// 4, four evaluations a step.
    RungeKutta4,
    /// The implicit midpoint rule: order 2, symmetric, so that a step back undoes a step, and energies
    /// of motions that would recur do not drift. Solved by iteration, an evaluation each (five to ten
    /// where steps are short enough for the result to mean anything); steps too long for it to converge
    /// are refused ([`Error::NotConverged`]).
    ImplicitMidpoint,
}

impl Integrator {
    /// The share of those forces of loops that go with the rates that its solutions take: closing the loops after the
    /// step makes up for the rest (`loops/mod.rs`).
    pub(crate) const fn turning(self) -> f64 {
        match self {
            Self::SemiImplicitEuler => 0.5,
            Self::RungeKutta4 | Self::ImplicitMidpoint => 1.0,
        }
    }
}

/// Iterations of an implicit step at most: those that converge gain a digit in two at the least.
const ITERATIONS: u32 = 50;

/// Rounding of rates in such an iteration, in epsilons of the largest.
const SETTLED: f64 = 16.0;

/// The same where iterations stall: rounding of accelerations, as stiff loops and unequal masses enlarge it.
const STALLED: f64 = 4096.0;

/// Memory of the integrators for one model.
#[derive(Clone, Debug)]
pub(crate) struct Stages {
    /// State of a stage.
    stage: State,
    /// Displacements from the start of the step, in the coordinates of [`displace`].
    displacement: Vec<f64>,
    /// Sums of the stages' rates and accelerations.
    rate_sum: Vec<f64>,
    acceleration_sum: Vec<f64>,
    rate: Vec<f64>,
}

impl Stages {
    pub(crate) fn new(model: &Model) -> Self {
        let zeros = vec![0.0; model.dof_count()];
        Self {
            stage: State::neutral(model),
            displacement: zeros.clone(),
            rate_sum: zeros.clone(),
            acceleration_sum: zeros.clone(),
            rate: zeros,
        }
    }
}

/// A step to be taken.
pub(crate) struct Step<'a> {
    pub(crate) model: &'a Model,
    pub(crate) start: &'a State,
    /// Length in time \[s\].
    pub(crate) h: f64,
    pub(crate) forces: &'a Forces,
    /// What acts in the joints, if anything does.
    pub(crate) elements: Option<&'a mut Elements>,
}

impl Step<'_> {
    /// Accelerations at a stage, `ahead` the length of a step from it that elements are implicit in.
    fn accelerations<'s>(
        (model, forces): (&Model, &Forces),
        elements: &'s mut Option<&mut Elements>,
        solver: &'s mut Solver,
        stage: &State,
        ahead: f64,
    ) -> Result<&'s [f64], Error> {
        match elements {
            None => solver.forward_dynamics(model, stage, forces),
            Some(elements) => elements.solve(solver, stage, forces, ahead),
        }
    }

    /// Takes the step to `next`, of which all entries are written.
    pub(crate) fn take(
        &mut self,
        integrator: Integrator,
        solver: &mut Solver,
        stages: &mut Stages,
        next: &mut State,
    ) -> Result<(), Error> {
        match integrator {
            Integrator::SemiImplicitEuler => self.euler(solver, stages, next),
            Integrator::RungeKutta4 => self.runge_kutta(solver, stages, next),
            Integrator::ImplicitMidpoint => self.midpoint(solver, stages, next),
        }?;
        next.time = self.start.time + self.h;
        Ok(())
    }

    fn euler(
        &mut self,
        solver: &mut Solver,
        stages: &mut Stages,
        next: &mut State,
    ) -> Result<(), Error> {
        let Self {
            model,
            start,
            h,
            forces,
            ref mut elements,
        } = *self;
        let given = (model, forces);
        let qdd = Self::accelerations(given, elements, solver, start, h)?;
        let displacement = &mut stages.displacement;
        for dof in 0..qdd.len() {
            next.qd[dof] = start.qd[dof] + h * qdd[dof];
            displacement[dof] = h * next.qd[dof];
        }
        to_displacement_axes(model, start, displacement);
        displace(model, start, displacement, next);
        Ok(())
    }

    /// u' = dexp^-1(u) w, qd' = qdd, from u = 0: the classical method, since u lives in a vector
    /// space.
    fn runge_kutta(
        &mut self,
        solver: &mut Solver,
        stages: &mut Stages,
        next: &mut State,
    ) -> Result<(), Error> {
        let Self {
            model,
            start,
            h,
            forces,
            ref mut elements,
        } = *self;
        let given = (model, forces);
        let Stages {
            stage,
            displacement,
            rate_sum,
            acceleration_sum,
            rate,
        } = stages;
        stage.q.copy_from_slice(&start.q);
        stage.qd.copy_from_slice(&start.qd);
        stage.time = start.time;
        displacement.fill(0.0);
        rate_sum.fill(0.0);
        acceleration_sum.fill(0.0);
        // Weight of each stage, and how far ahead the next one looks.
        for (weight, ahead) in [
            (1.0, Some(0.5 * h)),
            (2.0, Some(0.5 * h)),
            (2.0, Some(h)),
            (1.0, None),
        ] {
            rate.copy_from_slice(&stage.qd);
            displacement_rate(model, stage, displacement, rate);
            let qdd = Self::accelerations(given, elements, solver, stage, 0.0)?;
            for dof in 0..rate.len() {
                rate_sum[dof] += weight * rate[dof];
                acceleration_sum[dof] += weight * qdd[dof];
            }
            let Some(ahead) = ahead else { break };
            for dof in 0..rate.len() {
                displacement[dof] = ahead * rate[dof];
                stage.qd[dof] = start.qd[dof] + ahead * qdd[dof];
            }
            displace(model, start, displacement, stage);
            stage.time = start.time + ahead;
        }
        for dof in 0..rate.len() {
            displacement[dof] = h / 6.0 * rate_sum[dof];
            next.qd[dof] = start.qd[dof] + h / 6.0 * acceleration_sum[dof];
        }
        displace(model, start, displacement, next);
        Ok(())
    }
}

impl Step<'_> {
    /// qd' = qd + h a with a = qdd(q_m, qd_m), where the midpoint is qd_m = qd + h/2 a and q_m = q moved
    /// by h/2 qd_m; q' = q moved by h qd_m. Turning rates are in axes that turn about them, so that moving
    /// twice by half is moving once, and rates of positions are taken in the axes of the midpoint: seen
    /// from q' and -h all of it is the same. Iterated on a, from the start's, until rounding is left: of the
    /// rates or, where loops or masses make it more, what further iterations no longer lessen.
    fn midpoint(
        &mut self,
        solver: &mut Solver,
        stages: &mut Stages,
        next: &mut State,
    ) -> Result<(), Error> {
        let Self {
            model,
            start,
            h,
            forces,
            ref mut elements,
        } = *self;
        let given = (model, forces);
        let Stages {
            stage,
            displacement,
            acceleration_sum: found,
            ..
        } = stages;
        let epsilon = solver.choice().tree.epsilon();
        found.copy_from_slice(Self::accelerations(given, elements, solver, start, 0.0)?);
        stage.time = start.time + 0.5 * h;
        let (mut first, mut last) = (f64::INFINITY, f64::INFINITY);
        for iteration in 1..=ITERATIONS {
            for dof in 0..found.len() {
                stage.qd[dof] = start.qd[dof] + 0.5 * h * found[dof];
                displacement[dof] = 0.5 * h * stage.qd[dof];
            }
            // Orientations first: they give the axes of the midpoint.
            displace(model, start, displacement, stage);
            to_displacement_axes(model, stage, displacement);
            displace(model, start, displacement, stage);
            let qdd = Self::accelerations(given, elements, solver, stage, 0.0)?;
            let (mut change, mut largest) = (0.0_f64, 0.0_f64);
            for (found, (&qdd, &qd)) in found.iter_mut().zip(qdd.iter().zip(&stage.qd)) {
                change = worst_of(change, (h * (qdd - *found)).abs());
                largest = largest.max(qd.abs()).max((h * qdd).abs());
                *found = qdd;
            }
            let stalled = change > 0.5 * last;
            let rounding = epsilon * if stalled { STALLED } else { SETTLED };
            if change <= rounding * largest {
                for dof in 0..found.len() {
                    next.qd[dof] = start.qd[dof] + h * found[dof];
                    displacement[dof] *= 2.0;
                }
                displace(model, start, displacement, next);
                return Ok(());
            }
            if iteration == ITERATIONS || change > 10.0 * first {
                return Err(Error::NotConverged {
                    step: h,
                    iterations: iteration,
                    change: change / largest,
                    near: solver.nearest_singular(),
                });
            }
            first = first.min(change);
            last = change;
        }
        Ok(())
    }
}

/// next.q = start.q moved by a displacement: added for positions and angles; for orientations the
/// rotation vector u of q exp(u).
pub(crate) fn displace(model: &Model, start: &State, displacement: &[f64], next: &mut State) {
    for body in model.bodies() {
        let (from, to) = (&start.q[body.position_range()], body.position_range());
        let (to, d) = (&mut next.q[to], &displacement[body.dof_range()]);
        match body.joint.kind {
            JointKind::Fixed => {}
            JointKind::Revolute { .. } | JointKind::Prismatic { .. } | JointKind::Screw { .. } => {
                to[0] = from[0] + d[0];
            }
            JointKind::Spherical => turn(from, d, to),
            JointKind::Free => {
                for k in 0..3 {
                    to[k] = from[k] + d[3 + k];
                }
                turn(&from[3..], d, &mut to[3..]);
            }
        }
    }
}

fn turn(from: &[f64], u: &[f64], to: &mut [f64]) {
    let turned = quaternion(from).integrate(vec3(u[0], u[1], u[2]));
    to.copy_from_slice(&turned.to_glam().to_array());
}

/// Turns rates (or their multiples) into rates of the displacement at zero displacement: only the
/// linear part of free joints changes, from the child's axes to the parent's.
pub(crate) fn to_displacement_axes(model: &Model, state: &State, rates: &mut [f64]) {
    for body in model.bodies() {
        if body.joint.kind == JointKind::Free {
            let q = &state.q[body.position_range()];
            let linear = &mut rates[body.dof_start + 3..body.dof_start + 6];
            let rotation = quaternion(&q[3..]).normalized().to_matrix();
            let turned = rotation * vec3(linear[0], linear[1], linear[2]);
            linear.copy_from_slice(&turned.to_array());
        }
    }
}

/// Turns the rates of a stage into the rate of its displacement `u` from the start of the step.
fn displacement_rate(model: &Model, stage: &State, u: &[f64], rates: &mut [f64]) {
    to_displacement_axes(model, stage, rates);
    for body in model.bodies() {
        if matches!(body.joint.kind, JointKind::Spherical | JointKind::Free) {
            let dofs = body.dof_start..body.dof_start + 3;
            let (u, w) = (vector(&u[dofs.clone()]), vector(&rates[dofs.clone()]));
            rates[dofs].copy_from_slice(&rotation_vector_rate(u, w).to_array());
        }
    }
}

fn vector(v: &[f64]) -> Vec3<f64> {
    vec3(v[0], v[1], v[2])
}

fn quaternion(q: &[f64]) -> Quat<f64> {
    Quat::from_xyzw(q[0], q[1], q[2], q[3])
}
