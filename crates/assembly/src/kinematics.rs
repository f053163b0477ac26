//! Where the bodies of a state are and how they move, for those who change the model.

use crate::{Body, Joint, JointKind, State};
use glam::{DQuat, DVec3};
use vertebra_spatial::Pose;

/// A body in the world, or a frame on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub(crate) pose: Pose,
    /// Angular velocity, world axes.
    pub(crate) spin: DVec3,
    /// Velocity of the frame's origin, world axes.
    pub(crate) velocity: DVec3,
}

impl Placed {
    pub(crate) const WORLD: Self = Self {
        pose: Pose::IDENTITY,
        spin: DVec3::ZERO,
        velocity: DVec3::ZERO,
    };

    /// A frame fixed to this one that has this pose in the world.
    pub(crate) fn carried(&self, pose: Pose) -> Self {
        let arm = pose.translation - self.pose.translation;
        Self {
            pose,
            spin: self.spin,
            velocity: self.velocity + self.spin.cross(arm),
        }
    }
}

/// The joint frame on the child, in that on the parent.
pub(crate) fn across(kind: &JointKind, q: &[f64]) -> Pose {
    match *kind {
        JointKind::Fixed => Pose::IDENTITY,
        JointKind::Revolute { axis } => Pose::new(turn(axis, q[0]), DVec3::ZERO),
        JointKind::Prismatic { axis } => Pose::from_translation(axis * q[0]),
        JointKind::Screw { axis, pitch } => Pose::new(turn(axis, q[0]), axis * (pitch * q[0])),
        JointKind::Spherical => Pose::new(DQuat::from_slice(q).normalize(), DVec3::ZERO),
        JointKind::Free => Pose::new(DQuat::from_slice(&q[3..]).normalize(), DVec3::from_slice(q)),
    }
}

fn turn(axis: DVec3, angle: f64) -> DQuat {
    let v = axis * libm::sin(0.5 * angle);
    DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(0.5 * angle))
}

/// Relative velocity across a joint, angular and linear, in the child's joint axes.
fn rates(kind: &JointKind, qd: &[f64]) -> (DVec3, DVec3) {
    match *kind {
        JointKind::Fixed => (DVec3::ZERO, DVec3::ZERO),
        JointKind::Revolute { axis } => (axis * qd[0], DVec3::ZERO),
        JointKind::Prismatic { axis } => (DVec3::ZERO, axis * qd[0]),
        JointKind::Screw { axis, pitch } => (axis * qd[0], axis * (pitch * qd[0])),
        JointKind::Spherical => (DVec3::from_slice(qd), DVec3::ZERO),
        JointKind::Free => (DVec3::from_slice(qd), DVec3::from_slice(&qd[3..])),
    }
}

/// The rates of a joint that are nearest to a relative velocity, in the child's joint axes.
pub(crate) fn project(kind: &JointKind, spin: DVec3, slide: DVec3) -> Vec<f64> {
    match *kind {
        JointKind::Fixed => Vec::new(),
        JointKind::Revolute { axis } => vec![axis.dot(spin)],
        JointKind::Prismatic { axis } => vec![axis.dot(slide)],
        JointKind::Screw { axis, pitch } => {
            vec![(axis.dot(spin) + pitch * axis.dot(slide)) / (1.0 + pitch * pitch)]
        }
        JointKind::Spherical => spin.to_array().to_vec(),
        JointKind::Free => [spin.to_array(), slide.to_array()].concat(),
    }
}

/// A body's own frame in a state, given its parent's.
pub(crate) fn of_body(parent: &Placed, body: &Body, state: &State) -> Placed {
    let q = &state.q[body.position_range()];
    beyond(parent, &body.joint, q, &state.qd[body.dof_range()])
}

/// The frame of the body that a joint carries, given its parent's and the joint's positions and rates.
pub(crate) fn beyond(parent: &Placed, joint: &Joint, q: &[f64], qd: &[f64]) -> Placed {
    let Joint {
        kind,
        parent_placement,
        child_placement,
        ..
    } = joint;
    let moved = across(kind, q);
    let mut frame = parent.carried(parent.pose * *parent_placement * moved);
    let (spin, slide) = rates(kind, qd);
    frame.spin += frame.pose.rotation * spin;
    frame.velocity += frame.pose.rotation * slide;
    let mut own = match *child_placement == Pose::IDENTITY {
        true => frame,
        false => frame.carried(frame.pose * child_placement.inverse()),
    };
    // The error of a product of many stays that of one.
    own.pose.rotation = own.pose.rotation.normalize();
    own
}
