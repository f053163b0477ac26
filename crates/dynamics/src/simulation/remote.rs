//! Steps on a GPU.

use super::host::Host;
use crate::{Algorithm, Choice, Error, Forces, Integrator, Monitor, Solver, SolverOptions, gpu};
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
    /// What answers questions about loops in one state, once there was one.
    host: Option<Box<Host>>,
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
            host: None,
        })
    }

    /// The same model with other precisions and chunks, in the neutral state.
    pub(super) fn with_solver(
        &self,
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
        Self::new(&self.device, model, &options)
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

    pub(super) fn set_state(&mut self, state: &State) -> Result<(), Error> {
        self.simulation.set_state(state)?;
        self.is_ahead = false;
        Ok(())
    }

    /// The processor's side of the same model, in f64.
    pub(super) fn host(&mut self, model: &Model) -> Result<&mut Host, Error> {
        let host = match self.host.take() {
            Some(host) => host,
            None => {
                let solver = Solver::new(model, &SolverOptions::default())?;
                Box::new(Host::new(model, solver))
            }
        };
        Ok(self.host.insert(host))
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

const fn unavailable(what: &'static str) -> Error {
    Error::UnavailableOnGpu {
        what,
        remedy: "leave it out, or simulate on `Device::cpu()`",
    }
}
