//! What can be wrong with a file, and where.

use std::path::Path;
use thiserror::Error;
#[cfg(any(feature = "mjcf", feature = "sdf"))]
use vertebra_assembly::xml::{XmlError, XmlProblem};
use vertebra_assembly::{Ignored, Location, ModelError, SolidError};
#[cfg(any(feature = "mjcf", feature = "sdf"))]
use vertebra_assembly::{
    spelling,
    xml::{Node, Reader},
};

/// Why a file was refused: where, and what is wrong there.
#[derive(Debug, Error)]
#[error("{location}: {problem}")]
pub struct FileError {
    /// Where in which file.
    pub location: Location,
    /// What is wrong, and the remedy.
    pub problem: Problem,
}

/// What is wrong with a file. Every message names the culprit and the remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file cannot be opened or is not UTF-8 text.
    #[error("cannot be read: {0}")]
    Unreadable(std::io::Error),
    /// The text, an element or an attribute is not what it should be: see the inner error.
    #[cfg(any(feature = "mjcf", feature = "sdf"))]
    #[error(transparent)]
    Xml(XmlProblem),
    /// The document is something else.
    #[error("the document is not {format}, whose root element is <{expected}>, but has <{found}>")]
    WrongRoot {
        /// The format.
        format: &'static str,
        /// Its root element.
        expected: &'static str,
        /// The root element found.
        found: String,
    },
    /// An element that stands for others, which its own program puts in when it loads the file.
    #[error(
        "is expanded by {program} when it loads the file; let it save the expanded file and read that"
    )]
    NotExpanded {
        /// The program that expands it.
        program: &'static str,
    },
    /// A word that is none of those the format has here.
    #[error("`{found}` in `{attribute}` is not supported; use {supported}")]
    UnknownValue {
        /// The attribute or element.
        attribute: &'static str,
        /// The word.
        found: String,
        /// What may stand there.
        supported: &'static str,
    },
    /// A name that nothing in the file has.
    #[error(
        "names the {what} `{name}`, which the file does not have{}; add it or correct the name",
        meant.as_ref().map(|name| format!(" (is `{name}` meant?)")).unwrap_or_default()
    )]
    UnknownName {
        /// What kind of thing it should be.
        what: &'static str,
        /// The name.
        name: String,
        /// One that the file has and that is spelt nearly alike.
        meant: Option<Box<str>>,
    },
    /// Two of one name.
    #[error("its name is taken already, on line {first_line}; rename one of them")]
    DuplicateName {
        /// Line of the first, from 1.
        first_line: u32,
    },
    /// A number outside its range.
    #[error("{quantity} is {value}, but must be {requirement}")]
    OutOfRange {
        /// Which number.
        quantity: &'static str,
        /// The number.
        value: f64,
        /// What it must be.
        requirement: &'static str,
    },
    /// A mass that would have to be computed from triangles in another file.
    #[error(
        "has the mass of the mesh `{mesh}`, whose triangles are in a file of its own; state the mass and inertia of the body in <inertial>"
    )]
    MeshMass {
        /// The mesh.
        mesh: String,
    },
    /// A shape that encloses no volume.
    #[error("its mass cannot be found: {0}")]
    Solid(SolidError),
    /// Two statements of which only one can hold.
    #[error("{first} and {second} contradict each other; keep one")]
    Contradiction {
        /// One statement.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// Something that the format allows only elsewhere.
    #[error("may stand in {place} only")]
    Misplaced {
        /// Where it may stand.
        place: &'static str,
    },
    /// Placements or parents that refer to each other in a circle.
    #[error("refers to itself by way of {}; break the circle", path.join(", "))]
    Cycle {
        /// The names on the circle.
        path: Vec<String>,
    },
    /// Text of a line-based format that is not what must stand here.
    #[error("found {found} where {expected} must stand")]
    Syntax {
        /// What must stand here.
        expected: &'static str,
        /// What stands here.
        found: String,
    },
    /// A table that lacks a column.
    #[error("has no column `{column}`; write the file with it")]
    MissingColumn {
        /// The column.
        column: &'static str,
    },
    /// A table whose last row ends early, or that has no row.
    #[error(
        "has {found} values, but the table has {columns} columns; complete the row or remove it"
    )]
    IncompleteRow {
        /// How many columns the table has.
        columns: usize,
        /// How many values the row has.
        found: usize,
    },
    /// A frame of a motion with another number of values than its skeleton has channels.
    #[error(
        "has {found} numbers, but the joints have {channels} channels; write each frame on a line of its own, with a number for each of them"
    )]
    FrameLength {
        /// How many channels the joints have in all.
        channels: usize,
        /// How many numbers the line has.
        found: usize,
    },
    /// A motion with another number of frames than it states.
    #[error(
        "states {stated} frames, but {found} follow; correct the number or add what is missing"
    )]
    FrameCount {
        /// How many are stated.
        stated: usize,
        /// How many there are.
        found: usize,
    },
    /// Elements nested deeper than any model is.
    #[error("is nested deeper than {limit} levels; flatten it")]
    TooDeep {
        /// The most levels.
        limit: usize,
    },
    /// Atoms or points that lie where no torsion angle can be told.
    #[error("{reason}; {remedy}")]
    Degenerate {
        /// What is wrong with the places.
        reason: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// What another crate's parser says.
    #[error("{reason}: {detail}")]
    Refused {
        /// In a few words.
        reason: String,
        /// At length.
        detail: String,
    },
    /// A file in which nothing can move.
    #[error("{0}")]
    Empty(&'static str),
    /// The model cannot be: see the inner error.
    #[error(transparent)]
    Model(ModelError),
    /// A problem that an element or attribute which nothing reads may be the cause of.
    #[error("{problem}; {slip}")]
    AfterSlip {
        /// What is wrong.
        problem: Box<Self>,
        /// The element or attribute, whose name is nearly spelt like one that is read.
        slip: Box<Ignored>,
    },
}

#[cfg(any(feature = "mjcf", feature = "sdf"))]
impl Problem {
    /// A name that nothing has, beside those that there are.
    pub(crate) fn unknown<'k>(
        what: &'static str,
        name: &str,
        known: impl IntoIterator<Item = &'k str>,
    ) -> Self {
        Self::UnknownName {
            what,
            name: name.to_owned(),
            meant: spelling::nearest(name, known.into_iter()).map(Box::from),
        }
    }
}

