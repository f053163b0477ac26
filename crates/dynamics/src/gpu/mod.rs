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

/// What batches by the articulated-body algorithm are called, which compute neither screws nor what acts in joints, and
/// what to take instead.
const LANES: (&str, &str) = (
    "batches by the articulated-body algorithm",
    "ask for divide and conquer (`BatchOptions::algorithm`)",
);

fn element_unavailable(body: &str) -> Error {
    let (by, remedy) = LANES;
    Error::ElementUnavailable {
        body: body.to_owned(),
        by,
        remedy,
    }
}

/// Refuses what the recursion in lanes does not compute.
fn check_bare(model: &Model) -> Result<(), Error> {
    let (by, remedy) = LANES;
    crate::loops::refuse_loops(model, by, remedy)?;
    let is_screw = |kind| matches!(kind, JointKind::Screw { .. });
    if let Some(body) = model.bodies().iter().find(|body| is_screw(body.joint.kind)) {
        return Err(Error::JointUnavailable {
            body: body.name.clone(),
            by,
            remedy,
        });
    }
    match model.first_element().and_then(|id| model.body(id)) {
        None => Ok(()),
        Some(body) => Err(element_unavailable(&body.name)),
    }
}

/// Refuses inertia of the freedoms' own, which the recursion in lanes does not compute.
fn check_forces(model: &Model, forces: &Forces) -> Result<(), Error> {
    let (by, remedy) = LANES;
    match forces.joint_inertia.iter().position(|&own| own != 0.0) {
        None => Ok(()),
        Some(dof) => Err(Error::JointInertiaUnavailable {
            body: crate::forces::body_of_dof(model, dof),
            by,
            remedy,
        }),
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
