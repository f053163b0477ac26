//! Steps on a GPU.

use super::exact::Exact;
use super::host::Host;
use super::judge::Judge;
use crate::{
    Achieved, Algorithm, Choice, Error, Forces, Integrator, Monitor, Solver, SolverOptions, gpu,
};
use vertebra_assembly::{Model, State};
use vertebra_gpu::wgpu::Features;

/// What the host knows of a model in motion.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub(super) model: &'a Model,
    /// As it was set or read last.
    pub(super) state: &'a State,
    pub(super) forces: &'a Forces,
}

/// A simulation on a GPU, and what the host knows of it.
#[derive(Debug)]
pub(super) struct Remote {
    device: vertebra_gpu::Device,
    /// As its user wants them, where a tolerance does not decide.
    options: gpu::Options,
    pub(super) simulation: gpu::Simulation,
    /// Whether the host's state is older.
    pub(super) is_ahead: bool,
    /// Whether the host's forces are newer.
    pub(super) forces_changed: bool,
    /// How a tolerance is met, if one was asked for.
    exact: Option<Box<Exact>>,
    /// What the device's accelerations are held against, once they are.
    judge: Option<Box<Judge>>,
    /// What answers questions about loops in one state, once there was one.
    host: Option<Box<Host>>,
}

impl Remote {
    pub(super) fn new(
        device: &vertebra_gpu::Device,
        model: &Model,
        options: &gpu::Options,
    ) -> Result<Self, Error> {
        let simulation = gpu::Simulation::on(device, model, options)?;
        Ok(Self::of(device, simulation))
    }

    fn of(device: &vertebra_gpu::Device, simulation: gpu::Simulation) -> Self {
        Self {
            device: device.clone(),
            options: *simulation.options(),
            simulation,
            is_ahead: false,
            forces_changed: false,
            exact: None,
            judge: None,
            host: None,
        }
    }

    /// The same model with other precisions and chunks, in the neutral state; none where the device cannot be so
    /// exact.
    pub(super) fn with_solver(
        &mut self,
        model: &Model,
        options: &SolverOptions,
    ) -> Result<Option<Self>, Error> {
        if options.algorithm == Some(Algorithm::Aba) {
            return Err(unavailable("the articulated-body algorithm for one model"));
        }
        options.check_decided()?;
        let own = gpu::Options {
            schedule: options.schedule.or(self.options.schedule),
            ..self.options
        };
        let Some(tolerance) = options.tolerance else {
            let options = gpu::Options {
                chunks: Some(options.precision),
                tree: Some(options.tree.unwrap_or(options.precision)),
                sweeps: options.sweeps,
                ..own
            };
            let simulation = self.simulation.with_options(model, &options)?;
            return Ok(Some(Self::of(&self.device, simulation)));
        };
        let has_f64 = self.device.features().contains(Features::SHADER_F64);
        let exact = Exact::new(model, has_f64, tolerance)?;
        let Some(rung) = exact.rung() else {
            return Ok(None);
        };
        let simulation = (self.simulation).with_options(model, &rung.options(&own))?;
        Ok(Some(Self {
            options: own,
            exact: Some(Box::new(exact)),
            ..Self::of(&self.device, simulation)
        }))
    }

    /// The same model with chunks in another precision, in the neutral state; joins as the solver was asked for, or as a GPU has
    /// them where none was.
    pub(super) fn with_precision(
        &mut self,
        model: &Model,
        options: &SolverOptions,
    ) -> Result<Self, Error> {
        let asked = options.tree.unwrap_or(options.precision);
        let options = gpu::Options {
            chunks: Some(options.precision),
            tree: self.options.tree.and(Some(asked)),
            ..self.options
        };
        let simulation = self.simulation.with_options(model, &options)?;
        Ok(Self::of(&self.device, simulation))
    }

    /// What was chosen, given what was expected.
    pub(super) fn choice(&self, expected: Choice) -> Choice {
        let (precision, tree) = self.simulation.precisions();
        Choice {
            algorithm: Algorithm::Dca,
            precision,
            tree,
            on_gpu: true,
            ..expected
        }
    }

    /// How a tolerance was met when that was last measured.
    pub(super) fn achieved(&self) -> Option<&Achieved> {
        self.exact.as_ref()?.achieved()
    }

    pub(super) fn set_state(&mut self, state: &State) -> Result<(), Error> {
        self.simulation.set_state(state)?;
        self.is_ahead = false;
        if let Some(exact) = &mut self.exact {
            exact.measure_next();
        }
        Ok(())
    }

    /// The processor's side of the same model, in f64, with what acts in the joints.
    pub(super) fn host(&mut self, model: &Model) -> Result<&mut Host, Error> {
        let host = match self.host.take() {
            Some(host) => host,
            None => {
                let solver = Solver::new(model, &SolverOptions::default())?;
                Box::new(Host::new(model, solver))
            }
        };
        let host = self.host.insert(host);
        host.elements = (self.simulation.elements()).map(|elements| Box::new(elements.clone()));
        Ok(host)
    }

