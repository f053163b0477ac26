//! A model in motion.

use crate::integrate::{Stages, Step};
use crate::{
    BodyMotion, Error, Forces, Integrator, Mechanics, Precision, Workspace, finite_results,
    forward_kinematics, mechanics,
};
use vertebra_assembly::{BodyId, Model, State};
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
        // Overflow of a position, and quaternions that left the group.
        self.next.check(&self.model)?;
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

    /// Energies, momenta and centre of mass.
    ///
    /// # Errors
    /// [`Error::Overflow`].
    pub fn mechanics(&mut self) -> Result<Mechanics, Error> {
        // Its kinematics are those of the state.
        self.posed = true;
        mechanics(&self.model, &self.state, &mut self.workspace)
    }
}
