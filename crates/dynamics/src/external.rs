//! External forces and velocity-product forces, gathered body by body.

use crate::link::Link;
use crate::workspace::Sweeps;
use crate::{Forces, Wrench};
use vertebra_assembly::Units;
use vertebra_spatial::{Force, Mat3, Real, Vec3};

impl<T: Real> Sweeps<T> {
    /// Sets `external` to the external force minus the velocity-product force of every body.
    pub(crate) fn set_external(&mut self, forces: &Forces, units: &Units) {
        for i in 0..self.links.len() {
            self.external[i] = -self.inertia[i].bias(self.spin[i]);
        }
        for (id, wrench) in forces.external() {
            let i = id.index();
            let wrench = self.links[i].wrench_at_joint(self.rotation[i], wrench, units);
            self.external[i] += wrench;
        }
    }
}

impl<T: Real> Link<T> {
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
            let axes = rotation * self.body_frame.rotation;
            (linear, angular) = (axes * linear, axes * angular);
        }
        let arm = match wrench.point {
            None => self.center,
            Some(point) => self.body_frame.point(Vec3::from_glam(point / units.length)),
        };
        Force::new(angular, linear).shifted_back(rotation * arm)
    }
}
