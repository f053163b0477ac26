//! First derivatives of inverse and forward dynamics, analytic, in O(n depth).
//!
//! After Carpentier and Mansard (RSS 2018) and Singh, Russell and Wensing (RA-L 7, 2022), here in world axes
//! about each body's own origin. In this file velocities v, accelerations a and forces f are *spatial*: a =
//! dv/dt of the six-vector, so that products of motions x and of forces x* are derivatives.
//!
//! Moving joint j by dq_j turns and shifts everything beyond it by the twist S_j dq_j. Whatever is fixed to those
//! bodies changes by S_j x; against that, with the joint's parent p and child c,
//!
//! dv_i/dq_j = S_j x v_i + Psi', where Psi' = v_p x S_j,
//! da_i/dq_j = S_j x a_i + Psi'' - v_i x Psi', where Psi'' = a_p x S_j + v_p x Psi',
//! dv_i/dqd_j = S_j, da_i/dqd_j = Psi' + S' - v_i x S_j, where S' = v_c x S_j,
//!
//! for all i beyond j. Into f_i = I_i a_i + v_i x* I_i v_i - external_i, with
//! B x = v x* (I x) - I (v x x) + x x* (I v), and sums over all bodies beyond a joint (Ic, Bc, Gc, F):
//!
//! dF_k/dq_j = S_j x* F + Ic Psi'' + Bc Psi' + Gc S_j, dF_k/dqd_j = Ic (Psi' + S') + Bc S_j,
//!
//! sums taken beyond the outer one of j and k. G is what external forces lack of turning with the body: a force f
//! that keeps its direction in the world contributes, at its point, to angular displacements w the force w x f; one
//! given in body axes nothing. For a joint k beyond j, S_k turns too, which takes S_j x* F back out of
//! tau_k = S_k' F_k.

use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Workspace, aba, rnea};
use faer::Mat;
use vertebra_assembly::{Model, State, Units};
use vertebra_spatial::matrix6::add_scaled;
use vertebra_spatial::{Force, Mat6, Motion, Number, Real, RigidInertia, Vec3};

/// First derivatives of joint forces or joint accelerations, all of shape [`Model::dof_count`] squared:
/// `m[(row, column)]` is of the result's freedom `row` by the variable's freedom `column`; in SI.
///
/// Derivatives by positions are in the tangent space: a column is the rate at which the result changes while
/// the position moves with the rate qd that is 1 for that freedom and 0 for all others. For revolute and prismatic
/// joints that is the derivative by q; a spherical joint turns about an axis of the child, q exp(e), and a free
/// one moves along it also.
#[derive(Clone, Debug)]
pub struct Derivatives {
    /// By positions.
    pub position: Mat<f64>,
    /// By joint rates qd.
    pub rate: Mat<f64>,
    /// Of [`rnea_derivatives`]: by joint accelerations, the mass matrix H. Of [`aba_derivatives`]: by joint forces,
    /// H^-1.
    pub drive: Mat<f64>,
}

impl Derivatives {
    /// Takes the memory for one model.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let zeros = || Mat::zeros(model.dof_count(), model.dof_count());
        Self {
            position: zeros(),
            rate: zeros(),
            drive: zeros(),
        }
    }

    fn check(&self, model: &Model) -> Result<(), Error> {
        if self.position.nrows() == model.dof_count() {
            return Ok(());
        }
        Err(Error::WrongWorkspace {
            workspace: "derivatives".to_owned(),
            model: model.name().to_owned(),
        })
    }

    fn finite(&self, model: &Model, time: f64) -> Result<(), Error> {
        for matrix in [&self.position, &self.rate, &self.drive] {
            for column in 0..matrix.ncols() {
                crate::finite_results(model, "derivative", matrix.col_as_slice(column), time)?;
            }
        }
        Ok(())
    }
}

/// Memory of the derivatives, one entry a body unless it says otherwise; about the body's origin.
#[derive(Clone, Debug)]
pub(crate) struct Tangents<T: Number> {
    /// Ic.
    composite: Vec<RigidInertia<T>>,
    /// Bc.
    gyroscopic: Vec<Mat6<T>>,
    /// Gc.
    following: Vec<Mat6<T>>,
    /// F.
    force: Vec<Force<T>>,
    /// Psi', Psi'', Psi' + S', one entry a freedom.
    first: Vec<Motion<T>>,
    second: Vec<Motion<T>>,
    rate: Vec<Motion<T>>,
}

impl<T: Real> Tangents<T> {
    fn new(bodies: usize, freedoms: usize) -> Self {
        Self {
            composite: vec![RigidInertia::ZERO; bodies],
            gyroscopic: vec![Mat6::ZERO; bodies],
            following: vec![Mat6::ZERO; bodies],
            force: vec![Force::ZERO; bodies],
            first: vec![Motion::ZERO; freedoms],
            second: vec![Motion::ZERO; freedoms],
            rate: vec![Motion::ZERO; freedoms],
        }
    }
}

