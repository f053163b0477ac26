//! Recursive Newton-Euler algorithm: the joint forces that cause given accelerations.
//!
//! Luh, Walker and Paul 1980; Featherstone, RBDA chapter 5. Down: a = X a_parent + S qdd + c. Up:
//! f = I a + bias - external + sum over children of X' f_child; tau = S' f + E qdd, E the inertia of the
//! freedoms' own.

use crate::forces::check_dofs;
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Workspace, finite_results};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{MotionSubspace, Number, Real};

/// Inverse dynamics: the joint forces [N m or N], shape [`Model::dof_count`], under which the model
/// accelerates with `qdd` [rad/s^2 or m/s^2]. Of `forces` the external ones act and the joint
/// inertias count; its joint forces are not read.
///
/// # Errors
/// [`Error`] if an input does not fit the model, or the result overflows.
pub fn rnea<'w>(
    model: &Model,
    state: &State,
    qdd: &[f64],
    forces: &Forces,
    workspace: &'w mut Workspace,
) -> Result<&'w [f64], Error> {
    forces.check(model)?;
    check_dofs(model, "joint accelerations", "joint acceleration", qdd)?;
    workspace.set_state(model, state)?;
    let Workspace {
        scales,
        arrays,
        tau,
        ..
    } = workspace;
    in_precision!(arrays, s => {
        s.add_external(0, forces, model.units());
        for (u, (&qdd, &scale)) in s.u.iter_mut().zip(qdd.iter().zip(&scales.acceleration)) {
            *u = Number::from_f64(qdd / scale);
        }
        s.accelerate();
        s.gather_wrenches();
        for i in 0..s.links.len() {
            let dofs = s.dofs(i);
            MotionSubspace(&s.subspace[dofs.clone()])
                .transpose_mul(s.joint_wrench[i], &mut s.u[dofs]);
        }
        for (tau, (&u, &scale)) in tau.iter_mut().zip(s.u.iter().zip(&scales.force)) {
            *tau = Real::to_f64(u) * scale;
        }
        for (row, column, own) in forces.inertias(model) {
            tau[row] += own * qdd[column];
        }
    });
    finite_results(model, "joint force", &workspace.tau, state.time)?;
    Ok(&workspace.tau)
}

impl<T: Real> Sweeps<T> {
    /// From the world down: accelerations from the joint accelerations in `u`.
    pub(crate) fn accelerate(&mut self) {
        for i in 0..self.links.len() {
            let above = match self.links[i].parent {
                Some(parent) => self.acceleration[parent].shifted(self.offset[i]),
                None => self.base,
            };
            let dofs = self.dofs(i);
            self.acceleration[i] = above
                + self.bias_acceleration[i]
                + MotionSubspace(&self.subspace[dofs.clone()]).mul(&self.u[dofs]);
        }
    }

    /// From the tips up: the force each joint transmits, from the accelerations.
    pub(crate) fn gather_wrenches(&mut self) {
        for i in 0..self.links.len() {
            self.joint_wrench[i] = self.inertia[i].mul(self.acceleration[i]) - self.external[i];
        }
        for i in (0..self.links.len()).rev() {
            if let Some(parent) = self.links[i].parent {
                let passed_on = self.joint_wrench[i].shifted_back(self.offset[i]);
                self.joint_wrench[parent] += passed_on;
            }
        }
    }
}
