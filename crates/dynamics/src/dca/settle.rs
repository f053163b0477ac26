//! The solution of a tree, once the [drift](crate::drift) of its bodies' places is taken out.

use super::split::PARALLEL_BODIES;
use super::tree::Tree;
use crate::Forces;
use crate::across::Given;
use crate::drift::Drift;
use vertebra_assembly::{Model, Units};
use vertebra_spatial::Real;

impl<T: Real, L: Real> Tree<T, L> {
    /// Takes the memory for it, once.
    pub(super) fn prepare_to_settle(&mut self, model: &Model) {
        if self.drift.is_none() {
            self.drift = Drift::of(model, T::EPSILON.to_f64()).map(Box::new);
        }
    }

    /// Takes the drift out of the bodies' places. That accelerations no longer match across joints is for the
    /// correction that follows.
    pub(super) fn settle(
        &mut self,
        units: &Units,
        given: &Given<'_>,
        forces: &Forces,
        threads: bool,
    ) {
        let parallel = threads && self.plan.len() >= PARALLEL_BODIES;
        let Some(mut drift) = self.drift.take() else {
            return;
        };
        self.places.settle(&self.plan, &mut drift, given, parallel);
        self.drift = Some(drift);
        self.places.push(&self.plan, forces, units);
    }
}