/// Derivatives of inverse dynamics, tau(q, qd, qdd) of [`rnea`], by all three: `out.drive` is the mass matrix,
/// with the inertia of freedoms' own on its diagonal.
/// External forces act where and in the axes in which they were given. O(n depth).
///
/// # Errors
/// As [`rnea`]; [`Error::WrongWorkspace`] if `out` has another size; [`Error::Overflow`].
pub fn rnea_derivatives(
    model: &Model,
    state: &State,
    qdd: &[f64],
    forces: &Forces,
    workspace: &mut Workspace,
    out: &mut Derivatives,
) -> Result<(), Error> {
    out.check(model)?;
    rnea(model, state, qdd, forces, workspace)?;
    workspace.differentiate(forces, out);
    for (row, column, own) in forces.inertias(model) {
        out.drive[(row, column)] += own;
    }
    out.finite(model, state.time)
}

/// Derivatives of forward dynamics, qdd(q, qd, tau) of [`aba`], by all three: `out.drive` is H^-1.
///
/// From tau(q, qd, qdd(q, qd, tau)) = tau: dqdd/dq = -H^-1 dtau/dq and likewise for the others, each column
/// a substitution through the factors of [`aba`]: O(n) a column, O(n^2) in all. The accelerations can be read
/// from the workspace afterwards.
///
/// # Errors
/// As [`aba`]; [`Error::WrongWorkspace`] if `out` has another size; [`Error::Overflow`].
pub fn aba_derivatives(
    model: &Model,
    state: &State,
    forces: &Forces,
    workspace: &mut Workspace,
    out: &mut Derivatives,
) -> Result<(), Error> {
    out.check(model)?;
    aba(model, state, forces, workspace)?;
    workspace.differentiate(forces, out);
    let Derivatives {
        position,
        rate,
        drive,
    } = &mut *out;
    let dofs = model.dof_count();
    drive.fill(0.0);
    for dof in 0..dofs {
        drive[(dof, dof)] = -1.0;
    }
    for matrix in [position, rate, drive] {
        for column in 0..dofs {
            let column = matrix.col_as_slice_mut(column);
            for (entry, scale) in column.iter_mut().zip(&workspace.scales.force) {
                *entry /= -scale;
            }
            workspace.substitute(column);
            for (entry, scale) in column.iter_mut().zip(&workspace.scales.acceleration) {
                *entry *= scale;
            }
        }
    }
    out.finite(model, state.time)
}

impl Workspace {
    /// Derivatives of the joint forces at the state and accelerations at hand.
    fn differentiate(&mut self, forces: &Forces, out: &mut Derivatives) {
        let (model, scales) = (&self.model, &self.scales);
        let Derivatives {
            position,
            rate,
            drive,
        } = out;
        for matrix in [&mut *position, &mut *rate, &mut *drive] {
            matrix.fill(0.0);
        }
        let units = model.units();
        in_precision!(&mut self.arrays, s => {
            s.set_positions_and_velocities();
            let mut own = (s.tangents.take())
                .unwrap_or_else(|| Tangents::new(s.links.len(), s.u.len()).into());
            s.set_tangents(forces, units, &mut own);
            s.for_each_derivative(&own, |row, column, [by_position, by_rate, by_acceleration]| {
                // A rate in SI is this many displacements in the model's units a second.
                let (force, per_rate) = (scales.force[row], scales.rate[column]);
                position[(row, column)] = by_position * force * per_rate / units.time;
                rate[(row, column)] = by_rate * force * per_rate;
                drive[(row, column)] = by_acceleration * force / scales.acceleration[column];
            });
            s.tangents = Some(own);
        });
    }
}

impl<T: Real> Sweeps<T> {
    fn set_tangents(&self, forces: &Forces, units: &Units, own: &mut Tangents<T>) {
        for i in 0..self.links.len() {
            let (inertia, v) = (self.inertia[i], self.velocity[i]);
            own.composite[i] = inertia;
            own.force[i] = inertia.mul(self.acceleration[i]) - self.external[i];
            own.gyroscopic[i] = gyroscopic(&inertia, v);
            own.following[i] = Mat6::ZERO;
            let (above, pull) = match self.links[i].parent {
                Some(p) => (self.velocity[p], self.spatial_acceleration(p)),
                None => (Motion::ZERO, self.base),
            };
            let (above, pull) = (above.shifted(self.offset[i]), pull.shifted(self.offset[i]));
            for dof in self.dofs(i) {
                let column = self.subspace[dof];
                own.first[dof] = above.cross(column);
                own.second[dof] = pull.cross(column) + above.cross(own.first[dof]);
                own.rate[dof] = own.first[dof] + v.cross(column);
            }
        }
        for (id, wrench) in forces.acting() {
            if !wrench.body_axes {
                let i = id.index();
                let at = wrench.point.map_or(self.frames[i].center, |point| {
                    (self.frames[i].placement).point(Vec3::from_glam(point / units.length))
                });
                let torque = Vec3::from_glam(wrench.torque / units.energy());
                let force = Vec3::from_glam(wrench.force / units.force());
                add_following(&mut own.following[i], self.rotation[i] * at, torque, force);
            }
        }
        for i in (0..self.links.len()).rev() {
            if let Some(parent) = self.links[i].parent {
                let r = self.offset[i];
                let composite = own.composite[i].shifted_back(r);
                own.composite[parent] += composite;
                let force = own.force[i].shifted_back(r);
                own.force[parent] += force;
                let gyroscopic = congruent(&own.gyroscopic[i], r);
                add(&mut own.gyroscopic[parent], &gyroscopic);
                let following = congruent(&own.following[i], r);
                add(&mut own.following[parent], &following);
            }
        }
    }

