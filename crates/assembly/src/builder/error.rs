//! All that is wrong with a model in the making.

use super::SolidError;
use crate::ModelError;
use crate::error::hint;
use core::fmt;
use thiserror::Error;

/// Every problem of a model that was not built; printed, a list.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub struct BuildError {
    /// Name of the model.
    pub model: String,
    /// What is wrong with it, at least one thing.
    pub problems: Vec<Problem>,
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.problems.len();
        let plural = if count == 1 { "" } else { "s" };
        write!(f, "the model `{}` has {count} problem{plural}:", self.model)?;
        for problem in &self.problems {
            write!(f, "\n- {problem}")?;
        }
        Ok(())
    }
}

/// One thing that is wrong, and what to do.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Problem {
    /// What no model can have.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A body made of an impossible solid.
    #[error("body `{body}`: {source}")]
    BodyShape {
        /// The body.
        body: String,
        /// Why.
        source: SolidError,
    },
    /// A body to go to that was not added before.
    #[error(
        "there is no body `{body}` to go to{}; add it first, or correct the name",
        hint(.meant.as_deref())
    )]
    UnknownBody {
        /// The name.
        body: Box<str>,
        /// A body that is nearly spelt like it.
        meant: Option<Box<str>>,
    },
    /// Something said of the body here, where there is none.
    #[error(
        "nothing is here to {verb}: the builder stands in the world; add a body first, or go to one"
    )]
    InTheWorld {
        /// What was asked for.
        verb: &'static str,
    },
    /// A chain without links.
    #[error("the chain `{name}` has no links; ask for at least one")]
    NoLinks {
        /// Name of the chain.
        name: String,
    },
    /// A helix of links without length, or of no shape.
    #[error(
        "the {what} of the helix `{name}` is {value}; give a length above zero and finite angles"
    )]
    BadHelix {
        /// Name of the helix.
        name: String,
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A strand along a curve that has no length, or turns back within a link, or without links.
    #[error(
        "the strand `{name}` has links of no length; give a curve of finite length and at least one link, none of which ends where it starts"
    )]
    NoStrand {
        /// Name of the strand.
        name: String,
    },
    /// A mirror whose plane has no normal.
    #[error("the mirror image `{prefix}` has a plane without normal; give it a direction")]
    NoPlane {
        /// Prefix of the mirror image.
        prefix: String,
    },
    /// Two joints of one name.
    #[error("the joint name `{name}` is used twice; give each joint its own")]
    DuplicateJoint {
        /// The name.
        name: String,
    },
}
