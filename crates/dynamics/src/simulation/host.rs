//! Steps on the processor.

use crate::integrate::{Stages, Step};
use crate::{
    Elements, Error, Forces, Integrator, LoopForces, Monitor, Solver, Work, Workspace,
    finite_results,
};
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
        None => other.get_or_insert_with(|| Workspace::of_tree(model, precision)),
    }
}

/// What steps on the processor need: none of it is taken later.
#[derive(Debug)]
pub(super) struct Host {
    pub(super) solver: Solver,
    next: State,
    stages: Stages,
    /// The forces and those of the loops, once they have been asked for.
    held: Option<Forces>,
    /// What acts in the joints; none until there is anything.
    pub(super) elements: Option<Box<Elements>>,
    /// Work that loops have done \[J\].
    pub(super) loop_work: f64,
}

impl Host {
    pub(super) fn new(model: &Model, solver: Solver) -> Self {
        let elements = || Box::new(Elements::new(model));
        Self {
            elements: model.first_element().map(|_| elements()),
            solver,
            next: State::neutral(model),
            stages: Stages::new(model),
            held: None,
            loop_work: 0.0,
        }
    }

    /// Work done in the steps taken so far.
    pub(super) fn work(&self) -> Work {
        let elements = (self.elements.as_ref()).map_or_else(Work::default, |own| *own.work());
        Work {
            loops: self.loop_work,
            ..elements
        }
    }

    /// Moves a state until its loops are closed, or leaves it as it is.
    pub(super) fn close_loops(
        &mut self,
        model: &Model,
        state: &mut State,
        forces: &Forces,
    ) -> Result<(), Error> {
        if !self.solver.has_loops() {
            return Ok(());
        }
        self.next.clone_from(state);
        let forces = match busy(&mut self.elements) {
            Some(elements) => elements.load(state, forces, 0.0)?,
            None => forces,
        };
        self.solver.forward_dynamics(model, state, forces)?;
        self.solver.close(model, &mut self.next, forces)?;
        core::mem::swap(state, &mut self.next);
        Ok(())
    }

    /// The forces that keep loops and couplings.
    pub(super) fn loop_forces(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<LoopForces, Error> {
        let forces = match busy(&mut self.elements) {
            Some(elements) => elements.load(state, forces, 0.0)?,
            None => forces,
        };
        self.solver.forward_dynamics(model, state, forces)?;
        Ok(self.solver.loop_forces(model))
    }

    /// The joint accelerations [rad/s^2 or m/s^2].
    pub(super) fn accelerations(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<Vec<f64>, Error> {
        let forces = match busy(&mut self.elements) {
            Some(elements) => elements.load(state, forces, 0.0)?,
            None => forces,
        };
        let solved = self.solver.forward_dynamics(model, state, forces);
        solved.map(<[f64]>::to_vec)
    }

    /// The forces that act without a step, those of elements and loops included, and the solver.
    pub(super) fn all_forces<'a>(
        &'a mut self,
        model: &Model,
        state: &State,
        forces: &'a Forces,
    ) -> Result<(&'a Forces, &'a mut Solver), Error> {
        let forces = match busy(&mut self.elements) {
            Some(elements) => elements.load(state, forces, 0.0)?,
            None => forces,
        };
        if !self.solver.has_loops() {
            return Ok((forces, &mut self.solver));
        }
        self.solver.forward_dynamics(model, state, forces)?;
        let held = self.held.get_or_insert_with(|| Forces::none(model));
        held.copy_from(forces);
        self.solver.add_loop_forces(model, held);
        Ok((held, &mut self.solver))
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
            monitor.record(state.time, found)?;
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
        solver.begin_step(integrator);
        let taken = step.take(integrator, solver, stages, &mut self.next);
        solver.end_step();
        taken?;
        let loop_work = self.close_step(model, state, forces, (h, integrator))?;
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
            let epsilon = self.solver.choice().tree.epsilon();
            elements.account((state, &self.next), (h, integrator), epsilon);
        }
        self.loop_work += loop_work;
        core::mem::swap(state, &mut self.next);
        if let Some(monitor) = monitor {
            monitor.count(1);
        }
        Ok(())
    }

    /// Closes the loops at the end of a step; gives the work that they have done in it \[J\].
    fn close_step(
        &mut self,
        model: &Model,
        start: &State,
        forces: &Forces,
        (h, integrator): (f64, Integrator),
    ) -> Result<f64, Error> {
        if !self.solver.has_loops() {
            return Ok(0.0);
        }
        let in_step = match integrator {
            Integrator::SemiImplicitEuler => self.solver.loop_work(model, [start, &self.next], h),
            Integrator::RungeKutta4 | Integrator::ImplicitMidpoint => 0.0,
        };
        let before = self.energy(model, forces);
        // New factors have the inertia of the freedoms' own that those of the step have.
        let loaded = busy(&mut self.elements).map_or(forces, |elements| elements.loaded());
        self.solver.close(model, &mut self.next, loaded)?;
        Ok(in_step + self.energy(model, forces) - before)
    }

    /// Kinetic energy in the metric in which loops are closed, and potential energy at the end of a step \[J\].
    fn energy(&mut self, model: &Model, forces: &Forces) -> f64 {
        let loaded = busy(&mut self.elements).map_or(forces, |elements| elements.loaded());
        let own = loaded.own_energy(model, &self.next.qd);
        self.solver.energy(model, &self.next) + own
    }
}
