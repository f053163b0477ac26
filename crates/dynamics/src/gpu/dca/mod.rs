//! Divide and conquer: the tables of an assembly tree, the dispatches that go through its rounds, and
//! the simulation that owns both.

mod engine;
mod layers;
mod limits;
mod loops;
mod options;
mod order;
mod poses;
mod scalar;
mod simulation;
mod tables;
mod transfer;

pub use options::Options;
pub use poses::{PendingPoses, PoseBuffer};
pub use simulation::Simulation;
