//! What acts in a joint of its own accord: springs, and what keeps it in its range.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A linear spring across a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// Force a displacement [N m/rad or N/m], of a spherical joint in all directions.
    pub stiffness: f64,
    /// Where it is at rest.
    pub rest: Rest,
}

/// The position in which a spring is at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rest {
    /// Of a joint with one freedom [rad or m].
    Position(f64),
    /// Of a spherical joint: the child's orientation.
    Orientation(DQuat),
}

impl Spring {
    /// A spring of a joint with one freedom, at rest at a position [rad or m].
    #[must_use]
    pub const fn at(stiffness: f64, position: f64) -> Self {
        Self {
            stiffness,
            rest: Rest::Position(position),
        }
    }

    /// A spring of a spherical joint, at rest in an orientation of the child.
    #[must_use]
    pub const fn turned(stiffness: f64, orientation: DQuat) -> Self {
        Self {
            stiffness,
            rest: Rest::Orientation(orientation),
        }
    }
}

/// What keeps a joint in the range of its limits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Stop {
    /// An impulse, which lets the joint come to the limit and no further.
    Hard {
        /// Speed after an impact as part of that before, 0 to 1.
        restitution: f64,
    },
    /// A spring and a damper that act beyond the limit, outwards never.
    Soft {
        /// Force a displacement beyond the limit [N m/rad or N/m].
        stiffness: f64,
        /// Force a speed beyond the limit [N m s/rad or N s/m].
        damping: f64,
    },
}

/// The range of a spherical joint ([`Joint::with_ball_range`](crate::Joint::with_ball_range)), counted from where
/// its two frames coincide.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum BallRange {
    /// Turns up to an angle, about whatever axis.
    Turn {
        /// Largest angle \[rad\], above 0 and below pi.
        angle: f64,
    },
    /// An axis of the child stays in a cone about the same axis of the parent, and the child twists about it
    /// within bounds.
    Cone {
        /// Direction of the axis, in both joint frames.
        axis: DVec3,
        /// Largest angle between the two axes \[rad\], above 0 and below pi.
        swing: f64,
        /// Smallest and largest twist \[rad\], within -pi and pi; none for any.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        twist: Option<[f64; 2]>,
    },
}

impl BallRange {
    /// Turns up to an angle \[rad\], about whatever axis.
    #[must_use]
    pub const fn turn(angle: f64) -> Self {
        Self::Turn { angle }
    }

    /// Swings of an axis up to an angle \[rad\], with any twist about it.
    #[must_use]
    pub const fn cone(axis: DVec3, swing: f64) -> Self {
        Self::Cone {
            axis,
            swing,
            twist: None,
        }
    }

    /// Swings of an axis up to an angle \[rad\], with twists about it between two \[rad\].
    #[must_use]
    pub const fn cone_and_twist(axis: DVec3, swing: f64, lower: f64, upper: f64) -> Self {
        Self::Cone {
            axis,
            swing,
            twist: Some([lower, upper]),
        }
    }
}

impl Stop {
    /// A hard stop that takes all speed out.
    pub const HARD: Self = Self::Hard { restitution: 0.0 };
}

impl Default for Stop {
    fn default() -> Self {
        Self::HARD
    }
}
