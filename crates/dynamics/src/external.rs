//! External forces, gathered body by body.

use crate::link::BodyFrame;
use crate::workspace::Sweeps;
use crate::{Forces, Wrench};
use vertebra_assembly::Units;
use vertebra_spatial::{Force, Mat3, Real, Vec3};

impl<T: Real> Sweeps<T> {
    /// Adds the external forces to `external`, where the velocity-product forces are already.
    pub(crate) fn add_external(&mut self, forces: &Forces, units: &Units) {
        for (id, wrench) in forces.external() {
            let i = id.index();
            let wrench = self.frames[i].wrench_at_joint(self.rotation[i], wrench, units);
            self.external[i] += wrench;
        }
    }
}

impl<T: Real> BodyFrame<T> {
    /// A wrench in world axes about the joint's origin, in the model's units, on this body, whose
    /// joint axes are `rotation`'s columns.
    pub(crate) fn wrench_at_joint(
        &self,
        rotation: Mat3<T>,
        wrench: &Wrench,
        units: &Units,
    ) -> Force<T> {
        let mut linear = Vec3::from_glam(wrench.force / units.force());
        let mut angular = Vec3::from_glam(wrench.torque / units.energy());
        if wrench.body_axes {
            let axes = rotation * self.placement.rotation;
            (linear, angular) = (axes * linear, axes * angular);
        }
        let arm = match wrench.point {
            None => self.center,
            Some(point) => self.placement.point(Vec3::from_glam(point / units.length)),
        };
        Force::new(angular, linear).shifted_back(rotation * arm)
    }
}
