//! A model in motion.

use crate::integrate::{Stages, Step};
use crate::{
    BodyMotion, Error, Forces, Integrator, Mechanics, Precision, Workspace, aba, body_poses,
    finite_results, forward_kinematics, joint_wrenches, mechanics,
};
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
    workspace: Workspace,
    stages: Stages,
    /// Whether the workspace's poses are those of `state`.
    posed: bool,
}

impl Simulation {
    /// A simulation on the CPU in f64, from the neutral state, with semi-implicit Euler steps.
    ///
    /// # Errors
    /// None yet: a model that was built can be simulated. Other devices will have some.
    pub fn new(model: Model) -> Result<Self, Error> {
        let state = State::neutral(&model);
        Ok(Self {
            next: state.clone(),
            state,
            forces: Forces::none(&model),
            integrator: Integrator::default(),
            workspace: Workspace::new(&model, Precision::F64),
            stages: Stages::new(&model),
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

    /// Chooses the precision in which accelerations are computed; the state stays in f64.
    #[must_use]
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.workspace = Workspace::new(&self.model, precision);
        self.posed = false;
        self
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
        let step = Step {
            model: &self.model,
            start: &self.state,
            h,
            forces: &self.forces,
        };
        step.take(
            self.integrator,
            &mut self.workspace,
            &mut self.stages,
            &mut self.next,
        )?;
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
        Ok(())
    }

    /// Where a body is in the world.
    ///
    /// # Errors
    /// [`Error::UnknownBody`].
    pub fn pose(&mut self, body: BodyId) -> Result<Pose, Error> {
        self.update_kinematics()?;
        self.workspace.pose(body)
    }

    /// How fast a body moves.
    ///
    /// # Errors
    /// [`Error::UnknownBody`].
    pub fn velocity(&mut self, body: BodyId) -> Result<BodyMotion, Error> {
        self.update_kinematics()?;
        self.workspace.velocity(body)
    }

    fn update_kinematics(&mut self) -> Result<(), Error> {
        if !self.posed {
            forward_kinematics(&self.model, &self.state, &mut self.workspace)?;
            self.posed = true;
        }
        Ok(())
    }

    /// Solves the dynamics of the current state under the current forces and gives the workspace to
    /// read from: joint and body accelerations, joint wrenches, poses and velocities.
    ///
    /// # Errors
    /// [`Error`] as for a step.
    pub fn solve(&mut self) -> Result<&Workspace, Error> {
        self.posed = false;
        aba(&self.model, &self.state, &self.forces, &mut self.workspace)?;
        joint_wrenches(&mut self.workspace)?;
        body_poses(&mut self.workspace)?;
        self.posed = true;
        Ok(&self.workspace)
    }

    /// Energies, momenta and centre of mass.
    ///
    /// # Errors
    /// [`Error::Overflow`].
    pub fn mechanics(&mut self) -> Result<Mechanics, Error> {
        self.posed = false;
        let sums = mechanics(&self.model, &self.state, &mut self.workspace)?;
        // Its kinematics are those of the state.
        self.posed = true;
        Ok(sums)
    }
}
