//! Divide and conquer: the tables of an assembly tree, the dispatches that go through its rounds, and
//! the simulation that owns both.

mod engine;
mod layers;
mod scalar;
mod simulation;
mod tables;

pub use simulation::{Options, PoseBuffer, Simulation};
