//! Many pairs of meshes in one call: the links of a robot, in one or many configurations.

use std::borrow::Borrow;
use std::collections::BTreeSet;

use vertebra_spatial::Pose;

use crate::collider::Collider;
use crate::error::QueryError;
use crate::parallel;
use crate::query::Query;

/// Bodies that move against each other, and which pairs of them are of no interest.
///
/// A body is a [`Collider`], or whatever borrows as one: instances of one shape are references to it, or `Arc`s.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use vertebra_collision::{Collider, Links, TriangleMesh};
/// use vertebra_spatial::Pose;
///
/// let tile = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let tile = Collider::new(tile);
/// let bodies = [&tile; 3];
/// // Neighbours in the chain always touch.
/// let links = Links::new(&bodies).ignore(0, 1)?.ignore(1, 2)?;
/// assert_eq!(links.pairs(), [[0, 2]]);
/// let at = |z: [f64; 3]| z.map(|z| Pose::from_translation(DVec3::Z * z));
/// let configurations = [at([0.0, 1.0, 2.0]), at([0.0, 1.0, 0.0])];
/// let hits = links.ask(&configurations, |query| query.any())?;
/// assert_eq!(hits, [[false], [true]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct Links<'a, B = Collider> {
    bodies: &'a [B],
    ignored: BTreeSet<[usize; 2]>,
    threads: usize,
}

impl<'a, B: Borrow<Collider> + Sync> Links<'a, B> {
    /// All pairs of these bodies are of interest, and one thread works.
    pub fn new(bodies: &'a [B]) -> Self {
        Self {
            bodies,
            ignored: BTreeSet::new(),
            threads: 1,
        }
    }

    /// Leaves out the pair of two bodies.
    ///
    /// # Errors
    ///
    /// [`QueryError::NoSuchBody`]; [`QueryError::SameBody`] if the two are one.
    pub fn ignore(mut self, one: usize, other: usize) -> Result<Self, QueryError> {
        check_pair([one, other], self.bodies.len())?;
        self.ignored.insert([one.min(other), one.max(other)]);
        Ok(self)
    }

    /// Uses at most this many threads of the current rayon pool, each for one pair at a time; 0 uses all of them.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// The pairs of bodies that are not ignored, the lesser index first, in lexicographic order.
    #[must_use]
    pub fn pairs(&self) -> Vec<[usize; 2]> {
        let count = self.bodies.len();
        (0..count)
            .flat_map(|one| (one + 1..count).map(move |other| [one, other]))
            .filter(|pair| !self.ignored.contains(pair))
            .collect()
    }

    /// Asks about every pair in every configuration, which is a pose of each body in the world: for each configuration
    /// the answers in the order of [`pairs`](Self::pairs).
    ///
    /// The question is any that a [`Query`] answers, about the first body of the pair and the second.
    ///
    /// # Errors
    ///
    /// [`QueryError::PoseCount`] for a configuration of other than one pose a body; [`QueryError::InPair`] with the
    /// first pair, in the order of the answers, about which the question failed.
    pub fn ask<T: Send>(
        &self,
        configurations: &[impl AsRef<[Pose]> + Sync],
        question: impl Fn(&Query<'a>) -> Result<T, QueryError> + Send + Sync,
    ) -> Result<Vec<Vec<T>>, QueryError> {
        for (configuration, poses) in configurations.iter().enumerate() {
            let (expected, found) = (self.bodies.len(), poses.as_ref().len());
            if expected != found {
                return Err(QueryError::PoseCount {
                    configuration,
                    expected,
                    found,
                });
            }
        }
        let pairs = self.pairs();
        let answer = |item: usize| {
            let (configuration, pair) = (item / pairs.len(), pairs[item % pairs.len()]);
            let poses = configurations[configuration].as_ref();
            let [a, b] = pair.map(|body| self.bodies[body].borrow());
            Query::new(a, b)
                .poses(poses[pair[0]], poses[pair[1]])
                .and_then(|query| question(&query))
                .map_err(|error| QueryError::InPair {
                    configuration,
                    pair,
                    error: Box::new(error),
                })
        };
        let count = configurations.len() * pairs.len();
        let mut answers =
            parallel::in_order(parallel::available(self.threads), count, answer).into_iter();
        let of_one = |_| answers.by_ref().take(pairs.len()).collect();
        configurations.iter().map(of_one).collect()
    }
}

/// Refuses what is no pair of so many bodies.
pub(crate) fn check_pair([one, other]: [usize; 2], bodies: usize) -> Result<(), QueryError> {
    for body in [one, other] {
        if body >= bodies {
            return Err(QueryError::NoSuchBody { body, bodies });
        }
    }
    if one == other {
        return Err(QueryError::SameBody { body: one });
    }
    Ok(())
}
