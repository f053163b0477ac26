//! External forces, gathered body by body.

use crate::workspace::Sweeps;
use crate::{Forces, Wrench};
use vertebra_assembly::Units;
use vertebra_spatial::{Force, Number, Vec3};

impl<T: Number> Sweeps<T> {
    /// Adds the external forces on what is in one lane to `external`, where the velocity-product
    /// forces are already.
    pub(crate) fn add_external(&mut self, lane: usize, forces: &Forces, units: &Units) {
        for (id, wrench) in forces.external() {
            let i = id.index();
            let wrench = self.wrench_at_joint(lane, i, wrench, units);
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

    /// A wrench in world axes about the joint's origin, in the model's units.
    pub(crate) fn wrench_at_joint(
        &self,
        lane: usize,
        i: usize,
        wrench: &Wrench,
        units: &Units,
    ) -> Force<T::Scalar> {
        let frame = &self.frames[i];
        let rotation = self.rotation[i].map(|entry| entry.lane(lane));
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
