//! Steps on a GPU.

use crate::{
    Algorithm, Choice, Error, Forces, Integrator, Monitor, Precision, SolverOptions, Workspace, gpu,
};
use vertebra_assembly::{Model, State};

/// A simulation on a GPU, and what the host knows of it.
#[derive(Debug)]
pub(super) struct Remote {
    device: vertebra_gpu::Device,
    pub(super) simulation: gpu::Simulation,
    /// Whether the host's state is older.
    pub(super) is_ahead: bool,
    /// Whether the host's forces are newer.
    pub(super) forces_changed: bool,
}

impl Remote {
    pub(super) fn new(
        device: &vertebra_gpu::Device,
        model: &Model,
        options: &gpu::Options,
    ) -> Result<Self, Error> {
        Ok(Self {
            simulation: gpu::Simulation::on(device, model, options)?,
            device: device.clone(),
            is_ahead: false,
            forces_changed: false,
        })
    }

    /// The same model with other precisions and chunks, in the neutral state.
    pub(super) fn with_solver(
        &mut self,
        model: &Model,
        options: &SolverOptions,
    ) -> Result<Self, Error> {
        if options.algorithm == Some(Algorithm::Aba) {
            return Err(unavailable("the articulated-body algorithm for one model"));
        }
        if options.tolerance.is_some() {
            return Err(unavailable("a solution to a tolerance"));
        }
        let own = self.simulation.options();
        let options = gpu::Options {
            chunks: Some(options.precision),
            tree: Some(options.tree.unwrap_or(options.precision)),
            schedule: options.schedule.or(own.schedule),
            ..*own
        };
        Ok(Self {
            simulation: self.simulation.with_options(model, &options)?,
            device: self.device.clone(),
            is_ahead: false,
            forces_changed: false,
        })
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

    /// The forces that act without a step, those of elements included.
    pub(super) fn all_forces<'a>(
        &'a mut self,
        state: &State,
        forces: &'a Forces,
    ) -> Result<&'a Forces, Error> {
        match self.simulation.elements_mut() {
            Some(elements) if !elements.is_idle() => elements.load(state, forces, 0.0),
            _ => Ok(forces),
        }
    }

    pub(super) fn set_state(&mut self, state: &State) -> Result<(), Error> {
        self.simulation.set_state(state)?;
        self.is_ahead = false;
        Ok(())
    }

    pub(super) fn steps(
        &mut self,
        forces: &Forces,
        (h, integrator): (f64, Integrator),
        count: usize,
        monitor: Option<&Monitor>,
    ) -> Result<(), Error> {
        if monitor.is_some() {
            return Err(unavailable("a monitor of accuracy"));
        }
        self.simulation.set_integrator(integrator)?;
        if self.forces_changed {
            self.simulation.set_forces(forces)?;
            self.forces_changed = false;
        }
        self.is_ahead = true;
        self.simulation.steps(h, count)
    }
}

/// For what the processor computes of a state.
pub(super) fn workspace<'a>(model: &Model, own: &'a mut Option<Workspace>) -> &'a mut Workspace {
    own.get_or_insert_with(|| Workspace::new(model, Precision::F64))
}

const fn unavailable(what: &'static str) -> Error {
    Error::UnavailableOnGpu {
        what,
        remedy: "leave it out, or simulate on `Device::cpu()`",
    }
}
