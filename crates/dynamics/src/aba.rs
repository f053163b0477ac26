//! Articulated-body algorithm: the accelerations that given forces cause, in O(n).
//!
//! Featherstone 1983; RBDA section 7.3, with its symbols. World axes throughout, so that passing
//! between bodies is a mere shift of origin (X = [1 0; -r~ 1]) and nothing is rotated twice.
//!
//! Up: U = IA S, D = S' U, u = tau - S' pA; what the joint does not let go is passed on,
//! Ia = IA - U D^-1 U', pa = pA + Ia c + U D^-1 u; parent: IA += X' Ia X, pA += X' pa.
//! Down: a' = X a_parent + c, qdd = D^-1 (u - U' a'), a = a' + S qdd.

use crate::link::Kind;
use crate::workspace::{Computed, Sweeps, in_precision};
use crate::{Error, Forces, Workspace, finite_results};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{ArticulatedInertia, Force, Motion, Real, SmallCholesky};

/// Forward dynamics: the joint accelerations [rad/s^2 or m/s^2], shape [`Model::dof_count`].
/// [`Workspace::acceleration`] has those of the bodies afterwards.
///
/// # Errors
/// [`Error`] if an input does not fit the model, if a joint moves no inertia in this position, or if
/// the result overflows.
pub fn aba<'w>(
    model: &Model,
    state: &State,
    forces: &Forces,
    workspace: &'w mut Workspace,
) -> Result<&'w [f64], Error> {
    workspace.check_model(model)?;
    state.check(model)?;
    forces.check(model)?;
    workspace.computed = Computed::default();
    let Workspace {
        scales,
        arrays,
        qdd,
        ..
    } = workspace;
    in_precision!(arrays, s => {
        s.set_state(state, model.units().length, &scales.rate);
        s.set_external(forces, model.units());
        for (u, (&tau, &scale)) in s.tau.iter_mut().zip(forces.joint.iter().zip(&scales.force)) {
            *u = Real::from_f64(tau / scale);
        }
        s.u.copy_from_slice(&s.tau);
        s.articulate().map_err(|i| Error::SingularJoint {
            body: model.bodies()[i].name.clone(),
        })?;
        s.respond();
        for (qdd, (&u, &scale)) in qdd.iter_mut().zip(s.u.iter().zip(&scales.acceleration)) {
            *qdd = Real::to_f64(u) * scale;
        }
    });
    finite_results(model, "joint acceleration", &workspace.qdd, state.time)?;
    workspace.computed.accelerations = true;
    Ok(&workspace.qdd)
}

/// Computes the forces that the joints transmit, from the accelerations of the last [`aba`];
/// [`Workspace::joint_wrench`] reads them.
///
/// # Errors
/// [`Error::NotComputed`] if [`aba`] has not been called.
pub fn joint_wrenches(workspace: &mut Workspace) -> Result<(), Error> {
    workspace.joint_accelerations()?;
    in_precision!(&mut workspace.arrays, s => s.transmit());
    workspace.computed.joint_wrenches = true;
    Ok(())
}

impl<T: Real> Sweeps<T> {
    /// From the tips up: articulated inertias and bias forces.
    ///
    /// Fails with the body whose joint moves no inertia: its pivot is zero, negative, or within
    /// rounding (4 eps) of the inertia that its children's joints let go just before.
    fn articulate(&mut self) -> Result<(), usize> {
        for i in 0..self.links.len() {
            self.articulated[i] = self.inertia[i].into();
            self.bias[i] = -self.external[i];
            self.carried[i] = [T::ZERO; 2];
        }
        let rounding = T::from_f64(4.0) * T::EPSILON;
        for i in (0..self.links.len()).rev() {
            let v = self.links[i].v;
            let floor = self.carried[i].map(|carried| carried * rounding);
            let mut inertia = self.articulated[i];
            let mut bias = self.bias[i];
            let c = self.bias_acceleration[i];
            match self.links[i].kind {
                Kind::Fixed => bias += inertia.mul(c),
                Kind::Revolute { .. } => {
                    let axis = self.subspace[v].angular;
                    let u_column = Force::new(inertia.angular * axis, inertia.coupling * axis);
                    let d = axis.dot(u_column.angular);
                    self.let_go(i, d, floor[0], u_column, axis.dot(bias.angular))?;
                    (inertia, bias) = self.pass_on(i, inertia, bias, u_column, c);
                }
                Kind::Prismatic { .. } => {
                    let axis = self.subspace[v].linear;
                    let u_column =
                        Force::new(inertia.coupling.transpose_mul(axis), inertia.linear * axis);
                    let d = axis.dot(u_column.linear);
                    self.let_go(i, d, floor[1], u_column, axis.dot(bias.linear))?;
                    (inertia, bias) = self.pass_on(i, inertia, bias, u_column, c);
                }
                Kind::Spherical | Kind::Free => {
                    (inertia, bias) = self.let_go_several(i, floor, inertia, bias, c)?;
                }
            }
            if let Some(parent) = self.links[i].parent {
                let r = self.offset[i];
                // What arrives at the parent before this joint lets anything go.
                let arriving = &self.articulated[i];
                self.carried[parent][0] += arriving.shifted_angular_trace(r);
                self.carried[parent][1] += arriving.linear.trace();
                self.articulated[parent] += inertia.shifted_back(r);
                self.bias[parent] += bias.shifted_back(r);
            }
        }
        Ok(())
    }

