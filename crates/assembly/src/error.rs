//! What can be wrong with a model or a state.

use crate::SolidError;
use thiserror::Error;

/// Why a model or a state was refused. Every message names the culprit and the remedy.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A model without bodies.
    #[error("the model `{model}` has no bodies; add at least one")]
    Empty {
        /// Name of the model.
        model: String,
    },
    /// More bodies or coordinates than indices can count.
    #[error("{requested} {what} were asked for; at most {limit} fit: split the model into several")]
    TooLarge {
        /// What was counted.
        what: &'static str,
        /// How many were asked for.
        requested: usize,
        /// How many are possible.
        limit: usize,
    },
    /// A serialised model or state of another format version.
    #[error("{what} has format version {found}, this library reads version {supported}")]
    UnsupportedVersion {
        /// "model" or "state".
        what: &'static str,
        /// Version in the data.
        found: u32,
        /// Version understood.
        supported: u32,
    },
    /// A body or frame without a name.
    #[error("{what} number {index} has an empty name; give it one")]
    EmptyName {
        /// "body" or "frame".
        what: &'static str,
        /// Index in the description, from 0.
        index: usize,
    },
    /// Two bodies or frames of one name.
    #[error(
        "the name `{name}` is used twice; names of bodies and frames must be unique in a model, and those of loops and couplings"
    )]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// A parent that is not in the model.
    #[error(
        "body `{body}` names the parent `{parent}`, which is not a body of the model{}; add it or correct the name",
        hint(.meant.as_deref())
    )]
    UnknownParent {
        /// The body.
        body: Box<str>,
        /// Its missing parent.
        parent: Box<str>,
        /// A body that is nearly spelt like it.
        meant: Option<Box<str>>,
    },
    /// A frame or coupling that refers to a body outside the model.
    #[error(
        "`{user}` refers to `{body}`, which is not a body of the model{}; add it or correct the name",
        hint(.meant.as_deref())
    )]
    UnknownBody {
        /// Who refers to it.
        user: Box<str>,
        /// The missing body.
        body: Box<str>,
        /// A body that is nearly spelt like it.
        meant: Option<Box<str>>,
    },
    /// Bodies that are each other's ancestors.
    #[error(
        "body `{body}` is its own ancestor; the parents of a model must form trees, so close loops otherwise"
    )]
    Cycle {
        /// A body on the cycle.
        body: String,
    },
    /// NaN or infinity in a description.
    #[error("{quantity} of `{element}` is not finite ({value}); give a number")]
    NonFinite {
        /// Which number.
        quantity: &'static str,
        /// Body, joint, frame or model it belongs to.
        element: String,
        /// The number.
        value: f64,
    },
    /// A joint axis without direction.
    #[error(
        "the joint of body `{body}`, or the loop of that name, has an axis of length zero; give it a direction"
    )]
    ZeroAxis {
        /// The body whose joint it is.
        body: String,
    },
    /// A placement whose quaternion is not of unit length.
    #[error("{quantity} of `{element}` has a quaternion of length {length}; normalise it")]
    NonUnitQuaternion {
        /// Which placement.
        quantity: &'static str,
        /// Body or frame it belongs to.
        element: String,
        /// Length of the quaternion.
        length: f64,
    },
    /// Negative mass.
    #[error("body `{body}` has the negative mass {mass} kg; give it mass, or zero for none")]
    NegativeMass {
        /// The body.
        body: String,
        /// Its mass \[kg\].
        mass: f64,
    },
    /// A number that no body in SI units has.
    #[error(
        "{quantity} of `{element}` is {value:e}, beyond 1e100 or below 1e-100: state it in SI units"
    )]
    AbsurdSize {
        /// Which number.
        quantity: &'static str,
        /// Body, frame or model it belongs to.
        element: String,
        /// The number.
        value: f64,
    },
    /// A joint range without a position in it.
    #[error(
        "the joint of body `{body}` has the lower position limit {lower} above the upper one {upper}; exchange or correct them"
    )]
    EmptyRange {
        /// The body whose joint it is.
        body: String,
        /// The lower limit [rad or m].
        lower: f64,
        /// The upper limit [rad or m].
        upper: f64,
    },
    /// A limit, damping or friction below zero.
    #[error(
        "{quantity} of body `{body}` is {value}, which must not be negative; correct its sign, or leave it out"
    )]
    Negative {
        /// Which number.
        quantity: &'static str,
        /// The body whose joint it is.
        body: String,
        /// The number.
        value: f64,
    },
    /// A spring whose rest is no position of its joint.
    #[error(
        "the spring in the joint of body `{body}` has a rest that is no position of this joint: a joint of one freedom takes a number (`Spring::at`), a spherical one an orientation (`Spring::turned`), others none"
    )]
    UnsuitedSpring {
        /// The body whose joint it is.
        body: String,
    },
    /// A range of a spherical joint that it cannot have.
    #[error("the range of orientations of the joint of body `{body}` is impossible: {reason}")]
    BadBallRange {
        /// The body whose joint it is.
        body: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A range of one position in a joint of three freedoms.
    #[error(
        "the joint of body `{body}` is spherical, and no one position of it can be kept in a range; give it a range of orientations (`with_ball_range`)"
    )]
    UnsuitedRange {
        /// The body whose joint it is.
        body: String,
    },
    /// A number outside its range.
    #[error("{quantity} of `{element}` is {value}, which must be {requirement}")]
    OutOfRange {
        /// Which number.
        quantity: &'static str,
        /// Body or loop it belongs to.
        element: Box<str>,
        /// The number.
        value: f64,
        /// What it must be.
        requirement: &'static str,
    },
    /// A body made of an impossible solid.
    #[error("body `{body}`: {source}")]
    BodyShape {
        /// The body.
        body: String,
        /// Why.
        source: Box<SolidError>,
    },
    /// An inertia matrix that is not symmetric.
    #[error(
        "the inertia of body `{body}` is not symmetric; give the matrix about the centre of mass"
    )]
    AsymmetricInertia {
        /// The body.
        body: String,
    },
    /// An inertia that no distribution of mass has.
    #[error(
        "the inertia of body `{body}` is impossible: {reason}; check its products of inertia and units"
    )]
    NonPhysicalInertia {
        /// The body.
        body: String,
        /// What it violates.
        reason: InertiaViolation,
    },
    /// A movable body whose joint moves no inertia, or none but what a further joint of the same
    /// motion lets go.
    #[error(
        "the joint of body `{body}` moves no inertia{}: give the body mass and inertia, attach a body with mass by a joint of another motion, or fix the joint",
        same_motion(.undone.as_deref())
    )]
    MasslessBody {
        /// The body.
        body: String,
        /// A body beyond it whose joint lets the same motion go.
        undone: Option<Box<str>>,
    },
    /// A loop between a body and itself or the world and itself, or a joint coupled to itself.
    #[error(
        "`{name}` connects a body to itself, or the world; name two bodies, or one and the world"
    )]
    SelfLoop {
        /// The loop or coupling.
        name: String,
    },
    /// A coupling of a joint that has not exactly one freedom.
    #[error(
        "`{name}` couples the joint of body `{body}`, which has {freedoms} freedoms; couple joints of one freedom"
    )]
    CoupledFreedoms {
        /// The coupling.
        name: String,
        /// The body whose joint it is.
        body: String,
        /// Freedoms of that joint.
        freedoms: usize,
    },
    /// A body that is not in the model, or no longer.
    #[error(
        "neither the model `{model}` nor its edit has a body number {body}, or it was removed; take ids from the model itself, or from `Edit::add`"
    )]
    NoSuchBody {
        /// Name of the model.
        model: String,
        /// Index of the body.
        body: usize,
    },
    /// A loop or coupling that is not in the model, or no longer.
    #[error(
        "the model `{model}` has no loop or coupling `{name}`, or it was taken away; take names from the model itself"
    )]
    NoSuchLoop {
        /// Name of the model.
        model: String,
        /// The name.
        name: String,
    },
    /// A loop to be closed where its frames coincide, by a joint in which they cannot.
    #[error(
        "`{name}` cannot be closed where both its frames coincide: a distance keeps two places apart, and a universal joint its axes perpendicular; give each frame its own placement (`Edit::close`)"
    )]
    NotThere {
        /// The loop.
        name: String,
    },
    /// An array of the wrong length.
    #[error("{quantity} has {found} entries, the model needs {expected}")]
    WrongLength {
        /// Which array.
        quantity: &'static str,
        /// Length it must have.
        expected: usize,
        /// Length it has.
        found: usize,
    },
    /// A parameter of a generator or builder outside its range.
    #[error("{parameter} must be {requirement}")]
    BadParameter {
        /// Which parameter.
        parameter: &'static str,
        /// What it must be.
        requirement: &'static str,
    },
}

