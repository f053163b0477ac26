//! Steps on the processor.

use crate::integrate::{Stages, Step};
use crate::{Elements, Error, Forces, Integrator, Monitor, Solver, finite_results};
use vertebra_assembly::{Body, Model, State};

/// What steps on the processor need: none of it is taken later.
#[derive(Debug)]
pub(super) struct Host {
    pub(super) solver: Solver,
    next: State,
    stages: Stages,
}

impl Host {
    pub(super) fn new(model: &Model, solver: Solver) -> Self {
        Self {
            solver,
            next: State::neutral(model),
            stages: Stages::new(model),
        }
    }

    /// Moves a state on by `h` \[s\], or leaves it as it is.
    pub(super) fn step(
        &mut self,
        model: &Model,
        state: &mut State,
        (forces, mut elements): (&Forces, Option<&mut Elements>),
        (h, integrator): (f64, Integrator),
        monitor: &mut Option<Monitor>,
    ) -> Result<(), Error> {
        if let Some(monitor) = monitor
            && monitor.is_due()
        {
            let forces = match &mut elements {
                Some(elements) => elements.load(state, forces, h)?,
                None => forces,
            };
            let found = self.solver.check(model, state, forces)?;
            monitor.record(state.time, found);
        }
        elements = elements.filter(|elements| !elements.is_idle());
        if let Some(elements) = &elements {
            elements.check_integrator(integrator)?;
        }
        let mut step = Step {
            model,
            start: state,
            h,
            forces,
            elements: elements.as_deref_mut(),
        };
        let (solver, stages) = (&mut self.solver, &mut self.stages);
        step.take(integrator, solver, stages, &mut self.next)?;
        let time = state.time;
        finite_results(model, "joint rate", &self.next.qd, time)?;
        let overflowed = |body: &&Body| {
            let q = &self.next.q[body.position_range()];
            !q.iter().all(|q| q.is_finite())
        };
        if let Some(body) = model.bodies().iter().find(overflowed) {
            return Err(Error::Overflow {
                quantity: "joint position",
                body: body.name.clone(),
                time,
            });
        }
        if let Some(elements) = elements {
            elements.account(state, h, self.solver.choice().tree.epsilon());
        }
        core::mem::swap(state, &mut self.next);
        if let Some(monitor) = monitor {
            monitor.count();
        }
        Ok(())
    }
}
