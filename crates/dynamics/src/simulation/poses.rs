//! Poses that may be on their way.

use crate::Error;
use vertebra_spatial::Pose;

/// Poses of all bodies at the time they were asked for; on a GPU they may still be on their way.
#[derive(Debug)]
pub struct PendingPoses(pub(super) Inner);

#[derive(Debug)]
pub(super) enum Inner {
    Here(Vec<Pose>),
    #[cfg(feature = "gpu")]
    OnTheWay(crate::gpu::PendingPoses),
}

impl PendingPoses {
    /// Whether they are there, so that [`wait`](Self::wait) returns at once.
    ///
    /// # Errors
    /// `Error::Gpu`.
    pub fn is_ready(&self) -> Result<bool, Error> {
        match &self.0 {
            Inner::Here(_) => Ok(true),
            #[cfg(feature = "gpu")]
            Inner::OnTheWay(pending) => pending.is_ready(),
        }
    }

    /// Waits for them; in the model's order.
    ///
    /// # Errors
    /// [`Error::Overflow`], `Error::Gpu`.
    pub fn wait(self) -> Result<Vec<Pose>, Error> {
        match self.0 {
            Inner::Here(poses) => Ok(poses),
            #[cfg(feature = "gpu")]
            Inner::OnTheWay(pending) => pending.wait(),
        }
    }
}
