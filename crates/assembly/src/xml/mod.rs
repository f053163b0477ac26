//! XML models: elements with the line of everything that is wrong or has no effect.
//!
//! What the importers of URDF, MJCF and SDF share. A [`Reader`] walks one document; everything it
//! refuses is an [`XmlError`] with line and element, and everything it passes over an [`Ignored`](crate::Ignored).

mod error;
mod reader;

pub use error::{XmlError, XmlProblem};
#[cfg(feature = "urdf")]
pub(crate) use reader::EXTENSION;
pub use reader::{Reader, from_roll_pitch_yaw};
pub use roxmltree::{Document, Node};

use crate::Location;

/// Parses XML text. Document types are refused: entities can be made to explode.
///
/// # Errors
/// [`XmlProblem::NotXml`], [`XmlProblem::DocumentType`] or [`XmlProblem::Unexpanded`].
pub fn document(text: &str) -> Result<Document<'_>, XmlError> {
    Document::parse(text).map_err(refuse_xml)
}

fn refuse_xml(error: roxmltree::Error) -> XmlError {
    let problem = match &error {
        roxmltree::Error::DtdDetected => XmlProblem::DocumentType,
        // A file whose macros were never expanded need not declare their prefix.
        roxmltree::Error::UnknownNamespace(prefix, _) if prefix == "xacro" => {
            XmlProblem::Unexpanded {
                found: "<xacro:...>".to_owned(),
            }
        }
        _ => XmlProblem::NotXml {
            reason: error.to_string(),
        },
    };
    // The parser says line 1 of what concerns the whole text.
    let line = match error {
        roxmltree::Error::DtdDetected
        | roxmltree::Error::NoRootNode
        | roxmltree::Error::UnclosedRootNode
        | roxmltree::Error::NodesLimitReached
        | roxmltree::Error::AttributesLimitReached
        | roxmltree::Error::NamespacesLimitReached => None,
        _ => Some(error.pos().row),
    };
    XmlError {
        location: Location {
            file: None,
            line,
            element: "the text".to_owned(),
        },
        problem,
    }
}
