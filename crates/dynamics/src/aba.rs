//! Articulated-body algorithm: the accelerations that given forces cause, in O(n).
//!
//! Featherstone 1983; RBDA section 7.3, with its symbols. World axes throughout, so that passing
//! between bodies is a mere shift of origin (X = [1 0; -r~ 1]) and nothing is rotated twice.
//!
//! Up: U = IA S, D = S' U, u = tau - S' pA; what the joint does not let go is passed on,
//! Ia = IA - U D^-1 U', pa = pA + Ia c + U D^-1 u; parent: IA += X' Ia X, pA += X' pa.
//! Down: a' = X a_parent + c, qdd = D^-1 (u - U' a'), a = a' + S qdd.

use crate::link::Kind;
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Workspace, finite_results};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{ArticulatedInertia, Force, Motion, Real, SmallCholesky, Sym3, vec3};

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
    forces.check(model)?;
    workspace.set_state(model, state)?;
    let Workspace {
        scales,
        arrays,
        qdd,
        ..
    } = workspace;
    let failed = in_precision!(arrays, s => {
        s.set_external(forces, model.units());
        for (tau, (&given, &scale)) in s.tau.iter_mut().zip(forces.joint.iter().zip(&scales.force)) {
            *tau = Real::from_f64(given / scale);
        }
        s.u.copy_from_slice(&s.tau);
        s.articulate().map_err(|i| Error::SingularJoint {
            body: model.bodies()[i].name.clone(),
        })?;
        s.respond();
        for (qdd, (&u, &scale)) in qdd.iter_mut().zip(s.u.iter().zip(&scales.acceleration)) {
            *qdd = Real::to_f64(u) * scale;
        }
        s.acceleration.iter().position(|a| !a.is_finite())
    });
    workspace.refuse_overflow("acceleration", failed)?;
    finite_results(model, "joint acceleration", &workspace.qdd, state.time)?;
    workspace.computed.accelerations = true;
    Ok(&workspace.qdd)
}

/// Computes the forces that the joints transmit, from the accelerations of the last [`aba`];
/// [`Workspace::joint_wrench`] reads them.
///
/// # Errors
/// [`Error::NotComputed`] if [`aba`] has not been called, [`Error::Overflow`].
pub fn joint_wrenches(workspace: &mut Workspace) -> Result<(), Error> {
    workspace.joint_accelerations()?;
    let failed = in_precision!(&mut workspace.arrays, s => {
        s.transmit();
        s.joint_wrench.iter().position(|f| !f.is_finite())
    });
    workspace.refuse_overflow("joint force", failed)?;
    workspace.computed.joint_wrenches = true;
    Ok(())
}