impl ModelError {
    /// The body or frame that the error speaks of.
    #[must_use]
    pub fn culprit(&self) -> Option<&str> {
        self.element().0
    }

    /// Whether it speaks of the joint that carries the culprit.
    #[must_use]
    pub fn is_of_joint(&self) -> bool {
        self.element().1
    }

    fn element(&self) -> (Option<&str>, bool) {
        match self {
            Self::ZeroAxis { body }
            | Self::MasslessBody { body, .. }
            | Self::UnsuitedRange { body }
            | Self::EmptyRange { body, .. }
            | Self::UnsuitedSpring { body }
            | Self::BadBallRange { body, .. }
            | Self::Negative { body, .. } => (Some(body), true),
            Self::NonFinite {
                quantity, element, ..
            }
            | Self::NonUnitQuaternion {
                quantity, element, ..
            }
            | Self::AbsurdSize {
                quantity, element, ..
            } => (Some(element), quantity.starts_with("joint")),
            Self::OutOfRange {
                quantity, element, ..
            } => (Some(element), quantity.starts_with("joint")),
            Self::UnknownParent { body, .. } | Self::UnknownBody { user: body, .. } => {
                (Some(body), false)
            }
            Self::Cycle { body }
            | Self::BodyShape { body, .. }
            | Self::NegativeMass { body, .. }
            | Self::AsymmetricInertia { body }
            | Self::NonPhysicalInertia { body, .. }
            | Self::SelfLoop { name: body }
            | Self::CoupledFreedoms { name: body, .. }
            | Self::NoSuchLoop { name: body, .. }
            | Self::NotThere { name: body }
            | Self::DuplicateName { name: body } => (Some(body), false),
            Self::Empty { .. }
            | Self::TooLarge { .. }
            | Self::UnsupportedVersion { .. }
            | Self::EmptyName { .. }
            | Self::WrongLength { .. }
            | Self::NoSuchBody { .. }
            | Self::BadParameter { .. } => (None, false),
        }
    }
}

/// What an impossible inertia violates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum InertiaViolation {
    /// A principal moment is negative.
    NotPositiveSemidefinite,
    /// One principal moment exceeds the sum of the other two.
    TriangleInequality,
}

impl core::fmt::Display for InertiaViolation {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotPositiveSemidefinite => "a principal moment is negative",
            Self::TriangleInequality => "one principal moment exceeds the sum of the other two",
        })
    }
}

/// Why a body beyond a joint gives that joint nothing to move.
fn same_motion(undone: Option<&str>) -> String {
    undone.map_or_else(String::new, |by| {
        format!(
            ", as that of body `{by}` beyond it lets the same motion go (parallel axes, or it turns or moves freely)"
        )
    })
}

/// What may have been meant by an unknown name.
pub(crate) fn hint(meant: Option<&str>) -> String {
    meant.map_or_else(String::new, |name| format!(" (is `{name}` meant?)"))
}
