//! Where a simulation takes its steps.

use super::host::{self, Host};
#[cfg(feature = "gpu")]
use super::remote::Remote;
use crate::{Choice, Device, Error, Solver, SolverOptions, Workspace};
use vertebra_assembly::Model;

/// Where steps are taken.
#[derive(Debug)]
pub(super) enum Runs {
    Host(Box<Host>),
    #[cfg(feature = "gpu")]
    Gpu(Box<Remote>),
}

impl Runs {
    /// Where a model runs that was put on a device, and why there.
    pub(super) fn on(device: &Device, model: &Model) -> Result<(Self, Choice), Error> {
        #[cfg(feature = "gpu")]
        let mut gpu_s = None;
        #[cfg(feature = "gpu")]
        if let Some(gpu) = device.gpu() {
            let options = crate::gpu::Options::default();
            let expected = Choice::with_gpu(model, gpu, &options)?;
            let forced = !device.is_where_faster();
            if forced || expected.on_gpu {
                match Self::on_gpu(gpu, model, &options, (expected, forced)) {
                    Err(Error::ModelTooLarge { .. }) if !forced => {}
                    outcome => return outcome,
                }
            }
            gpu_s = expected.gpu_s;
        }
        #[cfg(not(feature = "gpu"))]
        let (gpu_s, _) = (None, device);
        let solver = Solver::new(model, &SolverOptions::default())?;
        let choice = Choice {
            gpu_s,
            ..*solver.choice()
        };
        Ok((Self::Host(Box::new(Host::new(model, solver))), choice))
    }

    /// On a GPU, given what was expected, and whether that was asked for.
    #[cfg(feature = "gpu")]
    pub(super) fn on_gpu(
        device: &vertebra_gpu::Device,
        model: &Model,
        options: &crate::gpu::Options,
        (expected, forced): (Choice, bool),
    ) -> Result<(Self, Choice), Error> {
        let remote = Remote::new(device, model, options)?;
        let choice = remote.choice(Choice { forced, ..expected });
        Ok((Self::Gpu(Box::new(remote)), choice))
    }

    /// The solver's own workspace or, if it has none, another, made when first asked for.
    pub(super) fn workspace<'a>(
        &'a mut self,
        model: &Model,
        other: &'a mut Option<Workspace>,
    ) -> &'a mut Workspace {
        match self {
            Self::Host(host) => host::workspace(&mut host.solver, model, other),
            #[cfg(feature = "gpu")]
            Self::Gpu(_) => {
                other.get_or_insert_with(|| Workspace::new(model, crate::Precision::F64))
            }
        }
    }
}
