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
    /// The joint moves through its limits.
    Limits,
    /// Damping [N m s/rad or N s/m].
    Damping(f64),
    /// Static friction [N m or N].
    Friction(f64),
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
            if joint.limits.is_some() {
                push(Feature::Limits);
            }
            if joint.damping != 0.0 {
                push(Feature::Damping(joint.damping));
            }
            if joint.friction != 0.0 {
                push(Feature::Friction(joint.friction));
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
            Feature::Damping(value) => write!(f, "damping {value}"),
            Feature::Friction(value) => write!(f, "friction {value}"),
            Feature::Mimic(body) => write!(f, "mimic of the joint of `{body}`"),
        }
    }
}
