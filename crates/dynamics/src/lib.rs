//! Dynamics of articulated bodies on the CPU: forward (ABA, divide and conquer, CRBA) and inverse
//! (RNEA), kinematics, energies, integrators, and the residual that says how well a solution solves its equations.
//!
//! A [`Model`] is constant, a [`State`](vertebra_assembly::State) is what
//! is saved, a [`Workspace`] owns scratch and results; the algorithms are functions over them. A
//! [`Simulation`] bundles them all. All values are f64 in SI at the boundary; the precision inside
//! is a choice of the workspace: f32, f64, or a reference of 106 bits against which [`forward_error`]
//! measures the others.
//!
//! ```
//! use vertebra_assembly::{State, generate};
//! use vertebra_dynamics::{Forces, Precision, Workspace, Wrench, aba, joint_wrenches, residual};
//!
//! let model = generate::random_chain(128, &generate::Rod::default(), 7)?;
//! let state = State::random(&model, 8);
//! let mut forces = Forces::none(&model);
//! forces.push(model.last_body(), Wrench::at_center([0.0, 5.0, 0.0]));
//!
//! let mut workspace = Workspace::new(&model, Precision::F64);
//! let qdd = aba(&model, &state, &forces, &mut workspace)?;
//! assert_eq!(qdd.len(), 128);
//!
//! joint_wrenches(&mut workspace)?;
//! assert!(residual(&model, &state, &forces, &workspace)?.max() < 1e-12);
//! # Ok::<(), vertebra_dynamics::Error>(())
//! ```

mod aba;
mod across;
mod balance;
mod batch;
mod centroidal;
mod check;
mod choice;
mod correct;
mod cost;
mod crba;
mod dca;
mod derivatives;
mod device;
mod drift;
mod drive;
pub mod elements;
mod energy;
mod error;
mod external;
mod forces;
mod forward_error;
#[cfg(feature = "gpu")]
pub mod gpu;
mod integrate;
mod jacobian;
mod kinematics;
mod link;
mod loops;
mod monitor;
mod operational;
mod own;
mod passed_on;
mod precision;
mod refine;
mod residual;
mod rnea;
mod simulation;
mod solver;
mod substitute;
mod tolerance;
mod workspace;

pub use aba::{aba, joint_wrenches};
pub use batch::{Batch, aba_batch};
pub use centroidal::{Centroidal, centroidal};
pub use check::check_accelerations;
pub use choice::Choice;
pub use crba::{crba, crba_forward_dynamics};
pub use dca::{DcaOptions, DcaWorkspace, dca};
pub use derivatives::{Derivatives, aba_derivatives, rnea_derivatives};
pub use device::Device;
pub use elements::{Elements, Motor, SphericalMotor, Stored, Work};
pub use energy::{Mechanics, mechanics};
pub use error::Error;
pub use forces::{Forces, Wrench};
pub use forward_error::forward_error;
pub use integrate::Integrator;
pub use jacobian::BodyPoint;
pub use kinematics::{body_poses, forward_kinematics};
pub use loops::{LoopForces, LoopViolation};
pub use monitor::{Check, Monitor};
pub use operational::{inverse_operational_inertia, operational_inertia};
pub use precision::Precision;
pub use refine::{Refinement, refine};
pub use residual::{Residual, Solved, residual};
pub use rnea::rnea;
pub use simulation::{PendingPoses, Simulation};
pub use solver::{Algorithm, Solver, SolverOptions};
pub use tolerance::Achieved;
pub use workspace::{BodyForce, BodyMotion, Workspace};

use vertebra_assembly::Model;

/// Lets no NaN or infinity out: names the first body whose result is not finite.
pub(crate) fn finite_results(
    model: &Model,
    quantity: &'static str,
    values: &[f64],
    time: f64,
) -> Result<(), Error> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(dof) => Err(Error::Overflow {
            quantity,
            body: forces::body_of_dof(model, dof),
            time,
        }),
    }
}
