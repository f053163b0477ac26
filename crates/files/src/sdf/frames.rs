//! Where everything is: poses relative to one another, resolved to the model's frame.

use super::values::Stated;
use crate::{FileError, Problem};
use std::collections::HashMap;
use vertebra_assembly::Location;
use vertebra_spatial::Pose;

/// Names of the model's own frame, and of the world's.
pub(super) const MODEL: &str = "__model__";
pub(super) const WORLD: &str = "world";

/// A named frame as it is stated.
struct Stake<'n> {
    name: &'n str,
    pose: Pose,
    relative_to: Option<usize>,
    /// What it moves with, if that is another frame.
    attached_to: Option<usize>,
    location: Location,
}

/// The frames of one model.
pub(super) struct Frames<'n> {
    stakes: Vec<Stake<'n>>,
    by_name: HashMap<&'n str, usize>,
}

/// A frame to be added: names are resolved when all are known.
pub(super) struct Statement<'n> {
    pub(super) name: &'n str,
    pub(super) stated: Stated<'n>,
    /// What it is relative to where it does not say.
    pub(super) usual: Option<&'n str>,
    pub(super) attached_to: Option<&'n str>,
    pub(super) location: Location,
}

impl<'n> Frames<'n> {
    pub(super) fn new(statements: Vec<Statement<'n>>) -> Result<Self, FileError> {
        let mut by_name = HashMap::new();
        for (index, statement) in statements.iter().enumerate() {
            if let Some(first) = by_name.insert(statement.name, index) {
                let first: &Statement<'n> = &statements[first];
                let problem = Problem::DuplicateName {
                    first_line: first.location.line.unwrap_or(0),
                };
                return Err(FileError::new(statement.location.clone(), problem));
            }
        }
        let find = |name: Option<&str>, location: &Location| match name {
            None | Some(MODEL) => Ok(None),
            Some(name) => match by_name.get(name) {
                Some(&index) => Ok(Some(index)),
                None => {
                    let problem = Problem::unknown("frame", name, by_name.keys().copied());
                    Err(FileError::new(location.clone(), problem))
                }
            },
        };
        let mut stakes = Vec::with_capacity(statements.len());
        for statement in statements {
            let name = statement.stated.relative_to.or(statement.usual);
            stakes.push(Stake {
                name: statement.name,
                pose: statement.stated.pose,
                relative_to: find(name, &statement.location)?,
                attached_to: find(statement.attached_to, &statement.location)?,
                location: statement.location,
            });
        }
        Ok(Self { stakes, by_name })
    }

    /// The pose of every frame in the model's, by index of the statements.
    pub(super) fn resolve(&self) -> Result<Vec<Pose>, FileError> {
        let mut known: Vec<Option<Pose>> = vec![None; self.stakes.len()];
        for start in 0..self.stakes.len() {
            // From the frame outwards to one that is known, then back.
            let mut path = Vec::new();
            let mut next = Some(start);
            while let Some(index) = next.filter(|&index| known[index].is_none()) {
                if path.len() == self.stakes.len() {
                    return Err(self.cycle(index, |stake| stake.relative_to));
                }
                path.push(index);
                next = self.stakes[index].relative_to;
            }
            let mut pose = next.and_then(|index| known[index]).unwrap_or_default();
            for index in path.into_iter().rev() {
                pose = pose * self.stakes[index].pose;
                known[index] = Some(pose);
            }
        }
        Ok(known.into_iter().flatten().collect())
    }

    /// The names of all frames.
    pub(super) fn names(&self) -> impl Iterator<Item = &'n str> {
        self.by_name.keys().copied()
    }

    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// The frame at the end of the attachments that start from one.
    pub(super) fn carrier(&self, frame: usize) -> Result<usize, FileError> {
        let mut index = frame;
        for _ in 0..=self.stakes.len() {
            match self.stakes[index].attached_to {
                Some(next) => index = next,
                None => return Ok(index),
            }
        }
        Err(self.cycle(index, |stake| stake.attached_to))
    }

    fn cycle(&self, on: usize, next: impl Fn(&Stake<'n>) -> Option<usize>) -> FileError {
        let mut path = Vec::new();
        let mut index = on;
        loop {
            path.push(format!("`{}`", self.stakes[index].name));
            match next(&self.stakes[index]) {
                Some(following) if following != on && path.len() < 10 => index = following,
                _ => break,
            }
        }
        FileError::new(self.stakes[on].location.clone(), Problem::Cycle { path })
    }
}
