//! Plain data from which a [`Model`] is built, and into which it is saved.

use crate::{
    Compound, CouplingDescription, Joint, LoopDescription, MassProperties, Model, ModelError,
    massless, validate,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use validate::Checked;
use vertebra_spatial::Pose;

/// Format version written, and the only one read.
pub(crate) const MODEL_VERSION: u32 = 1;

/// Standard gravity along -z [m/s^2], as the reference data of this field uses it.
pub(crate) const STANDARD_GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// A model as written down: bodies in any order, parents by name. [`build`](Self::build) checks it.
///
/// ```
/// use glam::DVec3;
/// use vertebra_assembly::{Joint, MassProperties, ModelDescription};
/// use vertebra_spatial::Pose;
///
/// let rod = MassProperties::rod(1.0, 0.5, 0.01);
/// let elbow = Pose::from_translation(DVec3::new(0.0, 0.0, 0.5));
/// let model = ModelDescription::new("arm")
///     .body("upper", None, Joint::spherical(), rod)
///     .body("lower", Some("upper"), Joint::revolute(DVec3::Y).at(elbow), rod)
///     .build()?;
/// assert_eq!(model.dof_count(), 4);
/// # Ok::<(), vertebra_assembly::ModelError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelDescription {
    /// Format version.
    pub version: u32,
    /// Name of the model.
    pub name: String,
    /// Gravity in world axes [m/s^2].
    pub gravity: DVec3,
    /// The bodies, in any order.
    pub bodies: Vec<BodyDescription>,
    /// Named places on bodies or in the world.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<FrameDescription>,
    /// Loops closed by further joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loops: Vec<LoopDescription>,
    /// Joints coupled to others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub couplings: Vec<CouplingDescription>,
}

/// One body and the joint that carries it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyDescription {
    /// Name, unique in the model.
    pub name: String,
    /// Name of the parent body; none for the world.
    pub parent: Option<String>,
    /// The joint to the parent.
    pub joint: Joint,
    /// Mass properties in the body's frame.
    pub mass: MassProperties,
}

/// A named place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameDescription {
    /// Name, unique among bodies and frames.
    pub name: String,
    /// Name of the body it is fixed to; none for the world.
    pub body: Option<String>,
    /// Where it is in that body's frame.
    pub placement: Pose,
}

impl ModelDescription {
    /// An empty model under standard gravity, 9.81 m/s^2 along -z.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            version: MODEL_VERSION,
            name: name.into(),
            gravity: STANDARD_GRAVITY,
            bodies: Vec::new(),
            frames: Vec::new(),
            loops: Vec::new(),
            couplings: Vec::new(),
        }
    }

    /// Sets gravity, in world axes [m/s^2].
    #[must_use]
    pub const fn gravity(mut self, gravity: DVec3) -> Self {
        self.gravity = gravity;
        self
    }

    /// Adds a body; `parent` is the name of another body, or none for the world. A [`Compound`] joint
    /// adds bodies without mass before it.
    #[must_use]
    pub fn body(
        mut self,
        name: impl Into<String>,
        parent: Option<&str>,
        joint: impl Into<Compound>,
        mass: MassProperties,
    ) -> Self {
        let bodies = joint.into().bodies(name.into(), parent, mass);
        self.bodies.extend(bodies);
        self
    }

    /// Adds a named place on a body, or in the world.
    #[must_use]
    pub fn frame(mut self, name: impl Into<String>, body: Option<&str>, placement: Pose) -> Self {
        self.frames.push(FrameDescription {
            name: name.into(),
            body: body.map(str::to_owned),
            placement,
        });
        self
    }

    /// Everything that is wrong, at once, each with a remedy: of each number, vector and placement the first
    /// thing. Joints that move no inertia are looked for once the bodies, their joints and parents are right, whatever
    /// else is wrong. Empty for a description that [`build`](Self::build) makes a model.
    #[must_use]
    pub fn problems(&self) -> Vec<ModelError> {
        let Checked {
            order,
            are_bodies_sound,
            mut problems,
        } = validate::check_all(self);
        if are_bodies_sound {
            let bodies = Self {
                bodies: self.bodies.clone(),
                ..Self::new(&self.name)
            };
            problems.extend(massless::problems(&Model::unchecked(bodies, order)));
        }
        problems
    }

    /// Checks the description and makes it a model.
    ///
    /// Bodies keep their order where every parent stands before its children; others are moved
    /// behind their parents.
    ///
    /// # Errors
    /// The first of the [`problems`](Self::problems), naming the element that is wrong and what to do.
    pub fn build(self) -> Result<Model, ModelError> {
        Model::try_from(self)
    }
}