    /// Stores U, 1/D and u of a joint with one freedom.
    fn let_go(
        &mut self,
        i: usize,
        d: T,
        floor: T,
        u_column: Force<T>,
        projected_bias: T,
    ) -> Result<(), usize> {
        // Written so that NaN fails.
        if !(d > floor && d.is_finite()) {
            return Err(i);
        }
        let v = self.links[i].v;
        self.d_inverse[i] = T::ONE / d;
        self.u_columns[v] = u_column;
        self.u[v] -= projected_bias;
        Ok(())
    }

    /// Ia and pa of a joint with one freedom.
    fn pass_on(
        &self,
        i: usize,
        mut inertia: ArticulatedInertia<T>,
        bias: Force<T>,
        u_column: Force<T>,
        c: Motion<T>,
    ) -> (ArticulatedInertia<T>, Force<T>) {
        let d_inverse = self.d_inverse[i];
        inertia.subtract_outer(u_column, d_inverse);
        let passed = bias + inertia.mul(c) + u_column * (self.u[self.links[i].v] * d_inverse);
        (inertia, passed)
    }

    /// The same for a joint with several freedoms. With D = L L', the columns of Y = U L^-T give
    /// Ia = IA - Y Y' and pa = pA + Ia c + U D^-1 u.
    fn let_go_several(
        &mut self,
        i: usize,
        floor: [T; 2],
        mut inertia: ArticulatedInertia<T>,
        bias: Force<T>,
        c: Motion<T>,
    ) -> Result<(ArticulatedInertia<T>, Force<T>), usize> {
        let dofs = self.dofs(i);
        let order = dofs.len();
        let mut d = [[T::ZERO; 6]; 6];
        let mut floors = [floor[0]; 6];
        for (k, dof) in dofs.clone().enumerate() {
            let u_column = inertia.mul(self.subspace[dof]);
            self.u_columns[dof] = u_column;
            for (l, other) in dofs.clone().enumerate().take(k + 1) {
                d[k][l] = self.subspace[other].dot(u_column);
            }
            if k >= 3 {
                floors[k] = floor[1];
            }
            let projected = self.subspace[dof].dot(bias);
            self.u[dof] -= projected;
        }
        let factor = SmallCholesky::factor(order, &d, &floors).map_err(|_| i)?;
        self.factors[self.factor_of[i] as usize] = Some(factor);

        let mut response = [T::ZERO; 6];
        response[..order].copy_from_slice(&self.u[dofs.clone()]);
        factor.solve(&mut response[..order]);
        let mut passed = bias;
        for (k, dof) in dofs.clone().enumerate() {
            passed += self.u_columns[dof] * response[k];
        }
        for column in self.lowered(&factor, dofs) {
            inertia.subtract_outer(column, T::ONE);
        }
        passed += inertia.mul(c);
        Ok((inertia, passed))
    }

    /// The columns of U L^-T.
    fn lowered(
        &self,
        factor: &SmallCholesky<T>,
        dofs: core::ops::Range<usize>,
    ) -> impl Iterator<Item = Force<T>> {
        let order = dofs.len();
        let mut rows = [[T::ZERO; 6]; 6];
        for (k, dof) in dofs.enumerate() {
            let u = self.u_columns[dof];
            let (n, f) = (u.angular.to_array(), u.linear.to_array());
            for (row, value) in n.into_iter().chain(f).enumerate() {
                rows[row][k] = value;
            }
        }
        for row in &mut rows {
            factor.solve_lower(&mut row[..order]);
        }
        (0..order).map(move |k| {
            Force::new(
                vertebra_spatial::vec3(rows[0][k], rows[1][k], rows[2][k]),
                vertebra_spatial::vec3(rows[3][k], rows[4][k], rows[5][k]),
            )
        })
    }

    /// The force each joint transmits, f = IA a + pA.
    ///
    /// Summing the bodies' forces from the tips up instead would keep Newton-Euler exact but let
    /// the joint forces S' f drift from tau by 1e-7 of their terms at 5000 bodies in f64; this form
    /// stays within 1e-12. What is left of it is taken out along the joint's freedoms, whose columns
    /// are orthonormal.
    fn transmit(&mut self) {
        for i in 0..self.links.len() {
            let mut f = self.articulated[i].mul(self.acceleration[i]) + self.bias[i];
            for dof in self.dofs(i) {
                let column = self.subspace[dof];
                let excess = column.dot(f) - self.tau[dof];
                f -= Force::new(column.angular, column.linear) * excess;
            }
            self.joint_wrench[i] = f;
        }
    }

    /// From the world down: accelerations. `u` becomes qdd.
    fn respond(&mut self) {
        for i in 0..self.links.len() {
            let mut a = match self.links[i].parent {
                Some(parent) => self.acceleration[parent].shifted(self.offset[i]),
                None => self.base,
            } + self.bias_acceleration[i];
            let dofs = self.dofs(i);
            for dof in dofs.clone() {
                let reaction = a.dot(self.u_columns[dof]);
                self.u[dof] -= reaction;
            }
            match dofs.len() {
                0 => {}
                1 => self.u[dofs.start] = self.u[dofs.start] * self.d_inverse[i],
                _ => {
                    if let Some(factor) = &self.factors[self.factor_of[i] as usize] {
                        factor.solve(&mut self.u[dofs.clone()]);
                    }
                }
            }
            for dof in dofs {
                a += self.subspace[dof] * self.u[dof];
            }
            self.acceleration[i] = a;
        }
    }
}
