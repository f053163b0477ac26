//! Places in files, and what stands there without effect.

use core::fmt;
use std::path::PathBuf;

/// A place in a file. Displays as `file:line: element`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// The file; none for text that came from elsewhere.
    pub file: Option<PathBuf>,
    /// Line, from 1; none where the whole file is meant.
    pub line: Option<u32>,
    /// The element, such as ``<limit> of joint `elbow` ``.
    pub element: String,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, self.line) {
            (Some(file), Some(line)) => write!(f, "{}:{line}: ", file.display())?,
            (Some(file), None) => write!(f, "{}: ", file.display())?,
            (None, Some(line)) => write!(f, "line {line}: ")?,
            (None, None) => {}
        }
        f.write_str(&self.element)
    }
}

/// An element or attribute of a file that has no effect on the model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ignored {
    /// Name of the element, such as `transmission`, or of the attribute, such as `solref`.
    pub element: String,
    /// What it stands in, such as ``joint `elbow` ``.
    pub owner: String,
    /// Its line, from 1.
    pub line: u32,
    /// Whether it is an attribute.
    pub is_attribute: bool,
    /// Why, or what may be meant, where more is known than that nothing reads it.
    pub why: Option<String>,
}

impl fmt::Display for Ignored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            element,
            owner,
            line,
            is_attribute,
            why,
        } = self;
        match is_attribute {
            true => write!(f, "line {line}: `{element}` of {owner} has no effect")?,
            false => write!(f, "line {line}: <{element}> of {owner} has no effect")?,
        }
        match why {
            Some(why) => write!(f, ": {why}"),
            None => Ok(()),
        }
    }
}
