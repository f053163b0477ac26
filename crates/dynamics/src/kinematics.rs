//! Forward kinematics: rotations, motion subspaces, velocity products; positions and velocities
//! when something asks for them.
//!
//! Everything is in world axes; each body has its own origin, its joint's. With r the offset of
//! that origin from the parent's, w the parent's angular velocity, w_J, v_J the relative velocity
//! across the joint, conventional accelerations obey
//!
//! a = X a_parent + S qdd + c,
//! c = [w x w_J; w x (w x r) + 2 w x v_J + w_J x v_J],
//!
//! the last term only where the linear rates are given in axes that turn with the child (free
//! joints); a prismatic axis turns with the parent.

use crate::workspace::{Computed, Sweeps, in_precision};
use crate::{Error, Workspace, link::Kind};
use glam::DQuat;
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Mat3, Motion, Quat, Real, Transform, Vec3, subspace, vec3};

/// Computes poses and velocities of all bodies; [`Workspace::pose`] and [`Workspace::velocity`]
/// read them.
///
/// # Errors
/// [`Error`] if the state does not fit the model, the workspace belongs to another, or a result
/// overflows.
pub fn forward_kinematics(
    model: &Model,
    state: &State,
    workspace: &mut Workspace,
) -> Result<(), Error> {
    workspace.set_state(model, state)?;
    body_poses(workspace)
}

/// Computes poses and velocities of all bodies for the state of the last [`aba`](crate::aba),
/// [`rnea`](crate::rnea) or [`crba`](crate::crba), beside its results.
///
/// # Errors
/// [`Error::NotComputed`] if there was none, [`Error::Overflow`].
pub fn body_poses(workspace: &mut Workspace) -> Result<(), Error> {
    workspace.require_state()?;
    let failed = in_precision!(&mut workspace.arrays, s => {
        s.set_positions_and_velocities();
        (0..s.links.len()).find(|&i| !(s.position[i].is_finite() && s.velocity[i].is_finite()))
    });
    workspace.refuse_overflow("pose or velocity", failed)?;
    workspace.computed.poses = true;
    Ok(())
}

impl Workspace {
    /// Checks model and state and runs the sweep that every algorithm begins with.
    pub(crate) fn set_state(&mut self, model: &Model, state: &State) -> Result<(), Error> {
        self.check_model(model)?;
        state.check(model)?;
        self.computed = Computed::default();
        self.time = state.time;
        let (length, rates) = (model.units().length, &self.scales.rate);
        let failed = in_precision!(&mut self.arrays, s => {
            s.set_state(state, length, rates);
            // Whatever overflowed on the way is in the velocity products.
            (0..s.links.len()).find(|&i| !s.bias_acceleration[i].is_finite())
        });
        self.refuse_overflow("position or velocity", failed)?;
        self.computed.state = true;
        Ok(())
    }
}

impl<T: Real> Sweeps<T> {
    /// From the world down: rotations, offsets, spins, subspaces and velocity products.
    pub(crate) fn set_state(&mut self, state: &State, length: f64, rate_scales: &[f64]) {
        for (rate, (&qd, &scale)) in self.rates.iter_mut().zip(state.qd.iter().zip(rate_scales)) {
            *rate = T::from_f64(qd * scale);
        }
        for i in 0..self.links.len() {
            let link = &self.links[i];
            let (parent, w) = match link.parent {
                Some(parent) => (self.rotation[parent], self.spin[parent]),
                None => (Mat3::IDENTITY, Vec3::ZERO),
            };
            let q = &state.q[link.q..];
            let rates = &self.rates[link.v..];
            let mut offset = parent * link.placement.translation;
            let mut turning_rates = Vec3::ZERO;
            let rotation;
            let joint_velocity;
            match &link.kind {
                Kind::Fixed => {
                    rotation = parent * link.placement.rotation;
                    joint_velocity = Motion::ZERO;
                }
                Kind::Revolute {
                    axis,
                    still,
                    swing,
                    turn,
                } => {
                    let (sin, cos) = T::sin_cos_of(q[0]);
                    rotation = parent * (*still + *swing * cos + *turn * sin);
                    let column = subspace::revolute(rotation * *axis);
                    joint_velocity = column[0] * rates[0];
                    self.subspace[link.v] = column[0];
                }
                Kind::Prismatic { axis } => {
                    rotation = parent * link.placement.rotation;
                    let column = subspace::prismatic(rotation * *axis);
                    offset += column[0].linear * T::from_f64(q[0] / length);
                    joint_velocity = column[0] * rates[0];
                    self.subspace[link.v] = column[0];
                }
                Kind::Spherical => {
                    rotation = parent * link.placement.rotation * orientation(q);
                    let columns = subspace::spherical(&rotation);
                    self.subspace[link.v..link.v + 3].copy_from_slice(&columns);
                    joint_velocity =
                        Motion::new(rotation * vec3(rates[0], rates[1], rates[2]), Vec3::ZERO);
                }
                Kind::Free => {
                    let at = vec3(q[0], q[1], q[2]).map(|x| T::from_f64(x / length));
                    let frame = Transform {
                        rotation: parent * link.placement.rotation,
                        translation: offset,
                    };
                    offset = frame.point(at);
                    rotation = frame.rotation * orientation(&q[3..]);
                    let columns = subspace::free(&rotation);
                    self.subspace[link.v..link.v + 6].copy_from_slice(&columns);
                    joint_velocity = Motion::new(
                        rotation * vec3(rates[0], rates[1], rates[2]),
                        rotation * vec3(rates[3], rates[4], rates[5]),
                    );
                    turning_rates = joint_velocity.angular.cross(joint_velocity.linear);
                }
            }
            let wj = w.cross(joint_velocity.linear);
            self.bias_acceleration[i] = Motion::new(
                w.cross(joint_velocity.angular),
                w.cross(w.cross(offset)) + wj + wj + turning_rates,
            );
            self.spin[i] = w + joint_velocity.angular;
            self.joint_velocity[i] = joint_velocity;
            self.offset[i] = offset;
            self.rotation[i] = rotation;
            self.inertia[i] = vertebra_spatial::RigidInertia {
                mass: link.inertia.mass,
                moment: rotation * link.inertia.moment,
                rotational: link.inertia.rotational.rotated(&rotation),
            };
        }
    }

    /// From the world down: origins and velocities.
    pub(crate) fn set_positions_and_velocities(&mut self) {
        for i in 0..self.links.len() {
            let (position, velocity) = match self.links[i].parent {
                Some(parent) => (self.position[parent], self.velocity[parent]),
                None => (Vec3::ZERO, Motion::ZERO),
            };
            self.position[i] = position + self.offset[i];
            self.velocity[i] = velocity.shifted(self.offset[i]) + self.joint_velocity[i];
        }
    }
}

/// Rotation matrix of a quaternion in coordinates, which is of unit length only to 1e-6.
pub(crate) fn orientation<T: Real>(q: &[f64]) -> Mat3<T> {
    let q = Quat::<T::Wide>::from_glam(DQuat::from_slice(q));
    q.normalized().to_matrix().map(T::narrow)
}
