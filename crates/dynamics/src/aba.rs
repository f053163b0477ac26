//! Articulated-body algorithm: the accelerations that given forces cause, in O(n).
//!
//! Featherstone 1983; RBDA section 7.3, with its symbols. World axes throughout, so that passing
//! between bodies is a mere shift of origin (X = [1 0; -r~ 1]) and nothing is rotated twice.
//!
//! Up: U = IA S, D = S' U, u = tau - S' pA; what the joint does not let go is passed on,
//! Ia = IA - U D^-1 U', pa = pA + Ia c + U D^-1 u; parent: IA += X' Ia X, pA += X' pa.
//! Down: a' = X a_parent + c, qdd = D^-1 (u - U' a'), a = a' + S qdd.
//!
//! A freedom may have inertia E of its own, which turns with nothing but the joint (a rotor, what an
//! implicit step adds): D = S' U + E, and the joint transmits S' f = tau - E qdd.

use crate::balance::largest_push;
use crate::drive::{driven, transmitted};
use crate::link::{Kind, Link};
use crate::passed_on::PassedOn;
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Workspace, finite_results};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{
    ArticulatedInertia, Force, Mat6, Motion, Number, Real, SmallCholesky, Sym3, Vec3, vec3,
};

/// Forward dynamics: the joint accelerations [rad/s^2 or m/s^2], shape [`Model::dof_count`].
/// [`Workspace::acceleration`] has those of the bodies afterwards.
///
/// Closed loops are held by [`Solver`](crate::Solver) and [`Simulation`](crate::Simulation), and what acts in joints
/// by the latter. Inverse dynamics, the mass matrix and kinematics are those of the joints' coordinates, loops or not.
///
/// # Errors
/// [`Error`] if an input does not fit the model, if a joint moves no inertia in this position, or if
/// the result overflows; [`Error::LoopsUnavailable`] if the model has loops or couplings, unless the workspace is one
/// [of the tree](Workspace::of_tree).
pub fn aba<'w>(
    model: &Model,
    state: &State,
    forces: &Forces,
    workspace: &'w mut Workspace,
) -> Result<&'w [f64], Error> {
    forces.check(model)?;
    workspace.set_state(model, state)?;
    workspace.refuse_loops("`aba`")?;
    workspace.push = largest_push(model, forces);
    let Workspace {
        scales,
        arrays,
        qdd,
        ..
    } = workspace;
    let failed = in_precision!(arrays, s => {
        s.add_external(0, forces, model.units());
        for (tau, (&given, &scale)) in s.tau.iter_mut().zip(forces.joint.iter().zip(&scales.force)) {
            *tau = Number::from_f64(given / scale);
        }
        s.set_added(0, forces, scales);
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
    if workspace.computed.joint_wrenches {
        return Ok(());
    }
    let failed = in_precision!(&mut workspace.arrays, s => {
        s.transmit(workspace.computed.corrected);
        s.joint_wrench.iter().position(|f| !f.is_finite())
    });
    workspace.refuse_overflow("joint force", failed)?;
    workspace.computed.joint_wrenches = true;
    Ok(())
}

impl<T: Number> Sweeps<T> {
    /// From the tips up: articulated inertias and bias forces.
    ///
    /// Fails with the body whose joint moves no inertia: its pivot is zero, negative, or within
    /// rounding (4 eps) of the body's own inertia in all directions and of what arrived from its
    /// children before their joints let go.
    pub(crate) fn articulate(&mut self) -> Result<(), usize> {
        let rounding = T::from_f64(4.0) * T::EPSILON;
        let mut arriving = PassedOn::ZERO;
        for i in (0..self.links.len()).rev() {
            let Link {
                parent,
                kind,
                v,
                gathers,
                ..
            } = self.links[i];
            let mut here = PassedOn::of_body(&self.inertia[i], -self.external[i]);
            here += arriving;
            if gathers {
                here += PassedOn {
                    inertia: self.articulated[i],
                    bias: self.bias[i],
                    carried: self.carried[i],
                };
            }
            let PassedOn {
                inertia,
                bias,
                carried,
            } = here;
            self.articulated[i] = inertia;
            self.bias[i] = bias;
            let floor = carried.map(|carried| carried * rounding);
            let c = self.bias_acceleration[i];
            let r = self.offset[i];
            let (u_column, d, floor, u) = match kind {
                Kind::Revolute => {
                    let axis = self.subspace[v].angular;
                    let u_column = Force::new(inertia.angular * axis, inertia.coupling * axis);
                    let d = axis.dot(u_column.angular) + self.added[v];
                    (u_column, d, floor[0], self.tau[v] - axis.dot(bias.angular))
                }
                Kind::Prismatic => {
                    let axis = self.subspace[v].linear;
                    let u_column =
                        Force::new(inertia.coupling.transpose_mul(axis), inertia.linear * axis);
                    let d = axis.dot(u_column.linear) + self.added[v];
                    (u_column, d, floor[1], self.tau[v] - axis.dot(bias.linear))
                }
                Kind::Screw => {
                    let (column, pitch) = (self.subspace[v], self.links[i].pitch);
                    let u_column = inertia.mul(column);
                    let d = column.dot(u_column) + self.added[v];
                    let floor = floor[0] + floor[1] * pitch * pitch;
                    (u_column, d, floor, self.tau[v] - column.dot(bias))
                }
                _ => {
                    let passed_on = self.pass_on_several(i, floor)?;
                    arriving = self.hand_on(i, passed_on);
                    continue;
                }
            };
            if !d.exceeds(floor) {
                return Err(i);
            }
            let d_inverse = T::ONE / d;
            let rest = u - c.dot(u_column);
            let above = u_column.shifted_back(r);
            self.d_inverse[i] = d_inverse;
            self.u[v] = u;
            self.u_columns[v] = u_column;
            self.above[v] = (above, rest);
            let mut passed = inertia;
            passed.subtract_outer(u_column, d_inverse);
            let force = bias + passed.mul(c) + u_column * (u * d_inverse);
            let passed = passed.shifted_back(r);
            let passed_on = PassedOn {
                inertia: passed,
                bias: force.shifted_back(r),
                carried: [
                    passed.angular.trace() + above.angular.length_squared() * d_inverse,
                    passed.linear.trace() + above.linear.length_squared() * d_inverse,
                ],
            };
            arriving = match parent {
                Some(parent) if parent + 1 == i => passed_on,
                _ => self.hand_on(i, passed_on),
            };
        }
        Ok(())
    }

    /// Puts what a body hands on where its parent finds it; gives what is at hand for the next body.
    #[inline(always)]
    fn hand_on(&mut self, i: usize, passed_on: PassedOn<T>) -> PassedOn<T> {
        let Some(parent) = self.links[i].parent else {
            return PassedOn::ZERO;
        };
        if parent + 1 == i {
            return passed_on;
        }
        let mut sum = passed_on;
        if !self.links[i].arrives_first {
            sum += PassedOn {
                inertia: self.articulated[parent],
                bias: self.bias[parent],
                carried: self.carried[parent],
            };
        }
        self.articulated[parent] = sum.inertia;
        self.bias[parent] = sum.bias;
        self.carried[parent] = sum.carried;
        PassedOn::ZERO
    }

    /// What a joint with no or several freedoms hands on.
    fn pass_on_several(&mut self, i: usize, floor: [T; 2]) -> Result<PassedOn<T>, usize> {
        let (inertia, bias) = (self.articulated[i], self.bias[i]);
        let (r, c) = (self.offset[i], self.bias_acceleration[i]);
        let held = self.holds(i);
        let (passed, force) = match self.links[i].kind {
            Kind::Spherical | Kind::Free if held => {
                self.let_go_several(i, floor, &inertia, bias)?;
                self.pass_on_held(i, inertia, bias, c)
            }
            Kind::Free => {
                self.let_go_several(i, floor, &inertia, bias)?;
                // Everything is let go but what drives the joint.
                (ArticulatedInertia::ZERO, self.driven(i))
            }
            Kind::Spherical => {
                self.let_go_several(i, floor, &inertia, bias)?;
                self.pass_on_spherical(i, &inertia, bias, c)
            }
            _ => (inertia, bias + inertia.mul(c)),
        };
        Ok(PassedOn {
            inertia: passed.shifted_back(r),
            bias: force.shifted_back(r),
            carried: [inertia.shifted_angular_trace(r), inertia.linear.trace()],
        })
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
            self.u[dof] = self.tau[dof] - projected;
        }
        let own = self.own(i);
        for (k, row) in d.iter_mut().enumerate().take(dofs.len()) {
            for (l, d) in row.iter_mut().enumerate().take(k + 1) {
                *d += own.entry(k, l);
            }
        }
        let [turn, slide] = floor;
        let floors = [turn, turn, turn, slide, slide, slide];
        let factor = SmallCholesky::factor(dofs.len(), &d, &floors).map_err(|_| i)?;
        self.factors[self.factor_of[i] as usize] = Some(factor);
        Ok(())
    }

    /// Whether a joint of several freedoms has inertia of its own, which lets go less than all.
    pub(crate) fn holds(&self, i: usize) -> bool {
        !self.own(i).is_zero()
    }

    /// Ia and pa of a joint of several freedoms with inertia of its own. With D = L L' and Y = U L^-T,
    /// Ia = IA - Y Y' and pa = pA + Ia c + Y L^-1 u.
    fn pass_on_held(
        &self,
        i: usize,
        mut inertia: ArticulatedInertia<T>,
        mut force: Force<T>,
        c: Motion<T>,
    ) -> (ArticulatedInertia<T>, Force<T>) {
        if let Some(factor) = &self.factors[self.factor_of[i] as usize] {
            let mut columns = Mat6::ZERO;
            let mut drives = [T::ZERO; 6];
            for (k, dof) in self.dofs(i).enumerate() {
                columns.0[k] = self.u_columns[dof].to_array();
                drives[k] = self.u[dof];
            }
            factor.solve_lower_rows(&mut columns);
            factor.solve_lower(&mut drives);
            for (row, drive) in columns.0.into_iter().zip(drives).take(factor.order()) {
                let column = Force::from_array(row);
                inertia.subtract_outer(column, T::ONE);
                force += column * drive;
            }
        }
        (inertia, force + inertia.mul(c))
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

    /// The forces that the joints transmit, f = IA a + pA.
    ///
    /// Summing the bodies' forces from the tips up instead would keep Newton-Euler exact but let
    /// the joint forces S' f drift from tau by 1e-7 of their terms at 5000 bodies in f64; this form
    /// stays within 2e-12, and [`transmitted`] takes that out. Corrections sum, but over
    /// [runs](crate::correct) of bodies alone, and leave pA where these end.
    fn transmit(&mut self, corrected: bool) {
        let corrections = self.corrections.take();
        let runs = corrections.as_ref().filter(|_| corrected);
        self.joint_wrench.fill(Force::ZERO);
        for i in (0..self.links.len()).rev() {
            let f = if runs.is_some_and(|own| own.sums(i)) {
                let inertial = self.inertia[i].mul(self.acceleration[i]);
                inertial - self.external[i] + self.joint_wrench[i]
            } else {
                self.whole_force(i)
            };
            let f = self.driven_right(i, f);
            self.joint_wrench[i] = f;
            if let Some(parent) = self.links[i].parent {
                self.joint_wrench[parent] += f.shifted_back(self.offset[i]);
            }
        }
        self.corrections = corrections;
    }

    /// IA a + pA.
    #[inline(always)]
    pub(crate) fn whole_force(&self, i: usize) -> Force<T> {
        self.articulated[i].mul(self.acceleration[i]) + self.bias[i]
    }

    /// What drives the freedom of a joint that has no other, but for what its own inertia takes.
    #[inline(always)]
    pub(crate) fn driving(&self, dof: usize) -> T {
        self.tau[dof] - self.added[dof] * self.u[dof]
    }

    /// A transmitted force that is right but for rounding, with what drives the joint along its freedoms.
    pub(crate) fn driven_right(&self, i: usize, f: Force<T>) -> Force<T> {
        let dofs = self.dofs(i);
        let held = self.own(i).mul(&self.u[dofs.clone()]);
        let mut tau = held.map(|held| -held);
        for (tau, &given) in tau.iter_mut().zip(&self.tau[dofs.clone()]) {
            *tau += given;
        }
        transmitted(f, &self.subspace[dofs], &tau)
    }

    /// S tau of a body's joint.
    fn driven(&self, i: usize) -> Force<T> {
        let dofs = self.dofs(i);
        driven(&self.subspace[dofs.clone()], &self.tau[dofs])
    }

    /// From the world down: accelerations. `u` becomes qdd.
    ///
    /// With a = a' + S qdd the condition on qdd reads U' a + E qdd = u. It is solved twice: a' may be much
    /// larger than a (a light body on a fast joint hardly notices its parent), and then rounding of
    /// the order of a' is left in a; the second solution removes it.
    pub(crate) fn respond(&mut self) {
        let mut last = Motion::ZERO;
        for i in 0..self.links.len() {
            let Link {
                parent, kind, v, ..
            } = self.links[i];
            let above = match parent {
                Some(parent) if parent + 1 == i => last,
                Some(parent) => self.acceleration[parent],
                None => self.base,
            };
            let mut a = above.shifted(self.offset[i]) + self.bias_acceleration[i];
            match kind {
                Kind::Fixed => {}
                Kind::Revolute => {
                    let (axis, u_column) = (self.subspace[v].angular, self.u_columns[v]);
                    let rest = self.u[v] - a.linear.dot(u_column.linear);
                    let first = self.first_response(i, v, above);
                    let rest = rest - self.added[v] * first;
                    let second = (axis, u_column.angular, rest, self.d_inverse[i]);
                    (a.angular, self.u[v]) = respond_again(a.angular, first, second);
                }
                Kind::Prismatic => {
                    let (axis, u_column) = (self.subspace[v].linear, self.u_columns[v]);
                    let rest = self.u[v] - a.angular.dot(u_column.angular);
                    let first = self.first_response(i, v, above);
                    let rest = rest - self.added[v] * first;
                    let second = (axis, u_column.linear, rest, self.d_inverse[i]);
                    (a.linear, self.u[v]) = respond_again(a.linear, first, second);
                }
                Kind::Screw => {
                    let (column, u_column) = (self.subspace[v], self.u_columns[v]);
                    let first = self.first_response(i, v, above);
                    a += column * first;
                    let rest = self.u[v] - self.added[v] * first - a.dot(u_column);
                    let second = rest * self.d_inverse[i];
                    a += column * second;
                    self.u[v] = first + second;
                }
                Kind::Spherical | Kind::Free => self.respond_several(i, self.dofs(i), &mut a),
            }
            self.acceleration[i] = a;
            last = a;
        }
    }

    /// qdd of a joint with one freedom from its parent's acceleration, without waiting for a':
    /// U' a' = (X' U)' a_parent + U' c.
    #[inline]
    fn first_response(&self, i: usize, v: usize, above: Motion<T>) -> T {
        let (column_above, rest) = self.above[v];
        (rest - above.dot(column_above)) * self.d_inverse[i]
    }

    /// The same for a joint with several freedoms.
    fn respond_several(&mut self, i: usize, dofs: core::ops::Range<usize>, a: &mut Motion<T>) {
        let Some(factor) = self.factors[self.factor_of[i] as usize] else {
            return;
        };
        let mut qdd = [T::ZERO; 6];
        for _ in 0..2 {
            let mut rest = self.own(i).mul(&qdd[..dofs.len()]);
            for (rest, dof) in rest.iter_mut().zip(dofs.clone()) {
                *rest = self.u[dof] - *rest - a.dot(self.u_columns[dof]);
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

/// Solves U' (a' + axis qdd) + E qdd = u once more, of which `rest` is u less what E takes the first
/// time and the part in which the joint does not move; gives that part of a and qdd.
#[inline]
fn respond_again<T: Number>(
    a: Vec3<T>,
    first: T,
    (axis, u_column, rest, d_inverse): (Vec3<T>, Vec3<T>, T, T),
) -> (Vec3<T>, T) {
    let a = a + axis * first;
    let second = (rest - a.dot(u_column)) * d_inverse;
    (a + axis * second, first + second)
}