impl<T: Real> Sweeps<T> {
    /// From the tips up: articulated inertias and bias forces.
    ///
    /// Fails with the body whose joint moves no inertia: its pivot is zero, negative, or within
    /// rounding (4 eps) of the body's own inertia in all directions and of what arrived from its
    /// children before their joints let go.
    fn articulate(&mut self) -> Result<(), usize> {
        for i in 0..self.links.len() {
            self.articulated[i] = self.inertia[i].into();
            self.bias[i] = -self.external[i];
            self.carried[i] = [
                self.articulated[i].angular.trace(),
                self.articulated[i].linear.trace(),
            ];
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
                Kind::Spherical => {
                    self.let_go_several(i, floor, &inertia, bias)?;
                    (inertia, bias) = self.pass_on_spherical(i, &inertia, bias, c);
                }
                Kind::Free => {
                    self.let_go_several(i, floor, &inertia, bias)?;
                    // Everything is let go but what drives the joint.
                    (inertia, bias) = (ArticulatedInertia::default(), self.driven(i));
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

    /// Stores U, the factors of D and u of a joint with several freedoms.
    fn let_go_several(
        &mut self,
        i: usize,
        floor: [T; 2],
        inertia: &ArticulatedInertia<T>,
        bias: Force<T>,
    ) -> Result<(), usize> {
        let dofs = self.dofs(i);
        let mut d = [[T::ZERO; 6]; 6];
        for (k, dof) in dofs.clone().enumerate() {
            let u_column = inertia.mul(self.subspace[dof]);
            self.u_columns[dof] = u_column;
            for (l, other) in dofs.clone().enumerate().take(k + 1) {
                d[k][l] = self.subspace[other].dot(u_column);
            }
            let projected = self.subspace[dof].dot(bias);
            self.u[dof] -= projected;
        }
        let [turn, slide] = floor;
        let floors = [turn, turn, turn, slide, slide, slide];
        let factor = SmallCholesky::factor(dofs.len(), &d, &floors).map_err(|_| i)?;
        self.factors[self.factor_of[i] as usize] = Some(factor);
        Ok(())
    }

    /// Ia and pa of a spherical joint, which lets all moments go but those that drive it: of Ia only
    /// the linear block is left, of pa the moment is S tau. Left to rounding, the rest would be noise
    /// of the size of the subtree beyond, which a light parent feels.
    ///
    /// With D = L L', the columns of Y = U L^-T give Ia = IA - Y Y'.
    fn pass_on_spherical(
        &self,
        i: usize,
        inertia: &ArticulatedInertia<T>,
        bias: Force<T>,
        c: Motion<T>,
    ) -> (ArticulatedInertia<T>, Force<T>) {
        let dofs = self.dofs(i);
        let mut linear = inertia.linear;
        let mut force = bias.linear;
        if let Some(factor) = &self.factors[self.factor_of[i] as usize] {
            let columns = [0, 1, 2].map(|k| self.u_columns[dofs.start + k].linear);
            let mut y = [0, 1, 2].map(|row| {
                let mut padded = [T::ZERO; 6];
                for (entry, column) in padded.iter_mut().zip(columns) {
                    *entry = column.to_array()[row];
                }
                padded
            });
            for row in &mut y {
                factor.solve_lower(row);
            }
            for k in 0..3 {
                linear = linear - Sym3::outer(vec3(y[0][k], y[1][k], y[2][k]), T::ONE);
            }
            let mut response = [T::ZERO; 6];
            response[..3].copy_from_slice(&self.u[dofs]);
            factor.solve(&mut response);
            for (column, response) in columns.into_iter().zip(response) {
                force += column * response;
            }
        }
        force += linear * c.linear;
        let passed = ArticulatedInertia {
            linear,
            ..ArticulatedInertia::default()
        };
        (passed, Force::new(self.driven(i).angular, force))
    }

    /// The force each joint transmits, f = IA a + pA.
    ///
    /// Summing the bodies' forces from the tips up instead would keep Newton-Euler exact but let
    /// the joint forces S' f drift from tau by 1e-7 of their terms at 5000 bodies in f64; this form
    /// stays within 2e-12. What is left of it is taken out along the joint's freedoms, whose columns
    /// are orthonormal: f += S (tau - S' f). Where the freedoms are all there is (free joints, and
    /// the moment of spherical ones) that is S tau without a rest; a rest would be rounding alone,
    /// and wrong in every digit where tau is zero.
    fn transmit(&mut self) {
        for i in 0..self.links.len() {
            let mut f = self.articulated[i].mul(self.acceleration[i]) + self.bias[i];
            match self.links[i].kind {
                Kind::Fixed => {}
                Kind::Revolute { .. } | Kind::Prismatic { .. } => {
                    let dof = self.links[i].v;
                    let excess = self.subspace[dof].dot(f) - self.tau[dof];
                    f -= along(self.subspace[dof]) * excess;
                }
                Kind::Spherical => f.angular = self.driven(i).angular,
                Kind::Free => f = self.driven(i),
            }
            self.joint_wrench[i] = f;
        }
    }

    /// S tau: the force along a joint's freedoms that exerts tau.
    fn driven(&self, i: usize) -> Force<T> {
        let mut f = Force::ZERO;
        for dof in self.dofs(i) {
            f += along(self.subspace[dof]) * self.tau[dof];
        }
        f
    }

    /// From the world down: accelerations. `u` becomes qdd.
    ///
    /// With a = a' + S qdd the condition on qdd reads U' a = u. It is solved twice: a' may be much
    /// larger than a (a light body on a fast joint hardly notices its parent), and then rounding of
    /// the order of a' is left in a; the second solution removes it.
    fn respond(&mut self) {
        for i in 0..self.links.len() {
            let mut a = match self.links[i].parent {
                Some(parent) => self.acceleration[parent].shifted(self.offset[i]),
                None => self.base,
            } + self.bias_acceleration[i];
            let dofs = self.dofs(i);
            match dofs.len() {
                0 => {}
                1 => {
                    let (column, u_column) =
                        (self.subspace[dofs.start], self.u_columns[dofs.start]);
                    let (u, d_inverse) = (self.u[dofs.start], self.d_inverse[i]);
                    let first = (u - a.dot(u_column)) * d_inverse;
                    a += column * first;
                    let second = (u - a.dot(u_column)) * d_inverse;
                    a += column * second;
                    self.u[dofs.start] = first + second;
                }
                _ => self.respond_several(i, dofs, &mut a),
            }
            self.acceleration[i] = a;
        }
    }

    /// The same for a joint with several freedoms.
    fn respond_several(&mut self, i: usize, dofs: core::ops::Range<usize>, a: &mut Motion<T>) {
        let Some(factor) = self.factors[self.factor_of[i] as usize] else {
            return;
        };
        let mut qdd = [T::ZERO; 6];
        for _ in 0..2 {
            let mut rest = [T::ZERO; 6];
            for (rest, dof) in rest.iter_mut().zip(dofs.clone()) {
                *rest = self.u[dof] - a.dot(self.u_columns[dof]);
            }
            factor.solve(&mut rest);
            for (k, dof) in dofs.clone().enumerate() {
                *a += self.subspace[dof] * rest[k];
                qdd[k] += rest[k];
            }
        }
        self.u[dofs.clone()].copy_from_slice(&qdd[..dofs.len()]);
    }
}

/// A freedom's direction as a force of unit power.
fn along<T: Real>(column: Motion<T>) -> Force<T> {
    Force::new(column.angular, column.linear)
}