impl FileError {
    pub(crate) const fn new(location: Location, problem: Problem) -> Self {
        Self { location, problem }
    }

    /// An error on a line of text, from 1; 0 where the whole text is meant.
    pub(crate) fn on_line(line: usize, element: impl Into<String>, problem: Problem) -> Self {
        let location = Location {
            file: None,
            line: u32::try_from(line).ok().filter(|&line| line > 0),
            element: element.into(),
        };
        Self::new(location, problem)
    }

    /// The same error beside a slip in a name which may be the cause of it: of an attribute of the element that
    /// it speaks of, of an element in that or in the body that it speaks of, or, where the whole file moves
    /// nothing, of any element.
    #[cfg(any(feature = "mjcf", feature = "sdf"))]
    pub(crate) fn after_slip(self, reader: &Reader<'_>, root: Node<'_, '_>) -> Self {
        let Self { location, problem } = self;
        let is_of_all = matches!(problem, Problem::Empty(_)) && location == reader.location(root);
        let body = match &problem {
            Problem::Model(error) => error.culprit().map(|name| format!("body `{name}`")),
            _ => None,
        };
        let is_cause = |slip: &&Ignored| {
            let is_here = slip.owner == location.element;
            match slip.is_attribute {
                true => is_here && Some(slip.line) == location.line,
                false => is_here || is_of_all || Some(&slip.owner) == body.as_ref(),
            }
        };
        let problem = match reader.slips().find(is_cause) {
            Some(slip) => Problem::AfterSlip {
                problem: Box::new(problem),
                slip: Box::new(slip.clone()),
            },
            None => problem,
        };
        Self { location, problem }
    }

    /// The same error with its file.
    pub(crate) fn in_file(mut self, file: &Path) -> Self {
        self.location.file = Some(file.to_owned());
        self
    }
}

#[cfg(any(feature = "mjcf", feature = "sdf"))]
impl From<XmlError> for FileError {
    fn from(error: XmlError) -> Self {
        Self::new(error.location, Problem::Xml(error.problem))
    }
}
