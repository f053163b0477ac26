//! Mirror images of joints, loops and bodies.

use crate::{BallRange, Closure, Compound, Joint, JointKind, MassProperties, Rest, Spring};
use glam::{DMat3, DQuat, DVec3};
use vertebra_spatial::Pose;

/// A reflection M = 1 - 2 n n' in a plane through the origin.
///
/// Every frame is reflected and then turned back into a right-handed one by the same M in its own
/// coordinates, so that poses P become M P M, which are rigid motions again. Vectors of places become M v;
/// axes of rotation, whose sense a mirror reverses, -M a; so that coordinates of joints of one freedom keep their
/// signs. Those of spherical and free joints are vectors of either sort themselves.
pub(super) struct Mirror(DMat3);

impl Mirror {
    /// None if the normal has no direction.
    pub(super) fn new(normal: DVec3) -> Option<Self> {
        let n = normal.try_normalize()?;
        let outer = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        Some(Self(DMat3::IDENTITY - outer * 2.0))
    }

    /// M R M of a rotation about an axis a turns about -M a by the same angle.
    fn rotation(&self, q: DQuat) -> DQuat {
        let v = -(self.0 * DVec3::new(q.x, q.y, q.z));
        DQuat::from_xyzw(v.x, v.y, v.z, q.w)
    }

    pub(super) fn pose(&self, pose: &Pose) -> Pose {
        Pose::new(self.rotation(pose.rotation), self.0 * pose.translation)
    }

    pub(super) fn mass(&self, mass: &MassProperties) -> MassProperties {
        MassProperties {
            mass: mass.mass,
            center: self.0 * mass.center,
            inertia: self.0 * mass.inertia * self.0,
        }
    }

    pub(super) fn joint(&self, joint: &Joint) -> Joint {
        let kind = match joint.kind {
            JointKind::Revolute { axis } => JointKind::Revolute {
                axis: -(self.0 * axis),
            },
            JointKind::Prismatic { axis } => JointKind::Prismatic {
                axis: self.0 * axis,
            },
            JointKind::Screw { axis, pitch } => JointKind::Screw {
                axis: -(self.0 * axis),
                pitch: -pitch,
            },
            other => other,
        };
        let spring = joint.spring.map(|spring| match spring.rest {
            Rest::Position(_) => spring,
            Rest::Orientation(rest) => Spring::turned(spring.stiffness, self.rotation(rest)),
        });
        let mut limits = joint.limits;
        let range = limits.as_mut().and_then(|l| l.orientation.as_mut());
        if let Some(BallRange::Cone { axis, .. }) = range {
            *axis = -(self.0 * *axis);
        }
        Joint {
            kind,
            limits,
            parent_placement: self.pose(&joint.parent_placement),
            child_placement: self.pose(&joint.child_placement),
            spring,
            ..joint.clone()
        }
    }

    /// Axes of rotation turn as those of joints do; of others only the line matters.
    pub(super) fn closure(&self, closure: Closure) -> Closure {
        let turned = |axis: DVec3| -(self.0 * axis);
        match closure {
            Closure::Weld | Closure::Ball | Closure::Distance { .. } => closure,
            Closure::Revolute { axis } => Closure::Revolute { axis: turned(axis) },
            Closure::Prismatic { axis } => Closure::Prismatic {
                axis: self.0 * axis,
            },
            Closure::Screw { axis, pitch } => Closure::Screw {
                axis: turned(axis),
                pitch: -pitch,
            },
            Closure::Cylindrical { axis } => Closure::Cylindrical { axis: turned(axis) },
            Closure::Universal { first, second } => Closure::Universal {
                first: turned(first),
                second: turned(second),
            },
            Closure::Planar { normal } => Closure::Planar {
                normal: self.0 * normal,
            },
        }
    }

    pub(super) fn compound(&self, compound: Compound) -> Compound {
        let joints = compound.into_joints();
        Compound::new(joints.iter().map(|joint| self.joint(joint)))
    }
}
