//! What several tests share: independent forward kinematics, a bit-exact digest, comparisons.
#![expect(dead_code, reason = "each test binary uses a part of it")]
#![expect(clippy::panic, reason = "a test fails by panicking")]

use glam::{DAffine3, DMat3, DQuat, DVec3};
use vertebra_assembly::{Joint, JointKind, MassProperties, Model, ModelDescription, State};
use vertebra_spatial::Pose;

/// A placement as a 3 x 4 matrix, composed without [`Pose`]'s own product.
pub(crate) fn affine(pose: &Pose) -> DAffine3 {
    DAffine3::from_rotation_translation(pose.rotation, pose.translation)
}

/// Where every body is in the world at positions q.
pub(crate) fn body_placements(model: &Model, q: &[f64]) -> Vec<DAffine3> {
    let mut placements: Vec<DAffine3> = Vec::new();
    for body in model.bodies() {
        let q = &q[body.position_range()];
        let moved = match body.joint.kind {
            JointKind::Fixed => DAffine3::IDENTITY,
            JointKind::Revolute { axis } => DAffine3::from_axis_angle(axis, q[0]),
            JointKind::Prismatic { axis } => DAffine3::from_translation(axis * q[0]),
            JointKind::Screw { axis, pitch } => DAffine3::from_rotation_translation(
                DQuat::from_axis_angle(axis, q[0]),
                axis * (pitch * q[0]),
            ),
            JointKind::Spherical => DAffine3::from_quat(DQuat::from_slice(q)),
            JointKind::Free => DAffine3::from_rotation_translation(
                DQuat::from_slice(&q[3..]),
                DVec3::from_slice(&q[..3]),
            ),
        };
        let parent = match body.parent {
            Some(parent) => placements[parent.index()],
            None => DAffine3::IDENTITY,
        };
        let joint = &body.joint;
        let child = affine(&joint.child_placement).inverse();
        placements.push(parent * affine(&joint.parent_placement) * moved * child);
    }
    placements
}

/// Where the body or frame of that name is in the world.
pub(crate) fn named_placement(model: &Model, placements: &[DAffine3], name: &str) -> DAffine3 {
    if let Some(body) = model.find(name) {
        return placements[body.index()];
    }
    let frame = model.find_frame(name);
    let frame = frame.unwrap_or_else(|| panic!("no body or frame `{name}`"));
    let body = frame
        .body
        .map_or(DAffine3::IDENTITY, |body| placements[body.index()]);
    body * affine(&frame.placement)
}

/// Mass, first moment and second moment about the world's origin, by plain sums.
pub(crate) fn total_moments(model: &Model, placements: &[DAffine3]) -> (f64, DVec3, DMat3) {
    let mut total = (0.0, DVec3::ZERO, DMat3::ZERO);
    for (body, placement) in model.bodies().iter().zip(placements) {
        let MassProperties {
            mass,
            center,
            inertia,
        } = body.mass;
        let center = placement.transform_point3(center);
        let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        let second = DMat3::from_diagonal(DVec3::splat(0.5 * trace)) - inertia;
        let outer = DMat3::from_cols(center * center.x, center * center.y, center * center.z);
        let rotation = placement.matrix3;
        total.0 += mass;
        total.1 += center * mass;
        total.2 += rotation * second * rotation.transpose() + outer * mass;
    }
    total
}

/// Fails, with both, where two transforms differ by more than `tolerance` in any entry.
pub(crate) fn assert_same_placement(a: &DAffine3, b: &DAffine3, tolerance: f64, what: &str) {
    let difference = a
        .to_cols_array()
        .iter()
        .zip(b.to_cols_array())
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(
        difference <= tolerance,
        "{what}: placements differ by {difference:e} > {tolerance:e}\n{a}\n{b}"
    );
}

/// A digest of the bits of numbers (FNV-1a, 64 bits).
pub(crate) struct Digest(u64);

impl Digest {
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub(crate) fn value(&self) -> u64 {
        self.0
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    pub(crate) fn numbers(&mut self, numbers: &[f64]) {
        for number in numbers {
            self.bytes(&number.to_bits().to_le_bytes());
        }
    }

    fn pose(&mut self, pose: &Pose) {
        self.numbers(&pose.rotation.to_array());
        self.numbers(&pose.translation.to_array());
    }

    fn joint(&mut self, joint: &Joint) {
        self.bytes(&[match joint.kind {
            JointKind::Fixed => 0,
            JointKind::Revolute { .. } => 1,
            JointKind::Prismatic { .. } => 2,
            JointKind::Spherical => 3,
            JointKind::Free => 4,
            JointKind::Screw { .. } => 5,
        }]);
        if let Some(axis) = joint.kind.axis() {
            self.numbers(&axis.to_array());
        }
        self.pose(&joint.parent_placement);
        self.pose(&joint.child_placement);
    }

    /// Of everything a description of joints without limits says.
    pub(crate) fn of(description: &ModelDescription) -> u64 {
        let mut digest = Self::new();
        digest.bytes(description.name.as_bytes());
        digest.numbers(&description.gravity.to_array());
        for body in &description.bodies {
            digest.bytes(body.name.as_bytes());
            digest.bytes(body.parent.as_deref().unwrap_or("-").as_bytes());
            digest.joint(&body.joint);
            digest.numbers(&[body.mass.mass]);
            digest.numbers(&body.mass.center.to_array());
            digest.numbers(&body.mass.inertia.to_cols_array());
        }
        digest.value()
    }

    pub(crate) fn of_state(state: &State) -> u64 {
        let mut digest = Self::new();
        digest.numbers(&state.q);
        digest.numbers(&state.qd);
        digest.numbers(&[state.time]);
        digest.value()
    }
}
