//! External forces, gathered body by body.

use crate::link::BodyFrame;
use crate::workspace::Sweeps;
use crate::{Forces, Wrench};
use vertebra_assembly::Units;
use vertebra_spatial::{Force, Mat3, Number, Real, Vec3};

impl<T: Number> Sweeps<T> {
    /// Adds the external forces on what is in one lane to `external`, where the velocity-product
    /// forces are already.
    pub(crate) fn add_external(&mut self, lane: usize, forces: &Forces, units: &Units) {
        for (id, wrench) in forces.acting() {
            let i = id.index();
            let rotation = self.rotation[i].map(|entry| entry.lane(lane));
            let wrench = self.frames[i].wrench_at_joint(rotation, wrench, units);
            let external = &mut self.external[i];
            for (sum, term) in [
                (&mut external.angular, wrench.angular),
                (&mut external.linear, wrench.linear),
            ] {
                for (sum, term) in [
                    (&mut sum.x, term.x),
                    (&mut sum.y, term.y),
                    (&mut sum.z, term.z),
                ] {
                    sum.set_lane(lane, sum.lane(lane) + term);
                }
            }
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
