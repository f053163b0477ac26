//! Joints: how a body may move against its parent.

use crate::element::{BallRange, Spring, Stop};
use crate::{Compound, ModelError};
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
/// | screw | angle \[rad\] | [rad/s] | 1 |
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
    /// Turns about an axis given in the joint frame and slides along it as it turns, like a nut.
    Screw {
        /// Direction of the axis; its length does not matter.
        axis: DVec3,
        /// Displacement a radian [m/rad]; positive for a right-handed thread.
        pitch: f64,
    },
    /// Turns about a point.
    Spherical,
    /// Moves freely.
    Free,
}

impl JointKind {
    /// Direction of the axis of a joint with one freedom.
    #[must_use]
    pub const fn axis(&self) -> Option<DVec3> {
        match *self {
            Self::Revolute { axis } | Self::Prismatic { axis } | Self::Screw { axis, .. } => {
                Some(axis)
            }
            Self::Fixed | Self::Spherical | Self::Free => None,
        }
    }

    pub(crate) const fn axis_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Self::Revolute { axis } | Self::Prismatic { axis } | Self::Screw { axis, .. } => {
                Some(axis)
            }
            Self::Fixed | Self::Spherical | Self::Free => None,
        }
    }

    /// Number of position coordinates.
    #[must_use]
    pub const fn position_count(&self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Revolute { .. } | Self::Prismatic { .. } | Self::Screw { .. } => 1,
            Self::Spherical => 4,
            Self::Free => 7,
        }
    }

    /// Number of degrees of freedom, which is that of rates and joint forces.
    #[must_use]
    pub const fn dof_count(&self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Revolute { .. } | Self::Prismatic { .. } | Self::Screw { .. } => 1,
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
    /// Range and strength. The range is kept by [`stop`](Self::stop); the effort bounds what a motor
    /// exerts; the velocity is read from files and not simulated.
    pub limits: Option<JointLimits>,
    /// What keeps the joint in its range.
    pub stop: Stop,
    /// Viscous damping [N m s/rad or N s/m], of a spherical joint in all directions.
    pub damping: f64,
    /// Dry (Coulomb) friction [N m or N], of a spherical joint against turns about any axis.
    pub friction: f64,
    /// Inertia of a motor's rotor as the joint feels it [kg m^2 or kg], of a spherical joint in all
    /// directions.
    pub armature: f64,
    /// A spring across the joint.
    pub spring: Option<Spring>,
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
            stop: Stop::HARD,
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
            spring: None,
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

    /// Turns about `axis` without end: a revolute joint, whose range is none until it is given one.
    #[must_use]
    pub const fn continuous(axis: DVec3) -> Self {
        Self::revolute(axis)
    }

    /// Slides along `axis`, given in the joint frame.
    #[must_use]
    pub const fn prismatic(axis: DVec3) -> Self {
        Self::new(JointKind::Prismatic { axis })
    }

    /// Turns about `axis`, given in the joint frame, and slides along it by `pitch` [m/rad].
    #[must_use]
    pub const fn screw(axis: DVec3, pitch: f64) -> Self {
        Self::new(JointKind::Screw { axis, pitch })
    }

    /// Turns about `axis` and slides along it: coordinates angle, then displacement.
    #[must_use]
    pub fn cylindrical(axis: DVec3) -> Compound {
        Compound::new([Self::revolute(axis), Self::prismatic(axis)])
    }

    /// Turns about `first`, fixed in the parent, then about `second`, fixed in the child (a Cardan
    /// joint): coordinates are the two angles.
    #[must_use]
    pub fn universal(first: DVec3, second: DVec3) -> Compound {
        Compound::new([Self::revolute(first), Self::revolute(second)])
    }

    /// Slides along `x` and `y`, fixed in the parent, and turns about their normal: coordinates are
    /// two displacements, then an angle.
    #[must_use]
    pub fn planar(x: DVec3, y: DVec3) -> Compound {
        // Of two parallel slides the model's checks name the one that moves nothing; any axis does for the turn.
        let mut normal = x.cross(y);
        if normal == DVec3::ZERO {
            normal = x.any_orthogonal_vector();
        }
        Compound::new([
            Self::prismatic(x),
            Self::prismatic(y),
            Self::revolute(normal),
        ])
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

    /// Whether anything acts in it of its own accord.
    pub(crate) fn has_elements(&self) -> bool {
        let rubs = self.damping > 0.0 || self.friction > 0.0;
        let acts = rubs || self.armature > 0.0 || self.spring.is_some();
        let limits = self.limits.unwrap_or_default();
        match self.kind.dof_count() {
            1 => acts || limits.position.is_some(),
            3 => acts || limits.orientation.is_some(),
            _ => false,
        }
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

    /// Lets the axis pass through `point`, given in the joint frame \[m\]: at q = 0 parent and child are
    /// as they were.
    #[must_use]
    pub fn through(mut self, point: DVec3) -> Self {
        let shift = Pose::from_translation(point);
        self.parent_placement = self.parent_placement * shift;
        self.child_placement = self.child_placement * shift;
        self
    }

    /// Keeps the position of a joint with one freedom between two bounds [rad or m].
    #[must_use]
    pub fn with_range(mut self, lower: f64, upper: f64) -> Self {
        self.limits.get_or_insert_default().position = Some([lower, upper]);
        self
    }

    /// Keeps the orientation of a spherical joint in a range.
    #[must_use]
    pub fn with_ball_range(mut self, range: BallRange) -> Self {
        self.limits.get_or_insert_default().orientation = Some(range);
        self
    }

    /// Bounds the force of a motor [N m or N].
    #[must_use]
    pub fn with_effort(mut self, effort: f64) -> Self {
        self.limits.get_or_insert_default().effort = Some(effort);
        self
    }

    /// Says what keeps the joint in its range.
    #[must_use]
    pub const fn with_stop(mut self, stop: Stop) -> Self {
        self.stop = stop;
        self
    }

    /// Sets viscous damping [N m s/rad or N s/m].
    #[must_use]
    pub const fn with_damping(mut self, damping: f64) -> Self {
        self.damping = damping;
        self
    }

    /// Sets dry friction [N m or N]. Where it holds a joint, that creeps by up to 1e-5 rad/s or m/s.
    #[must_use]
    pub const fn with_friction(mut self, friction: f64) -> Self {
        self.friction = friction;
        self
    }

    /// Sets the inertia of a rotor [kg m^2 or kg].
    #[must_use]
    pub const fn with_armature(mut self, armature: f64) -> Self {
        self.armature = armature;
        self
    }

    /// Adds a spring.
    #[must_use]
    pub const fn with_spring(mut self, spring: Spring) -> Self {
        self.spring = Some(spring);
        self
    }
}

/// Range and strength of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointLimits {
    /// Smallest and largest position [rad or m], where the joint has a range; a spherical one has none.
    pub position: Option<[f64; 2]>,
    /// Range of a spherical joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<BallRange>,
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
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pitch: Option<f64>,
    #[serde(default, skip_serializing_if = "is_identity")]
    parent_placement: Pose,
    #[serde(default, skip_serializing_if = "is_identity")]
    child_placement: Pose,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits: Option<JointLimits>,
    #[serde(default, skip_serializing_if = "is_hard")]
    stop: Stop,
    #[serde(default, skip_serializing_if = "is_zero")]
    damping: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    friction: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    armature: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    spring: Option<Spring>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mimic: Option<Mimic>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Fixed,
    Revolute,
    Prismatic,
    Screw,
    Spherical,
    Free,
}

impl From<Joint> for Saved {
    fn from(joint: Joint) -> Self {
        let (kind, pitch) = match joint.kind {
            JointKind::Fixed => (Kind::Fixed, None),
            JointKind::Revolute { .. } => (Kind::Revolute, None),
            JointKind::Prismatic { .. } => (Kind::Prismatic, None),
            JointKind::Screw { pitch, .. } => (Kind::Screw, Some(pitch)),
            JointKind::Spherical => (Kind::Spherical, None),
            JointKind::Free => (Kind::Free, None),
        };
        Self {
            kind,
            axis: joint.kind.axis(),
            pitch,
            parent_placement: joint.parent_placement,
            child_placement: joint.child_placement,
            limits: joint.limits,
            stop: joint.stop,
            damping: joint.damping,
            friction: joint.friction,
            armature: joint.armature,
            spring: joint.spring,
            mimic: joint.mimic,
        }
    }
}

impl TryFrom<Saved> for Joint {
    type Error = ModelError;

    fn try_from(saved: Saved) -> Result<Self, ModelError> {
        let kind = match (saved.kind, saved.axis, saved.pitch) {
            (Kind::Revolute, Some(axis), None) => JointKind::Revolute { axis },
            (Kind::Prismatic, Some(axis), None) => JointKind::Prismatic { axis },
            (Kind::Screw, Some(axis), Some(pitch)) => JointKind::Screw { axis, pitch },
            (Kind::Fixed, None, None) => JointKind::Fixed,
            (Kind::Spherical, None, None) => JointKind::Spherical,
            (Kind::Free, None, None) => JointKind::Free,
            (Kind::Screw, _, None) | (_, _, Some(_)) => {
                return Err(ModelError::BadParameter {
                    parameter: "the pitch of a joint",
                    requirement: "stated for screw joints and for no others",
                });
            }
            _ => {
                return Err(ModelError::BadParameter {
                    parameter: "the axis of a joint",
                    requirement: "stated for revolute, prismatic and screw joints and for no others",
                });
            }
        };
        Ok(Self {
            kind,
            parent_placement: saved.parent_placement,
            child_placement: saved.child_placement,
            limits: saved.limits,
            stop: saved.stop,
            damping: saved.damping,
            friction: saved.friction,
            armature: saved.armature,
            spring: saved.spring,
            mimic: saved.mimic,
        })
    }
}

fn is_identity(pose: &Pose) -> bool {
    *pose == Pose::IDENTITY
}

fn is_hard(stop: &Stop) -> bool {
    *stop == Stop::HARD
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
