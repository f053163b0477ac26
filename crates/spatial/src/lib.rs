//! Placeholder.
mod pose;
pub use pose::Pose;
