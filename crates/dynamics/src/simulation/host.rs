//! Steps on the processor.

use crate::integrate::{Stages, Step};
use crate::{Elements, Error, Forces, Integrator, Monitor, Solver, Workspace, finite_results};
use vertebra_assembly::{Body, Model, State};

/// The elements, if there is anything for them to do.
pub(super) fn busy(elements: &mut Option<Box<Elements>>) -> Option<&mut Elements> {
    let elements = elements.as_deref_mut();
    elements.filter(|elements| !elements.is_idle())
}

/// The solver's own workspace or, if it has none, another, made when first asked for.
pub(super) fn workspace<'a>(
    solver: &'a mut Solver,
    model: &Model,
    other: &'a mut Option<Workspace>,
) -> &'a mut Workspace {
    let precision = solver.choice().precision;
    match solver.workspace_mut() {
        Some(own) => own,
        None => other.get_or_insert_with(|| Workspace::new(model, precision)),
    }
}

/// What steps on the processor need: none of it is taken later.
#[derive(Debug)]
pub(super) struct Host {
    pub(super) solver: Solver,
    next: State,
    stages: Stages,
    /// What acts in the joints; none until there is anything.
    pub(super) elements: Option<Box<Elements>>,
}

impl Host {
    pub(super) fn new(model: &Model, solver: Solver) -> Self {
        let elements = Elements::new(model);
        Self {
            elements: (!elements.is_idle()).then(|| Box::new(elements)),
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
        forces: &Forces,
        (h, integrator): (f64, Integrator),
        monitor: &mut Option<Monitor>,
    ) -> Result<(), Error> {
        if let Some(monitor) = monitor
            && monitor.is_due()
        {
            let forces = match busy(&mut self.elements) {
                Some(elements) => elements.load(state, forces, h)?,
                None => forces,
            };
            let found = self.solver.check(model, state, forces)?;
            monitor.record(state.time, found);
        }
        let elements = busy(&mut self.elements);
        if let Some(elements) = &elements {
            elements.check_integrator(integrator)?;
        }
        let mut step = Step {
            model,
            start: state,
            h,
            forces,
            elements,
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
        if let Some(elements) = &mut self.elements {
            elements.account(state, h, self.solver.choice().tree.epsilon());
        }
        core::mem::swap(state, &mut self.next);
        if let Some(monitor) = monitor {
            monitor.count();
        }
        Ok(())
    }
}
