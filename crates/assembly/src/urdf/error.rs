//! What can be wrong with a URDF file, and where.

use crate::xml::{XmlError, XmlProblem};
use crate::{Location, ModelError};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a URDF file was refused: where, and what is wrong there.
#[derive(Debug, Error)]
#[error("{location}: {problem}")]
pub struct UrdfError {
    /// Where in which file.
    pub location: Location,
    /// What is wrong, and the remedy.
    pub problem: Problem,
}

/// What is wrong with a URDF file. Every message names the culprit and the remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file cannot be opened or is not UTF-8 text.
    #[error("cannot be read: {0}")]
    Unreadable(std::io::Error),
    /// The text, an element or an attribute is not what it should be: see the inner error.
    #[error(transparent)]
    Xml(XmlProblem),
    /// The document is something else.
    #[error(
        "the document is not URDF, whose root element is <robot>{}",
        looks_like.map(|format| format!("; it looks like {format}, so convert it first")).unwrap_or_default()
    )]
    NotRobot {
        /// The format it looks like, where it is a known one.
        looks_like: Option<&'static str>,
    },
    /// A shape of negative size.
    #[error("attribute `{attribute}` states the negative size {value} m")]
    NegativeSize {
        /// The attribute.
        attribute: &'static str,
        /// The size \[m\].
        value: f64,
    },
    /// Two links, or two joints, of one name.
    #[error("its name is taken already, on line {first_line}; rename one of them")]
    DuplicateName {
        /// Line of the first, from 1.
        first_line: u32,
    },
    /// A joint that names a link which is not in the file.
    #[error("names the link `{link}`, which the file does not have; add it or correct the name")]
    UnknownLink {
        /// The missing link.
        link: String,
    },
    /// A joint of a type that cannot be modelled.
    #[error(
        "joints of type `{kind}` are not supported; use revolute, continuous, prismatic, planar, fixed or floating ones (several, with massless links between, make a compound joint)"
    )]
    UnsupportedJoint {
        /// The type.
        kind: String,
    },
    /// A joint that mimics itself.
    #[error("makes the joint mimic itself; name the joint that it is to follow")]
    SelfMimic,
    /// A robot without links.
    #[error("has no links; add at least two and a joint between them")]
    NoLinks,
    /// More than one link that no joint carries.
    #[error(
        "has {} links that no joint carries: {}; a robot has one root link, so attach the others or put them into files of their own",
        links.len(),
        listed(links)
    )]
    SeveralRoots {
        /// The links.
        links: Vec<String>,
    },
    /// A link that two joints carry.
    #[error(
        "carries the link `{link}`, which the joint `{other}` on line {other_line} carries already; URDF has no closed loops, so remove one of the joints"
    )]
    TwoParents {
        /// The link.
        link: String,
        /// The first joint that carries it.
        other: String,
        /// The first joint's line, from 1.
        other_line: u32,
    },
    /// Joints that carry each other.
    #[error(
        "the links {} carry each other in a circle; one of them must hang from the root link instead",
        listed(links)
    )]
    Cycle {
        /// The links on the circle, each carried by the one before.
        links: Vec<String>,
    },
    /// A fixed base and fixed joints only.
    #[error(
        "no link moves: all joints are fixed; make one movable, let the base float, or keep fixed joints"
    )]
    NothingMoves,
    /// A base that is to float and has no mass.
    #[error(
        "is to float, but neither it nor what is fixed to it has mass; give it mass or read the file with a fixed base"
    )]
    MasslessBase,
    /// The model cannot be: see the inner error.
    #[error(transparent)]
    Model(ModelError),
    /// A mesh file that is nowhere to be found.
    #[error(
        "the mesh file `{file}` was not found; looked for {}; add the folder that holds it to the search paths",
        looked_for(looked)
    )]
    MeshNotFound {
        /// The file name as the URDF states it.
        file: String,
        /// Every path tried.
        looked: Vec<PathBuf>,
    },
    /// A mesh at an address that is not a file.
    #[error(
        "the mesh `{file}` is neither a package://, model:// or file:// address nor a path; download it and state its path"
    )]
    MeshAddress {
        /// The address.
        file: String,
    },
}

impl UrdfError {
    /// An error at a place.
    pub(super) const fn at(location: Location, problem: Problem) -> Self {
        Self { location, problem }
    }

    /// The same error with its file.
    pub(super) fn in_file(mut self, file: &Path) -> Self {
        self.location.file = Some(file.to_owned());
        self
    }
}

impl From<XmlError> for UrdfError {
    fn from(error: XmlError) -> Self {
        Self {
            location: error.location,
            problem: Problem::Xml(error.problem),
        }
    }
}

/// Names in backquotes, ten at most.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 10;
    let mut text = names
        .iter()
        .take(SHOWN)
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ");
    if names.len() > SHOWN {
        text += &format!(" and {} more", names.len() - SHOWN);
    }
    text
}

fn looked_for(paths: &[PathBuf]) -> String {
    if paths.is_empty() {
        return "nowhere, as text without a file has no folder".to_owned();
    }
    let paths: Vec<_> = paths
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    paths.join(", ")
}
