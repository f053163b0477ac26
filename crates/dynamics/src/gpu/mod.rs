//! Simulation on a GPU: one articulation, tree or forest, by divide and conquer in O(log n) rounds; and
//! [`Batch`], many states of one model, a few lanes each or all by divide and conquer.
//!
//! [`crate::Simulation::on`] is the door to the former that most programs take; [`Simulation`] here is what
//! is behind it, with times on the device and options of its own.
//!
//! [`Simulation::on`] uploads a model once. Steps then run without the host: kinematics over the
//! assembly tree up and down, chunks assembled by a lane each, joins up and down, the chunks solved,
//! joints moved, body poses written to a buffer that other programs can read
//! ([`Simulation::pose_buffer`]). State, accelerations and poses come back when they are asked for.
//!
//! ```
//! use vertebra_assembly::{State, generate};
//! use vertebra_dynamics::gpu::{Options, Simulation};
//! use vertebra_gpu::Device;
//!
//! # if vertebra_gpu::tests_are_left_out() { return Ok(()); }
//! let device = Device::auto()?;
//! let model = generate::random_chain(64, &generate::Rod::default(), 7)?;
//! let mut simulation = Simulation::on(&device, &model, &Options::default())?;
//! simulation.set_state(&State::random(&model, 8))?;
//! simulation.steps(1e-4, 10)?;
//! assert!((simulation.time() - 1e-3).abs() < 1e-12);
//! let poses = simulation.poses()?;
//! assert_eq!(poses.len(), 64);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod batch;
mod dca;

pub use batch::{Batch, BatchChoice, BatchOptions};
pub use dca::{Options, PendingPoses, PoseBuffer, Simulation};

use crate::{Error, Forces, Integrator};
use vertebra_assembly::{JointKind, Model};

/// Refuses what kernels do not compute rather than leave it out.
pub(crate) fn check_model(model: &Model) -> Result<(), Error> {
    if crate::loops::has_loops(model) {
        return check_bare(model, Kernels::Loops);
    }
    Ok(())
}

/// Kernels that compute neither screws nor what acts in joints.
#[derive(Clone, Copy, Debug)]
enum Kernels {
    /// Of closed loops.
    Loops,
    /// Of the recursion in lanes.
    Lanes,
}

impl Kernels {
    /// What users know them by, and what to take instead.
    const fn describe(self) -> (&'static str, &'static str) {
        match self {
            Self::Loops => (
                "models with closed loops or couplings",
                "simulate on `Device::cpu()`",
            ),
            Self::Lanes => (
                "batches by the articulated-body algorithm",
                "ask for divide and conquer (`BatchOptions::algorithm`)",
            ),
        }
    }

    fn element_unavailable(self, body: &str) -> Error {
        let (by, remedy) = self.describe();
        Error::ElementUnavailable {
            body: body.to_owned(),
            by,
            remedy,
        }
    }

    fn inertia_unavailable(self, body: &str) -> Error {
        let (by, remedy) = self.describe();
        Error::JointInertiaUnavailable {
            body: body.to_owned(),
            by,
            remedy,
        }
    }
}

/// Refuses what such kernels do not compute.
fn check_bare(model: &Model, kernels: Kernels) -> Result<(), Error> {
    let is_screw = |kind| matches!(kind, JointKind::Screw { .. });
    if let Some(body) = model.bodies().iter().find(|body| is_screw(body.joint.kind)) {
        let (by, remedy) = kernels.describe();
        return Err(Error::JointUnavailable {
            body: body.name.clone(),
            by,
            remedy,
        });
    }
    match model.first_element().and_then(|id| model.body(id)) {
        None => Ok(()),
        Some(body) => Err(kernels.element_unavailable(&body.name)),
    }
}

/// Refuses inertia of the freedoms' own, which the recursion in lanes does not compute.
fn check_forces(model: &Model, forces: &Forces) -> Result<(), Error> {
    match forces.joint_inertia.iter().position(|&own| own != 0.0) {
        None => Ok(()),
        Some(dof) => {
            let body = crate::forces::body_of_dof(model, dof);
            Err(Kernels::Lanes.inertia_unavailable(&body))
        }
    }
}

/// The integrators that need no iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Explicit {
    SemiImplicitEuler,
    RungeKutta4,
}

impl TryFrom<Integrator> for Explicit {
    type Error = Error;

    fn try_from(integrator: Integrator) -> Result<Self, Error> {
        match integrator {
            Integrator::SemiImplicitEuler => Ok(Self::SemiImplicitEuler),
            Integrator::RungeKutta4 => Ok(Self::RungeKutta4),
            Integrator::ImplicitMidpoint => Err(Error::IntegratorUnavailable { integrator }),
        }
    }
}