    /// Takes steps; what is to be checked is read between them.
    ///
    /// # Errors
    /// [`Error::Step`] of [`Error::ToleranceMissed`] where the device cannot be so exact from some step on.
    pub(super) fn steps(
        &mut self,
        problem: Problem<'_>,
        (h, integrator): (f64, Integrator),
        count: usize,
        monitor: &mut Option<Monitor>,
    ) -> Result<(), Error> {
        self.simulation.set_integrator(integrator)?;
        self.take_forces(problem.forces)?;
        self.simulation.check_step(h)?;
        let mut taken = 0;
        let failed = |step, source| Error::Step {
            step,
            count,
            source: Box::new(source),
        };
        loop {
            let mut next = count - taken;
            if next > 0 {
                self.check(problem, h, monitor)
                    .map_err(|source| failed(taken, source))?;
            }
            if let Some(monitor) = monitor {
                next = next.min(monitor.steps_to_next());
            }
            if let Some(exact) = &self.exact {
                next = next.min(exact.steps_to_next());
            }
            // Where no step was taken, the host's state is the one that was set, not yet rounded to the device's precision.
            let was_ahead = self.is_ahead;
            self.is_ahead = true;
            let (done, refused) = match self.simulation.steps(h, next) {
                Err(Error::Step { step, source, .. }) => (step, Some(*source)),
                Err(error) => {
                    self.is_ahead = was_ahead || matches!(error, Error::Gpu(_));
                    return Err(error);
                }
                Ok(()) => (next, None),
            };
            self.is_ahead = was_ahead || done > 0;
            taken += done;
            if let Some(monitor) = monitor {
                monitor.count(done as u64);
            }
            if let Some(exact) = &mut self.exact {
                exact.count(done);
            }
            match refused {
                None => {}
                Some(error) if self.exact.is_some() && is_of_precision(&error) => {
                    self.climb(problem)
                        .map_err(|source| failed(taken, source))?;
                }
                Some(error) => return Err(failed(taken, error)),
            }
            if taken == count {
                return Ok(());
            }
        }
    }

    /// The joint accelerations in the present state [rad/s^2 or m/s^2], to the tolerance if there is one.
    pub(super) fn accelerations(&mut self, problem: Problem<'_>) -> Result<Vec<f64>, Error> {
        self.take_forces(problem.forces)?;
        self.meet(problem, None)
    }

    fn take_forces(&mut self, forces: &Forces) -> Result<(), Error> {
        if self.forces_changed {
            self.simulation.set_forces(forces)?;
            self.forces_changed = false;
        }
        Ok(())
    }

    /// What is due before a step of `h` \[s\].
    fn check(
        &mut self,
        problem: Problem<'_>,
        h: f64,
        monitor: &mut Option<Monitor>,
    ) -> Result<(), Error> {
        if self.exact.as_ref().is_some_and(|exact| exact.is_due()) {
            self.meet(problem, Some(h))?;
        }
        let Some(monitor) = monitor.as_mut().filter(|monitor| monitor.is_due()) else {
            return Ok(());
        };
        let Problem { model, forces, .. } = problem;
        let (state, qdd) = self.simulation.solved(Some(h))?;
        let acting = self.simulation.acting(&state, forces, Some(h))?;
        let judge = judging(&mut self.judge, model)?;
        let found = judge.check((model, &state, acting), &qdd)?;
        monitor.record(state.time, found)
    }

    /// Accelerations that meet the tolerance, if there is one, by the rung in use or one that is dearer, which is
    /// then used: of a step, or without one as elements act now.
    fn meet(&mut self, problem: Problem<'_>, step: Option<f64>) -> Result<Vec<f64>, Error> {
        let Problem { model, forces, .. } = problem;
        if self.exact.as_mut().is_some_and(|exact| exact.descend()) {
            self.take_rung(problem)?;
        }
        loop {
            let Some(exact) = &mut self.exact else {
                return self.simulation.accelerations();
            };
            let refused = match self.simulation.solved(step) {
                Ok((state, qdd)) => {
                    let acting = self.simulation.acting(&state, forces, step)?;
                    let judge = judging(&mut self.judge, model)?;
                    match exact.measure((model, &state, acting), &qdd, judge) {
                        Ok(true) => return Ok(qdd),
                        Ok(false) => None,
                        Err(error) => Some(error),
                    }
                }
                Err(error) => Some(error),
            };
            match refused {
                Some(error) if !is_of_precision(&error) => return Err(error),
                _ => self.climb(problem)?,
            }
        }
    }

    /// Goes on by the next dearer rung, to be measured before its first step.
    fn climb(&mut self, problem: Problem<'_>) -> Result<(), Error> {
        if let Some(exact) = &mut self.exact {
            exact.climb();
        }
        self.take_rung(problem)
    }

    /// Goes on by the rung that is in use now, or the next dearer one that fits the device.
    fn take_rung(&mut self, problem: Problem<'_>) -> Result<(), Error> {
        let Some(exact) = &mut self.exact else {
            return Ok(());
        };
        let mut simulation = loop {
            let Some(rung) = exact.rung() else {
                return Err(exact.missed());
            };
            let own = rung.options(&self.options);
            match self.simulation.with_options(problem.model, &own) {
                Err(Error::ModelTooLarge { .. }) => exact.climb(),
                made => break made?,
            }
        };
        if self.is_ahead {
            simulation.set_state(&self.simulation.state()?)?;
        } else {
            simulation.set_state(problem.state)?;
        }
        simulation.set_integrator(self.simulation.options().integrator)?;
        simulation.set_forces(problem.forces)?;
        self.simulation = simulation;
        Ok(())
    }
}

/// Whether more precision may have an answer where there was none.
const fn is_of_precision(error: &Error) -> bool {
    matches!(
        error,
        Error::SingularJoint { .. } | Error::Unjoined { .. } | Error::Overflow { .. }
    )
}

/// What checks are made by, which takes its memory when first asked for.
fn judging<'a>(judge: &'a mut Option<Box<Judge>>, model: &Model) -> Result<&'a mut Judge, Error> {
    let made = match judge.take() {
        Some(made) => made,
        None => Box::new(Judge::new(model)?),
    };
    Ok(judge.insert(made))
}

const fn unavailable(what: &'static str) -> Error {
    Error::UnavailableOnGpu {
        what,
        remedy: "leave it out, or simulate on `Device::cpu()`",
    }
}
