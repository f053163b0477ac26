//! A model in motion.

use crate::integrate::{Stages, Step};
use crate::{
    BodyMotion, Choice, Error, Forces, Integrator, Mechanics, Monitor, Precision, Solver,
    SolverOptions, Workspace, aba, body_poses, finite_results, forward_kinematics, joint_wrenches,
    mechanics,
};
use crate::{LoopForces, LoopViolation};
use vertebra_assembly::{Body, BodyId, Model, State};
use vertebra_spatial::Pose;

/// A model, its state, the forces on it, and all memory that steps need: none is taken later.
///
/// A step that fails leaves the state as it was.
#[derive(Clone, Debug)]
pub struct Simulation {
    model: Model,
    state: State,
    next: State,
    forces: Forces,
    integrator: Integrator,
    solver: Solver,
    /// For kinematics and [`solve`](Self::solve), if the solver's own memory does not serve.
    workspace: Option<Workspace>,
    stages: Stages,
    monitor: Option<Monitor>,
    /// The forces and those of the loops at the last [`solve`](Self::solve), if there are loops.
    held: Option<Forces>,
    /// Whether the workspace's poses are those of `state`.
    posed: bool,
}

impl Simulation {
    /// A simulation on the CPU in f64, from the neutral state, with semi-implicit Euler steps.
    ///
    /// # Errors
    /// None yet: a model that was built can be simulated. Other devices have some.
    pub fn new(model: Model) -> Result<Self, Error> {
        let state = State::neutral(&model);
        let solver = Solver::new(&model, &SolverOptions::default())?;
        Ok(Self {
            next: state.clone(),
            state,
            forces: Forces::none(&model),
            integrator: Integrator::default(),
            solver,
            workspace: None,
            stages: Stages::new(&model),
            monitor: None,
            held: None,
            posed: false,
            model,
        })
    }

    /// Chooses the integrator.
    #[must_use]
    pub const fn with_integrator(mut self, integrator: Integrator) -> Self {
        self.integrator = integrator;
        self
    }

    /// Chooses how accelerations are computed; the state stays in f64.
    ///
    /// # Errors
    /// As [`Solver::new`].
    pub fn with_solver(mut self, options: &SolverOptions) -> Result<Self, Error> {
        self.solver = Solver::new(&self.model, options)?;
        self.workspace = None;
        self.posed = false;
        Ok(self)
    }

    /// Chooses the precision in which accelerations are computed, by whichever algorithm is expected
    /// to be faster.
    ///
    /// # Errors
    /// As [`Solver::new`].
    pub fn with_precision(self, precision: Precision) -> Result<Self, Error> {
        self.with_solver(&SolverOptions {
            precision,
            ..SolverOptions::default()
        })
    }

    /// Checks the accelerations of every so many steps, the first one's included
    /// ([`Solver::check`]): a step that is checked takes one and a half solutions more.
    /// [`monitor`](Self::monitor) has what was found.
    #[must_use]
    pub const fn with_monitor(mut self, monitor: Monitor) -> Self {
        self.monitor = Some(monitor);
        self
    }

    /// What the checks have found; none without [`with_monitor`](Self::with_monitor).
    #[must_use]
    pub const fn monitor(&self) -> Option<&Monitor> {
        self.monitor.as_ref()
    }

    /// The solver, which says how a tolerance was met ([`Solver::achieved`]).
    #[must_use]
    pub const fn solver(&self) -> &Solver {
        &self.solver
    }

    /// The algorithm that computes accelerations, and why that one.
    #[must_use]
    pub const fn choice(&self) -> &Choice {
        self.solver.choice()
    }

    /// The model.
    #[must_use]
    pub const fn model(&self) -> &Model {
        &self.model
    }

    /// The state.
    #[must_use]
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// Replaces the state.
    ///
    /// # Errors
    /// [`Error::Model`] if it does not fit the model; then the old one is kept.
    pub fn set_state(&mut self, state: State) -> Result<(), Error> {
        state.check(&self.model)?;
        self.state = state;
        self.posed = false;
        Ok(())
    }

    /// The forces that act in the coming steps.
    #[must_use]
    pub const fn forces(&self) -> &Forces {
        &self.forces
    }

    /// The forces that act in the coming steps, to be changed.
    pub const fn forces_mut(&mut self) -> &mut Forces {
        &mut self.forces
    }

    /// Moves on by `h` \[s\]; a negative step goes back in time.
    ///
    /// # Errors
    /// [`Error`]; the state is then as it was.
    pub fn step(&mut self, h: f64) -> Result<(), Error> {
        if !h.is_finite() {
            return Err(Error::NonFiniteInput {
                quantity: "step",
                element: "simulation".to_owned(),
                value: h,
            });
        }
        self.posed = false;
        if let Some(monitor) = &mut self.monitor
            && monitor.is_due()
        {
            let found = self.solver.check(&self.model, &self.state, &self.forces)?;
            monitor.record(self.state.time, found);
        }
        let step = Step {
            model: &self.model,
            start: &self.state,
            h,
            forces: &self.forces,
        };
        step.take(
            self.integrator,
            &mut self.solver,
            &mut self.stages,
            &mut self.next,
        )?;
        self.solver
            .close(&self.model, &mut self.next, &self.forces)?;
        let time = self.state.time;
        finite_results(&self.model, "joint rate", &self.next.qd, time)?;
        let overflowed = |body: &&Body| {
            let q = &self.next.q[body.position_range()];
            !q.iter().all(|q| q.is_finite())
        };
        if let Some(body) = self.model.bodies().iter().find(overflowed) {
            return Err(Error::Overflow {
                quantity: "joint position",
                body: body.name.clone(),
                time,
            });
        }
        core::mem::swap(&mut self.state, &mut self.next);
        if let Some(monitor) = &mut self.monitor {
            monitor.count();
        }
        Ok(())
    }

