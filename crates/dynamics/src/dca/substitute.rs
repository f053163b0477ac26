//! Joint-space solutions with the factors of an assembly tree: H x = tau.
//!
//! A joint force tau is a pair of forces f, S'f = tau, on the joint's body and on the one that carries it. On bodies at
//! rest those are the loads of a [correction](super::correct) without jumps, and what responds is x: one sweep of
//! vectors up and down, in as many rounds as the solution took.

use super::correct::{Corrections, Source};
use super::tree::Tree;
use crate::drive::transmitted;
use vertebra_spatial::{Force, Motion, Real};

impl<T: Real, L: Real> Tree<T, L> {
    /// Replaces joint forces by accelerations, both in the model's units and order; not numbers where they overflow.
    pub(super) fn substitute(&mut self, values: &mut [f64], threads: bool) {
        let mut own =
            (self.corrections.take()).unwrap_or_else(|| Corrections::new(&self.plan).into());
        own.jumps.fill(Motion::ZERO);
        own.loads.clear();
        own.loads.resize(self.plan.len(), Force::ZERO);
        for slot in 0..self.plan.len() {
            self.load(slot, values, &mut own.loads);
        }
        if self.sweep(&mut own, Source::Given, threads).is_ok() {
            for (&dof, x) in self.plan.model_dofs.iter().zip(&own.qdd) {
                values[dof as usize] = x.to_f64();
            }
        } else {
            values.fill(f64::NAN);
        }
        self.corrections = Some(own);
    }

    /// Adds the pair of forces of a joint, each about its body's handle point.
    fn load(&self, slot: usize, values: &[f64], loads: &mut [Force<T>]) {
        let dofs = self.plan.dofs_of(slot);
        let mut tau = [T::ZERO; 6];
        for (tau, &dof) in tau.iter_mut().zip(&self.plan.model_dofs[dofs.clone()]) {
            *tau = T::from_f64(values[dof as usize]);
        }
        if tau.iter().all(|&tau| tau == T::ZERO) {
            return;
        }
        let tau = &tau[..dofs.len()];
        let f = transmitted(Force::ZERO, &self.places.columns[dofs], tau);
        let placed = &self.places.bodies[slot];
        loads[slot] += f.shifted_back(-placed.arm);
        if let Some(parent) = self.plan.links[slot].parent {
            loads[self.plan.slots[parent] as usize] -= f.shifted_back(placed.offset);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{DcaOptions, DcaWorkspace, Forces, Precision, Workspace, aba, dca, residual};
    use vertebra_assembly::{Random, State, generate};

    /// As the recursion's substitution does, on joints of every kind; and what was solved is still there.
    #[test]
    fn substitutions_agree() {
        for (seed, count) in (0..).zip([1, 9, 120]) {
            let model = generate::random_mechanism(count, false, seed).unwrap();
            let (state, forces) = (State::random(&model, seed), Forces::none(&model));
            let mut serial = Workspace::new(&model, Precision::F64);
            aba(&model, &state, &forces, &mut serial).unwrap();
            let mut workspace = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
            dca(&model, &state, &forces, &mut workspace).unwrap();
            let mut random = Random::new(seed);
            let mut right: Vec<f64> = state.qd.iter().map(|_| random.symmetric()).collect();
            let mut found = right.clone();
            serial.substitute(&mut right);
            workspace.substitute(&mut found);
            let size = right.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (a, b) in found.iter().zip(&right) {
                assert!((a - b).abs() <= 1e-9 * size, "{count}: {a} or {b}");
            }
            workspace.compute_joint_wrenches(&forces).unwrap();
            let left = residual(&model, &state, &forces, &workspace).unwrap();
            let bound = 64.0 * f64::EPSILON * model.depth() as f64;
            assert!(left.by_body <= bound, "{count}: {left:?}");
        }
    }
}
