//! What can be wrong with XML text, and where.

use crate::Location;
use thiserror::Error;

/// What is wrong with an XML element or text, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{location}: {problem}")]
pub struct XmlError {
    /// Where in which file.
    pub location: Location,
    /// What is wrong, and the remedy.
    pub problem: XmlProblem,
}

/// What is wrong with XML text. Every message names the culprit and the remedy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum XmlProblem {
    /// The text is not well-formed XML.
    #[error("is not well-formed XML: {reason}")]
    NotXml {
        /// The parser's complaint, with its position.
        reason: String,
    },
    /// The text declares entities, which models do not need and which can be made to explode.
    #[error("declares a document type (<!DOCTYPE>), which is not read; remove the declaration")]
    DocumentType,
    /// A xacro macro, or an expression of one.
    #[error("`{found}` is unexpanded xacro; run xacro over the file first and read its output")]
    Unexpanded {
        /// The element or expression.
        found: String,
    },
    /// An attribute that must be there is missing or empty.
    #[error("has no attribute `{attribute}`, or an empty one; state it")]
    MissingAttribute {
        /// The attribute.
        attribute: &'static str,
    },
    /// An element that must be there is missing.
    #[error("has no <{child}>; add one")]
    MissingElement {
        /// The element, or the choice of elements.
        child: &'static str,
    },
    /// An element that may stand once stands twice.
    #[error("stands a second time; keep one")]
    Repeated,
    /// Text that is no number.
    #[error("`{text}` in attribute `{attribute}` is not a number")]
    NotANumber {
        /// The attribute.
        attribute: &'static str,
        /// The text.
        text: String,
    },
    /// NaN, infinity, or a number too large to be represented.
    #[error("`{text}` in attribute `{attribute}` is not finite; state a number")]
    NonFinite {
        /// The attribute.
        attribute: &'static str,
        /// The text.
        text: String,
    },
    /// A list of numbers of the wrong length.
    #[error("attribute `{attribute}` has {found} numbers; it needs {expected}")]
    WrongCount {
        /// The attribute.
        attribute: &'static str,
        /// How many it must have.
        expected: usize,
        /// How many it has.
        found: usize,
    },
    /// Numbers that state no rotation: a quaternion or an axis of length zero.
    #[error(
        "attribute `{attribute}` states no rotation, for its length is zero; give it a direction"
    )]
    NoRotation {
        /// The attribute.
        attribute: &'static str,
    },
}