    /// Moves the state until the loops of the model are closed: positions by the least motion in the mass metric
    /// that Newton's method finds, then rates. To be called on states that do not satisfy them; steps keep them
    /// closed by themselves.
    ///
    /// # Errors
    /// [`Error::LoopNotClosed`] if that cannot be reached from here; [`Error`] as for a step. The state is then as
    /// it was.
    pub fn close_loops(&mut self) -> Result<(), Error> {
        self.posed = false;
        self.next.clone_from(&self.state);
        (self.solver).forward_dynamics(&self.model, &self.state, &self.forces)?;
        self.solver
            .close(&self.model, &mut self.next, &self.forces)?;
        core::mem::swap(&mut self.state, &mut self.next);
        Ok(())
    }

    /// How far the state is from closed loops and kept couplings, of the worst of them; none if the model has none.
    #[must_use]
    pub fn loop_violation(&mut self) -> Option<LoopViolation> {
        self.solver.loop_violation(&self.model, &self.state)
    }

    /// The forces that keep the loops closed and the joints coupled in the current state, under the current forces.
    ///
    /// Where loops ask for the same thing twice, those of least norm, a loop's moments counted over the length of its
    /// longest link and each loop by the compliance it meets: they share alike.
    ///
    /// # Errors
    /// [`Error`] as for a step.
    pub fn loop_forces(&mut self) -> Result<LoopForces, Error> {
        self.posed = false;
        (self.solver).forward_dynamics(&self.model, &self.state, &self.forces)?;
        Ok(self.solver.loop_forces(&self.model))
    }

    /// Where a body is in the world.
    ///
    /// # Errors
    /// [`Error::UnknownBody`].
    pub fn pose(&mut self, body: BodyId) -> Result<Pose, Error> {
        self.posed_workspace()?.pose(body)
    }

    /// How fast a body moves.
    ///
    /// # Errors
    /// [`Error::UnknownBody`].
    pub fn velocity(&mut self, body: BodyId) -> Result<BodyMotion, Error> {
        self.posed_workspace()?.velocity(body)
    }

    /// The workspace, with the kinematics of the current state.
    fn posed_workspace(&mut self) -> Result<&mut Workspace, Error> {
        let workspace = workspace(&self.model, &mut self.solver, &mut self.workspace);
        if !self.posed {
            forward_kinematics(&self.model, &self.state, workspace)?;
            self.posed = true;
        }
        Ok(workspace)
    }

    /// Solves the dynamics of the current state under the current forces, always by the
    /// articulated-body algorithm, and gives the workspace to read from: joint and body
    /// accelerations, joint wrenches, poses and velocities. Forces of loops and couplings act as forces on the
    /// bodies and in the joints.
    ///
    /// # Errors
    /// [`Error`] as for a step.
    pub fn solve(&mut self) -> Result<&Workspace, Error> {
        self.posed = false;
        if self.solver.has_loops() {
            (self.solver).forward_dynamics(&self.model, &self.state, &self.forces)?;
            let held = (self.held).get_or_insert_with(|| Forces::none(&self.model));
            held.joint.clone_from(&self.forces.joint);
            held.clear_external();
            for &(body, wrench) in self.forces.external() {
                held.push(body, wrench);
            }
            self.solver.add_loop_forces(&self.model, held);
        }
        let workspace = workspace(&self.model, &mut self.solver, &mut self.workspace);
        match &self.held {
            Some(held) => aba(&self.model, &self.state, held, workspace)?,
            None => aba(&self.model, &self.state, &self.forces, workspace)?,
        };
        joint_wrenches(workspace)?;
        body_poses(workspace)?;
        self.posed = true;
        Ok(workspace)
    }

    /// Energies, momenta and centre of mass.
    ///
    /// # Errors
    /// [`Error::Overflow`].
    pub fn mechanics(&mut self) -> Result<Mechanics, Error> {
        self.posed = false;
        let workspace = workspace(&self.model, &mut self.solver, &mut self.workspace);
        let sums = mechanics(&self.model, &self.state, workspace)?;
        // Its kinematics are those of the state.
        self.posed = true;
        Ok(sums)
    }
}

/// The solver's own workspace or, if it has none, another, made when first asked for.
fn workspace<'a>(
    model: &Model,
    solver: &'a mut Solver,
    other: &'a mut Option<Workspace>,
) -> &'a mut Workspace {
    let precision = solver.choice().precision;
    match solver.workspace_mut() {
        Some(own) => own,
        None => other.get_or_insert_with(|| Workspace::new(model, precision)),
    }
}
