//! What a model states and this version does not simulate.

use crate::Model;
use core::fmt;

/// A property of a joint that was read, is kept, and has no effect yet.
#[derive(Clone, Debug, PartialEq)]
pub struct NotSimulated {
    /// The body whose joint has the property.
    pub body: String,
    /// The property.
    pub feature: Feature,
}

/// A property that has no effect yet.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Feature {
    /// The joint, which is fixed or free, has limits of one number.
    Limits,
    /// Largest speed [rad/s or m/s].
    Velocity(f64),
    /// Damping of a fixed or free joint [N m s/rad or N s/m].
    Damping(f64),
    /// Friction of a fixed or free joint [N m or N].
    Friction(f64),
    /// Rotor inertia of a fixed or free joint [kg m^2 or kg].
    Armature(f64),
    /// The joint does not follow the named body's: one of them has not one freedom, or they are one.
    Mimic(String),
}

impl NotSimulated {
    pub(crate) fn of_model(model: &Model) -> Vec<Self> {
        let mut list = Vec::new();
        for (id, body) in model.body_ids().zip(model.bodies()) {
            let mut push = |feature| {
                list.push(Self {
                    body: body.name.clone(),
                    feature,
                });
            };
            let joint = &body.joint;
            let freedoms = joint.kind.dof_count();
            if let Some(limits) = &joint.limits {
                if limits.position.is_some() && freedoms != 1 {
                    push(Feature::Limits);
                }
                if let Some(velocity) = limits.velocity {
                    push(Feature::Velocity(velocity));
                }
            }
            let is_rigid = !matches!(freedoms, 1 | 3);
            if joint.damping != 0.0 && is_rigid {
                push(Feature::Damping(joint.damping));
            }
            if joint.friction != 0.0 && is_rigid {
                push(Feature::Friction(joint.friction));
            }
            if joint.armature != 0.0 && is_rigid {
                push(Feature::Armature(joint.armature));
            }
            if let Some(mimic) = &joint.mimic
                && model.followed(id).is_none()
            {
                push(Feature::Mimic(mimic.body.clone()));
            }
        }
        list
    }
}

impl fmt::Display for NotSimulated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "not simulated: joint of `{}`: ", self.body)?;
        match &self.feature {
            Feature::Limits => write!(f, "limits"),
            Feature::Velocity(value) => write!(f, "velocity limit {value}"),
            Feature::Armature(value) => write!(f, "armature {value}"),
            Feature::Damping(value) => write!(f, "damping {value}"),
            Feature::Friction(value) => write!(f, "friction {value}"),
            Feature::Mimic(body) => write!(f, "mimic of the joint of `{body}`"),
        }
    }
}
