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

use crate::link::{Kind, Link};
use crate::workspace::{Computed, Sweeps, in_precision};
use crate::{Error, Workspace};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{Mat3, Motion, Number, Vec3, subspace, vec3};

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
        self.q.copy_from_slice(&state.q);
        self.qd.copy_from_slice(&state.qd);
        let (length, rates) = (model.units().length, &self.scales.rate);
        let failed = in_precision!(&mut self.arrays, s => {
            s.set_state(&state.q, &state.qd, length, rates);
            // Whatever overflowed on the way is in the velocity products.
            (0..s.links.len()).find(|&i| !s.bias_acceleration[i].is_finite())
        });
        self.refuse_overflow("position or velocity", failed)?;
        self.computed.state = true;
        Ok(())
    }
}

impl<T: Number> Sweeps<T> {
    /// From the world down: rotations, offsets, spins, subspaces and velocity products, of
    /// accelerations and of forces.
    ///
    /// Of positions and rates in SI, shapes [`Model::position_count`] and [`Model::dof_count`].
    #[inline(always)]
    pub(crate) fn set_state(
        &mut self,
        q: &[T::Input],
        qd: &[T::Input],
        length: f64,
        rate_scales: &[f64],
    ) {
        for (rate, (&qd, &scale)) in self.rates.iter_mut().zip(qd.iter().zip(rate_scales)) {
            *rate = T::from_input(qd * T::Input::from_f64(scale));
        }
        let per_length = T::Input::from_f64(1.0 / length);
        // As long as each other: an index that is in one is in all.
        let n = self.links.len();
        let links = &self.links[..n];
        let rotations = &mut self.rotation[..n];
        let spins = &mut self.spin[..n];
        let offsets = &mut self.offset[..n];
        let joint_velocities = &mut self.joint_velocity[..n];
        let bias_accelerations = &mut self.bias_acceleration[..n];
        let inertias = &mut self.inertia[..n];
        let externals = &mut self.external[..n];
        let mut turns = [(T::ZERO, T::ZERO); BLOCK];
        for i in 0..n {
            if i % BLOCK == 0 {
                sines_and_cosines(&links[i..n.min(i + BLOCK)], q, &mut turns);
            }
            let link = &links[i];
            let (parent, w) = match link.parent {
                Some(parent) => (rotations[parent], spins[parent]),
                None => (Mat3::IDENTITY, Vec3::ZERO),
            };
            let q = &q[link.q..];
            let rates = &self.rates[link.v..];
            let mut rotation = parent * link.placement.rotation;
            let mut offset = parent * link.placement.translation;
            let mut joint_velocity = Motion::ZERO;
            let mut bias_acceleration = Motion::new(Vec3::ZERO, w.cross(w.cross(offset)));
            match link.kind {
                Kind::Fixed => {}
                Kind::Revolute => {
                    let (sin, cos) = turns[i % BLOCK];
                    let Mat3 { x_axis, y_axis, .. } = rotation;
                    rotation.x_axis = x_axis * cos + y_axis * sin;
                    rotation.y_axis = y_axis * cos - x_axis * sin;
                    self.subspace[link.v] = Motion::new(rotation.z_axis, Vec3::ZERO);
                    joint_velocity.angular = rotation.z_axis * rates[0];
                    bias_acceleration.angular = w.cross(joint_velocity.angular);
                }
                Kind::Prismatic => {
                    let along = rotation.z_axis;
                    offset += along * T::from_input(q[0] * per_length);
                    self.subspace[link.v] = Motion::new(Vec3::ZERO, along);
                    joint_velocity.linear = along * rates[0];
                    let sideways = w.cross(joint_velocity.linear);
                    bias_acceleration.linear = w.cross(w.cross(offset)) + sideways + sideways;
                }
                Kind::Screw => {
                    let (sin, cos) = turns[i % BLOCK];
                    let Mat3 { x_axis, y_axis, .. } = rotation;
                    rotation.x_axis = x_axis * cos + y_axis * sin;
                    rotation.y_axis = y_axis * cos - x_axis * sin;
                    let [column] = subspace::screw(rotation.z_axis, link.pitch);
                    offset += column.linear * T::from_input(q[0]);
                    self.subspace[link.v] = column;
                    joint_velocity = column * rates[0];
                    let sideways = w.cross(joint_velocity.linear);
                    bias_acceleration = Motion::new(
                        w.cross(joint_velocity.angular),
                        w.cross(w.cross(offset)) + sideways + sideways,
                    );
                }
                Kind::Spherical => {
                    rotation = rotation * T::rotation_of([q[0], q[1], q[2], q[3]]);
                    let columns = subspace::spherical(&rotation);
                    self.subspace[link.v..link.v + 3].copy_from_slice(&columns);
                    joint_velocity.angular = rotation * vec3(rates[0], rates[1], rates[2]);
                    bias_acceleration.angular = w.cross(joint_velocity.angular);
                }
                Kind::Free => {
                    let at = vec3(q[0], q[1], q[2]).map(|x| T::from_input(x * per_length));
                    offset += rotation * at;
                    rotation = rotation * T::rotation_of([q[3], q[4], q[5], q[6]]);
                    let columns = subspace::free(&rotation);
                    self.subspace[link.v..link.v + 6].copy_from_slice(&columns);
                    joint_velocity = Motion::new(
                        rotation * vec3(rates[0], rates[1], rates[2]),
                        rotation * vec3(rates[3], rates[4], rates[5]),
                    );
                    let sideways = w.cross(joint_velocity.linear);
                    bias_acceleration = Motion::new(
                        w.cross(joint_velocity.angular),
                        w.cross(w.cross(offset))
                            + sideways
                            + sideways
                            + joint_velocity.angular.cross(joint_velocity.linear),
                    );
                }
            }
            let spin = w + joint_velocity.angular;
            let inertia = link.inertia.rotated(&rotation);
            rotations[i] = rotation;
            offsets[i] = offset;
            spins[i] = spin;
            joint_velocities[i] = joint_velocity;
            bias_accelerations[i] = bias_acceleration;
            inertias[i] = inertia;
            externals[i] = -inertia.bias(spin);
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

/// Bodies whose joints' sines and cosines are computed together, as vector code.
pub(crate) const BLOCK: usize = 16;

/// Sine and cosine of the angles of revolute and screw joints; whatever for others.
#[inline(always)]
pub(crate) fn sines_and_cosines<T: Number>(
    links: &[Link<T>],
    q: &[T::Input],
    turns: &mut [(T, T); BLOCK],
) {
    let mut angles = [T::Input::ZERO; BLOCK];
    for (angle, link) in angles.iter_mut().zip(links) {
        if matches!(link.kind, Kind::Revolute | Kind::Screw) {
            *angle = q[link.q];
        }
    }
    T::sin_cos_of_each(&angles[..links.len()], turns);
}
