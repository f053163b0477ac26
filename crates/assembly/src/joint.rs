//! Joints: how a body may move against its parent.

use crate::ModelError;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use vertebra_spatial::Pose;

/// The motion a joint allows.
///
/// | kind | position q | rate qd | qd counts |
/// |---|---|---|---|
/// | fixed | - | - | 0 |
/// | revolute | angle \[rad\] | [rad/s] | 1 |
/// | prismatic | displacement \[m\] | [m/s] | 1 |
/// | spherical | quaternion x, y, z, w | angular velocity, child joint axes [rad/s] | 3 |
/// | free | position \[m\] x, y, z, then quaternion x, y, z, w | angular [rad/s], then linear velocity [m/s], child joint axes | 6 |
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Turns about an axis given in the joint frame.
    Revolute {
        /// Direction of the axis; its length does not matter.
        axis: DVec3,
    },
    /// Slides along an axis given in the joint frame.
    Prismatic {
        /// Direction of the axis; its length does not matter.
        axis: DVec3,
    },
    /// Turns about a point.
    Spherical,
    /// Moves freely.
    Free,
}

impl JointKind {
    /// Number of position coordinates.
    #[must_use]
    pub const fn position_count(&self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Revolute { .. } | Self::Prismatic { .. } => 1,
            Self::Spherical => 4,
            Self::Free => 7,
        }
    }

    /// Number of degrees of freedom, which is that of rates and joint forces.
    #[must_use]
    pub const fn dof_count(&self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Revolute { .. } | Self::Prismatic { .. } => 1,
            Self::Spherical => 3,
            Self::Free => 6,
        }
    }
}

/// A joint: its kind, and where its two frames sit on parent and child.
///
/// At q = 0 (the identity quaternion) the two joint frames coincide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved", into = "Saved")]
pub struct Joint {
    /// The motion it allows.
    pub kind: JointKind,
    /// The joint frame on the parent, seen from the parent body's frame (or the world).
    pub parent_placement: Pose,
    /// The joint frame on the child, seen from the child body's frame.
    pub child_placement: Pose,
    /// Range and strength; read from files, not simulated yet.
    pub limits: Option<JointLimits>,
    /// Viscous damping [N m s/rad or N s/m]; read from files, not simulated yet.
    pub damping: f64,
    /// Static friction [N m or N]; read from files, not simulated yet.
    pub friction: f64,
    /// Coupling to another joint: [`Model::couplings`](crate::Model::couplings) has it.
    pub mimic: Option<Mimic>,
}

impl Joint {
    /// A joint of a kind, its frames on the frames of the two bodies.
    #[must_use]
    pub const fn new(kind: JointKind) -> Self {
        Self {
            kind,
            parent_placement: Pose::IDENTITY,
            child_placement: Pose::IDENTITY,
            limits: None,
            damping: 0.0,
            friction: 0.0,
            mimic: None,
        }
    }

    /// No motion.
    #[must_use]
    pub const fn fixed() -> Self {
        Self::new(JointKind::Fixed)
    }

    /// Turns about `axis`, given in the joint frame.
    #[must_use]
    pub const fn revolute(axis: DVec3) -> Self {
        Self::new(JointKind::Revolute { axis })
    }

    /// Slides along `axis`, given in the joint frame.
    #[must_use]
    pub const fn prismatic(axis: DVec3) -> Self {
        Self::new(JointKind::Prismatic { axis })
    }

    /// Turns about a point.
    #[must_use]
    pub const fn spherical() -> Self {
        Self::new(JointKind::Spherical)
    }

    /// Moves freely: the joint of a floating base.
    #[must_use]
    pub const fn free() -> Self {
        Self::new(JointKind::Free)
    }

    /// Puts the joint frame at `placement` on the parent.
    #[must_use]
    pub const fn at(mut self, placement: Pose) -> Self {
        self.parent_placement = placement;
        self
    }

    /// Puts the joint frame at `placement` on the child.
    #[must_use]
    pub const fn on_child(mut self, placement: Pose) -> Self {
        self.child_placement = placement;
        self
    }
}

/// Range and strength of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointLimits {
    /// Smallest and largest position [rad or m], where the joint has a range.
    pub position: Option<[f64; 2]>,
    /// Largest speed [rad/s or m/s], where one is stated.
    pub velocity: Option<f64>,
    /// Largest joint force [N m or N], where one is stated.
    pub effort: Option<f64>,
}

/// A joint that follows another: q = multiplier * q_other + offset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mimic {
    /// The body whose joint is followed.
    pub body: String,
    /// Ratio of the two positions.
    pub multiplier: f64,
    /// Position where the other is at zero [rad or m].
    pub offset: f64,
}

/// The joint as written to a file: flat, and without what is as it usually is. The kind is no
/// flattened enum, for with one unknown fields would pass unseen.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    #[serde(rename = "type")]
    kind: Kind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    axis: Option<DVec3>,
    #[serde(default, skip_serializing_if = "is_identity")]
    parent_placement: Pose,
    #[serde(default, skip_serializing_if = "is_identity")]
    child_placement: Pose,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits: Option<JointLimits>,
    #[serde(default, skip_serializing_if = "is_zero")]
    damping: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    friction: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mimic: Option<Mimic>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Fixed,
    Revolute,
    Prismatic,
    Spherical,
    Free,
}

impl From<Joint> for Saved {
    fn from(joint: Joint) -> Self {
        let (kind, axis) = match joint.kind {
            JointKind::Fixed => (Kind::Fixed, None),
            JointKind::Revolute { axis } => (Kind::Revolute, Some(axis)),
            JointKind::Prismatic { axis } => (Kind::Prismatic, Some(axis)),
            JointKind::Spherical => (Kind::Spherical, None),
            JointKind::Free => (Kind::Free, None),
        };
        Self {
            kind,
            axis,
            parent_placement: joint.parent_placement,
            child_placement: joint.child_placement,
            limits: joint.limits,
            damping: joint.damping,
            friction: joint.friction,
            mimic: joint.mimic,
        }
    }
}

impl TryFrom<Saved> for Joint {
    type Error = ModelError;

    fn try_from(saved: Saved) -> Result<Self, ModelError> {
        let kind = match (saved.kind, saved.axis) {
            (Kind::Revolute, Some(axis)) => JointKind::Revolute { axis },
            (Kind::Prismatic, Some(axis)) => JointKind::Prismatic { axis },
            (Kind::Fixed, None) => JointKind::Fixed,
            (Kind::Spherical, None) => JointKind::Spherical,
            (Kind::Free, None) => JointKind::Free,
            _ => {
                return Err(ModelError::BadParameter {
                    parameter: "the axis of a joint",
                    requirement: "stated for revolute and prismatic joints and for no others",
                });
            }
        };
        Ok(Self {
            kind,
            parent_placement: saved.parent_placement,
            child_placement: saved.child_placement,
            limits: saved.limits,
            damping: saved.damping,
            friction: saved.friction,
            mimic: saved.mimic,
        })
    }
}

fn is_identity(pose: &Pose) -> bool {
    *pose == Pose::IDENTITY
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