    /// Calls `entry(row, column, [by position, by rate, by acceleration])` for the derivatives of joint forces
    /// that are not zero, in the model's units.
    fn for_each_derivative(
        &self,
        own: &Tangents<T>,
        mut entry: impl FnMut(usize, usize, [f64; 3]),
    ) {
        for c in 0..self.links.len() {
            let (composite, gyroscopic, following) =
                (&own.composite[c], &own.gyroscopic[c], &own.following[c]);
            for j in self.dofs(c) {
                let column = self.subspace[j];
                let times =
                    |matrix: &Mat6<T>, x: Motion<T>| Force::from_array(matrix.mul(&x.to_array()));
                let transposed =
                    |matrix: &Mat6<T>| Force::from_array(matrix.transpose_mul(&column.to_array()));
                // dF by q_j and qd_j, without what turns with S_j; and as rows, S_j' of the three sums.
                let mut by_position = composite.mul(own.second[j])
                    + times(gyroscopic, own.first[j])
                    + times(following, column);
                let mut by_rate = composite.mul(own.rate[j]) + times(gyroscopic, column);
                let mut inertial = composite.mul(column);
                let mut gyrating = transposed(gyroscopic);
                let mut following = transposed(following);
                for k in self.dofs(c) {
                    let along = self.subspace[k];
                    let derivatives =
                        [by_position, by_rate, inertial].map(|f| along.dot(f).to_f64());
                    entry(k, j, derivatives);
                }
                by_position += column.cross_force(own.force[c]);
                let mut at = c;
                while let Some(parent) = self.links[at].parent {
                    let r = self.offset[at];
                    by_position = by_position.shifted_back(r);
                    by_rate = by_rate.shifted_back(r);
                    inertial = inertial.shifted_back(r);
                    gyrating = gyrating.shifted_back(r);
                    following = following.shifted_back(r);
                    at = parent;
                    for k in self.dofs(at) {
                        let along = self.subspace[k];
                        let mass = along.dot(inertial).to_f64();
                        let inward = [by_position, by_rate].map(|f| along.dot(f).to_f64());
                        entry(k, j, [inward[0], inward[1], mass]);
                        let position = own.second[k].dot(inertial)
                            + own.first[k].dot(gyrating)
                            + along.dot(following);
                        let rate = own.rate[k].dot(inertial) + along.dot(gyrating);
                        entry(j, k, [position.to_f64(), rate.to_f64(), mass]);
                    }
                }
            }
        }
    }

    /// A body's spatial acceleration, gravity taken off: that of its point at the origin less w x v.
    fn spatial_acceleration(&self, body: usize) -> Motion<T> {
        let (a, v) = (self.acceleration[body], self.velocity[body]);
        Motion::new(a.angular, a.linear - v.angular.cross(v.linear))
    }
}

/// B x = v x* (I x) - I (v x x) + x x* (I v) as a matrix.
fn gyroscopic<T: Real>(inertia: &RigidInertia<T>, v: Motion<T>) -> Mat6<T> {
    let momentum = inertia.mul(v);
    let mut transposed = Mat6::IDENTITY;
    for row in &mut transposed.0 {
        let x = Motion::from_array(*row);
        let force =
            v.cross_force(inertia.mul(x)) - inertia.mul(v.cross(x)) + x.cross_force(momentum);
        *row = force.to_array();
    }
    transposed.transpose()
}

/// Adds what a torque and a force at `r` that keep their directions lack of turning by w: w x torque and, at
/// `r`, w x force.
fn add_following<T: Real>(sum: &mut Mat6<T>, r: Vec3<T>, torque: Vec3<T>, force: Vec3<T>) {
    for (column, w) in [
        Vec3::from_array([T::ONE, T::ZERO, T::ZERO]),
        Vec3::from_array([T::ZERO, T::ONE, T::ZERO]),
        Vec3::from_array([T::ZERO, T::ZERO, T::ONE]),
    ]
    .into_iter()
    .enumerate()
    {
        let lacking = Force::new(w.cross(torque), w.cross(force)).shifted_back(r);
        for (row, entry) in sum.0.iter_mut().zip(lacking.to_array()) {
            row[column] += entry;
        }
    }
}

/// X' M X: from motions to forces about the point from which this origin lies at `r`.
fn congruent<T: Real>(matrix: &Mat6<T>, r: Vec3<T>) -> Mat6<T> {
    let half = matrix.shifted_back(r).transpose();
    half.shifted_back(r).transpose()
}

fn add<T: Real>(sum: &mut Mat6<T>, term: &Mat6<T>) {
    for (sum, term) in sum.0.iter_mut().zip(&term.0) {
        add_scaled(sum, term, T::ONE);
    }
}
