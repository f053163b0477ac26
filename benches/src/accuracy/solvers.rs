//! The solvers whose errors are measured: those of the processor, or those of a GPU.

use super::entry::{TOLERANCE, TOLERANCE_METHOD};
use crate::suite::solver::{Aba, Dca, Refined, Solver, ToTolerance};
use vertebra::dynamics::gpu::{Options, Simulation};
use vertebra::{Error, Forces, Model, Precision, Residual, SolverOptions, State};
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::Features;

/// A solver and the name of its precision.
pub(super) type Measured = (&'static str, Box<dyn Solver>);

/// Solvers, and where they run.
pub struct Solvers {
    /// Name, interface and driver of a GPU; empty of a processor, where it makes no difference which.
    pub(super) device: String,
    pub(super) list: Vec<Measured>,
}

impl Solvers {
    /// Those of the processor.
    #[must_use]
    pub fn on_cpu() -> Self {
        use Precision::{F32, F64};
        Self {
            device: String::new(),
            list: vec![
                ("f64", Box::new(Aba(F64))),
                ("f32", Box::new(Aba(F32))),
                ("f64", Box::new(Dca::new("dca", F64, F64))),
                ("f64/f32", Box::new(Dca::new("dca", F64, F32))),
                ("f32", Box::new(Dca::new("dca", F32, F32))),
                ("f64", Box::new(Refined::aba("aba+1", 1))),
                ("f64", Box::new(Refined::aba("aba+2", 2))),
                ("f64/f32", Box::new(Refined::dca("dca+1", F64, F32, 1))),
                ("f64/f32", Box::new(Refined::dca("dca+2", F64, F32, 2))),
                ("f32", Box::new(Refined::dca("dca+1", F32, F32, 1))),
                ("f32", Box::new(Refined::dca("dca+2", F32, F32, 2))),
                ("any", Box::new(ToTolerance(TOLERANCE_METHOD, TOLERANCE))),
            ],
        }
    }

    /// Whether one of this name and precision is among them.
    pub(super) fn have(&self, method: &str, precision: &str) -> bool {
        let mut list = self.list.iter();
        list.any(|(name, solver)| solver.method() == method && *name == precision)
    }

    /// Divide and conquer on a GPU in all precisions it has, with as many corrections as help in each.
    #[must_use]
    pub fn on_gpu(device: &Device) -> Self {
        use Precision::{F32, F64};
        let on = |name, chunks, tree, sweeps| -> Box<dyn Solver> {
            Box::new(OnGpu {
                name,
                device: device.clone(),
                options: Options {
                    chunks: Some(chunks),
                    tree: Some(tree),
                    sweeps,
                    ..Options::default()
                },
            })
        };
        let mut list = vec![("f32", on("dca", F32, F32, 0))];
        if device.features().contains(Features::SHADER_F64) {
            list.extend([
                ("f64/f32", on("dca", F64, F32, 0)),
                ("f64/f32", on("dca+1", F64, F32, 1)),
                ("f64/f32", on("dca+2", F64, F32, 2)),
                ("f64", on("dca", F64, F64, 0)),
                ("f64", on("dca+1", F64, F64, 1)),
            ]);
        }
        let to_tolerance = OnGpuToTolerance(device.clone());
        list.push(("any", Box::new(to_tolerance)));
        Self {
            device: device.description(),
            list,
        }
    }
}

/// Whatever meets the tolerance on a GPU, or on the processor where that cannot.
struct OnGpuToTolerance(Device);

impl Solver for OnGpuToTolerance {
    fn method(&self) -> &'static str {
        TOLERANCE_METHOD
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }

    fn keeps_body_forces(&self) -> bool {
        false
    }

    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error> {
        let device = self.0.clone().into();
        let mut simulation = vertebra::Simulation::on(&device, model.clone())?
            .with_solver(&SolverOptions::to_tolerance(TOLERANCE))?;
        let solve = |(state, forces): &(State, Forces)| {
            simulation.set_state(state.clone())?;
            simulation.forces_mut().clone_from(forces);
            simulation.accelerations()
        };
        inputs.iter().map(solve).collect()
    }

    fn residual(&self, _: &Model, _: &State, _: &Forces) -> Result<Option<Residual>, Error> {
        Ok(None)
    }
}

/// Divide and conquer on a GPU: a simulation for each problem, of kernels that are compiled once.
struct OnGpu {
    name: &'static str,
    device: Device,
    options: Options,
}

impl Solver for OnGpu {
    fn method(&self) -> &'static str {
        self.name
    }

    fn precision(&self) -> Precision {
        self.options.tree.unwrap_or(Precision::F32)
    }

    fn keeps_body_forces(&self) -> bool {
        false
    }

    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error> {
        let mut simulation = Simulation::on(&self.device, model, &self.options)?;
        let solve = |(state, forces): &(State, Forces)| {
            simulation.set_state(state)?;
            simulation.set_forces(forces)?;
            simulation.accelerations()
        };
        inputs.iter().map(solve).collect()
    }

    fn residual(&self, _: &Model, _: &State, _: &Forces) -> Result<Option<Residual>, Error> {
        Ok(None)
    }
}
