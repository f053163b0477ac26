//! Joints made of several in a row.

use crate::{BodyDescription, Joint, MassProperties};
use vertebra_spatial::Pose;

/// A joint made of several in a row, whose motions are carried out one after the other: a product of
/// exponentials (Brockett 1984).
///
/// A model knows joints of one, three and six freedoms. What moves otherwise is a row of those with
/// bodies of no mass between: added to a description under the name `arm`, the bodies between are
/// `arm.1`, `arm.2`, ..., and the last one is `arm` itself. Their coordinates are consecutive, in the
/// order of the motions. [`Joint::cylindrical`], [`Joint::universal`] and [`Joint::planar`] are the
/// usual ones; others are made of [`new`](Self::new).
///
/// ```
/// use glam::DVec3;
/// use vertebra_assembly::{Compound, Joint, MassProperties, ModelDescription};
///
/// // A custom subspace: a screw, then a hinge beside it.
/// let wrist = Compound::new([
///     Joint::screw(DVec3::Z, 0.002),
///     Joint::revolute(DVec3::X).through(DVec3::new(0.0, 0.01, 0.0)),
/// ]);
/// let model = ModelDescription::new("tool")
///     .body("hand", None, wrist, MassProperties::sphere(1.0, 0.1))
///     .build()?;
/// assert_eq!((model.bodies().len(), model.dof_count()), (2, 2));
/// assert!(model.find("hand.1").is_some());
/// # Ok::<(), vertebra_assembly::ModelError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Compound {
    joints: Vec<Joint>,
    parent_placement: Pose,
    child_placement: Pose,
}

impl Compound {
    /// Several joints in a row, the one at the parent first. At q = 0 all of their frames coincide
    /// unless they are placed otherwise ([`Joint::through`]). None of them at all allow no motion.
    #[must_use]
    pub fn new(joints: impl IntoIterator<Item = Joint>) -> Self {
        Self {
            joints: joints.into_iter().collect(),
            parent_placement: Pose::IDENTITY,
            child_placement: Pose::IDENTITY,
        }
    }

    /// Puts the first joint's frame at `placement` on the parent.
    #[must_use]
    pub const fn at(mut self, placement: Pose) -> Self {
        self.parent_placement = placement;
        self
    }

    /// Puts the last joint's frame at `placement` on the child.
    #[must_use]
    pub const fn on_child(mut self, placement: Pose) -> Self {
        self.child_placement = placement;
        self
    }

    /// Changes each joint of the row, the one at the parent first: its range, damping, spring.
    #[must_use]
    pub fn map(mut self, change: impl FnMut(Joint) -> Joint) -> Self {
        self.joints = self.joints.into_iter().map(change).collect();
        self
    }

    /// The joints in a row, the one at the parent first, their frames where they belong.
    #[must_use]
    pub fn into_joints(mut self) -> Vec<Joint> {
        if self.joints.is_empty() {
            self.joints.push(Joint::fixed());
        }
        let place = |on: Pose, placement: &mut Pose| {
            // Placements that need no product keep their bits.
            if *placement == Pose::IDENTITY {
                *placement = on;
            } else if on != Pose::IDENTITY {
                *placement = on * *placement;
            }
        };
        if let Some(first) = self.joints.first_mut() {
            place(self.parent_placement, &mut first.parent_placement);
        }
        if let Some(last) = self.joints.last_mut() {
            place(self.child_placement, &mut last.child_placement);
        }
        self.joints
    }

    /// The bodies of a description that carry `name` by this joint.
    pub(crate) fn bodies(
        self,
        name: String,
        parent: Option<&str>,
        mass: MassProperties,
    ) -> impl Iterator<Item = BodyDescription> {
        let joints = self.into_joints();
        let count = joints.len();
        let mut parent = parent.map(str::to_owned);
        joints.into_iter().enumerate().map(move |(index, joint)| {
            let (name, mass) = if index + 1 == count {
                (name.clone(), mass)
            } else {
                (format!("{name}.{}", index + 1), MassProperties::MASSLESS)
            };
            BodyDescription {
                parent: parent.replace(name.clone()),
                name,
                joint,
                mass,
            }
        })
    }
}

impl From<Joint> for Compound {
    fn from(joint: Joint) -> Self {
        Self::new([joint])
    }
}
