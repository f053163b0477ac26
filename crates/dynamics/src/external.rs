//! External forces, gathered body by body.

use crate::workspace::Sweeps;
use crate::{Forces, Wrench};
use vertebra_assembly::Units;
use vertebra_spatial::{Force, Real, Vec3};

impl<T: Real> Sweeps<T> {
    /// Adds the external forces to `external`, where the velocity-product forces are already.
    pub(crate) fn add_external(&mut self, forces: &Forces, units: &Units) {
        for (id, wrench) in forces.external() {
            let i = id.index();
            let wrench = self.wrench_at_joint(i, wrench, units);
            self.external[i] += wrench;
        }
    }

    /// A wrench in world axes about the joint's origin, in the model's units.
    pub(crate) fn wrench_at_joint(&self, i: usize, wrench: &Wrench, units: &Units) -> Force<T> {
        let frame = &self.frames[i];
        let rotation = self.rotation[i];
        let mut linear = Vec3::from_glam(wrench.force / units.force());
        let mut angular = Vec3::from_glam(wrench.torque / units.energy());
        if wrench.body_axes {
            let axes = rotation * frame.placement.rotation;
            (linear, angular) = (axes * linear, axes * angular);
        }
        let arm = match wrench.point {
            None => frame.center,
            Some(point) => frame.placement.point(Vec3::from_glam(point / units.length)),
        };
        Force::new(angular, linear).shifted_back(rotation * arm)
    }
}
