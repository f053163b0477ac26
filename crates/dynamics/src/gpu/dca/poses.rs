//! Poses that come back, or stay.

use super::engine;
use crate::Error;
use glam::{DQuat, DVec3};
use vertebra_assembly::Model;
use vertebra_gpu::Buffer;
use vertebra_spatial::Pose;

/// The buffer with all poses: for each body, in the model's order, orientation x, y, z, w, then
/// position x, y, z \[m\] and 0, those of the body's own frame in the world.
#[derive(Clone, Debug)]
pub enum PoseBuffer {
    /// In f32.
    F32(Buffer<[f32; 4]>),
    /// In f64.
    F64(Buffer<[f64; 4]>),
}

/// Poses on their way from a device, which goes on meanwhile.
#[derive(Debug)]
pub struct PendingPoses {
    reading: Reading,
    model: Model,
    time: f64,
}

#[derive(Debug)]
pub(super) enum Reading {
    F32(engine::Reading<f32>),
    F64(engine::Reading<f64>),
}

impl PendingPoses {
    pub(super) fn new(reading: Reading, model: &Model, time: f64) -> Self {
        Self {
            reading,
            model: model.clone(),
            time,
        }
    }

    /// Whether they are there, so that [`wait`](Self::wait) returns at once.
    ///
    /// # Errors
    /// [`Error::Gpu`].
    pub fn is_ready(&self) -> Result<bool, Error> {
        Ok(match &self.reading {
            Reading::F32(reading) => reading.is_done(),
            Reading::F64(reading) => reading.is_done(),
        }?)
    }

    /// Waits for the poses of all bodies, in the model's order.
    ///
    /// # Errors
    /// [`Error::Gpu`]; [`Error::Overflow`].
    pub fn wait(self) -> Result<Vec<Pose>, Error> {
        let numbers = match self.reading {
            Reading::F32(reading) => reading.wait(),
            Reading::F64(reading) => reading.wait(),
        }?;
        let poses = numbers.chunks_exact(8).enumerate().map(|(body, n)| {
            let rotation = DQuat::from_xyzw(n[0], n[1], n[2], n[3]).normalize();
            let pose = Pose::new(rotation, DVec3::new(n[4], n[5], n[6]));
            if pose.is_valid() {
                return Ok(pose);
            }
            Err(Error::Overflow {
                quantity: "pose",
                body: self.model.bodies()[body].name.clone(),
                time: self.time,
            })
        });
        poses.collect()
    }
}
