//! Articulated models: bodies and joints, checked and ordered; generators; URDF import; assembly
//! trees and their schedules.
//!
//! A [`ModelDescription`] is plain data: bodies in any order, parents by name. Building it checks
//! everything and gives a [`Model`]: constant, parents before children, cheap to clone. A
//! [`State`] holds the positions and rates that go with it.
//!
//! ```
//! use glam::DVec3;
//! use vertebra_assembly::{Joint, State, generate};
//!
//! let model = generate::chain(1024, &Joint::revolute(DVec3::X), &generate::Rod::default())?;
//! let state = State::neutral(&model);
//! assert_eq!(state.q.len(), 1024);
//! # Ok::<(), vertebra_assembly::ModelError>(())
//! ```

mod body;
pub mod builder;
mod closure;
mod compound;
mod description;
mod edit;
mod element;
mod error;
pub mod generate;
mod joint;
mod kinematics;
mod location;
mod mass;
mod massless;
pub mod mechanism;
mod model;
mod not_simulated;
mod random;
pub mod schedule;
pub mod spelling;
mod state;
mod units;
#[cfg(feature = "urdf")]
pub mod urdf;
mod validate;
#[cfg(feature = "xml")]
pub mod xml;

pub use body::{Body, BodyId, BodyProperties};
pub use builder::{BodyShape, BuildError, Builder, Built, Centerline, Matter, Problem, SolidError};
pub use closure::{Closure, Coupling, CouplingDescription, Loop, LoopDescription};
pub use compound::Compound;
pub use description::{BodyDescription, FrameDescription, ModelDescription};
pub use edit::{Edit, Edited};
pub use element::{BallRange, Rest, Spring, Stop};
pub use error::{InertiaViolation, ModelError};
pub use joint::{Joint, JointKind, JointLimits, Mimic};
pub use location::{Ignored, Location};
pub use mass::MassProperties;
pub use model::{Frame, Model};
pub use not_simulated::{Feature, NotSimulated};
pub use random::Random;
pub use state::State;
pub use units::Units;
