//! Joints: how a body may move against its parent.

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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
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
pub struct Joint {
    /// The motion it allows.
    #[serde(flatten)]
    pub kind: JointKind,
    /// The joint frame on the parent, seen from the parent body's frame (or the world).
    #[serde(default, skip_serializing_if = "is_identity")]
    pub parent_placement: Pose,
    /// The joint frame on the child, seen from the child body's frame.
    #[serde(default, skip_serializing_if = "is_identity")]
    pub child_placement: Pose,
    /// Range and strength; read from files, not simulated yet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<JointLimits>,
    /// Viscous damping [N m s/rad or N s/m]; read from files, not simulated yet.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub damping: f64,
    /// Static friction [N m or N]; read from files, not simulated yet.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub friction: f64,
    /// Coupling to another joint; read from files, not simulated yet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
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
pub struct Mimic {
    /// The body whose joint is followed.
    pub body: String,
    /// Ratio of the two positions.
    pub multiplier: f64,
    /// Position where the other is at zero [rad or m].
    pub offset: f64,
}

fn is_identity(pose: &Pose) -> bool {
    *pose == Pose::IDENTITY
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
