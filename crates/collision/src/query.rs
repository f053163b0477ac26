//! Queries over two meshes, from cheap to rich.

use vertebra_spatial::Pose;

use crate::all_pairs::{ExactTest, MollerTest, run};
use crate::error::QueryError;
use crate::mesh::TriangleMesh;
use crate::moller;
use crate::sink::{Any, Count, Mask, Pairs, Sink};
use crate::transform::RelativePose;

/// How pairs of triangles are tested.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// As rational arithmetic would: see [`crate::exact`].
    #[default]
    Exact,
    /// The baseline in single precision: see [`crate::moller`]. Vertices are posed in `f64` and rounded to `f32`.
    Moller {
        /// Values of N·U + d below this count as zero \[m³].
        epsilon: f32,
    },
}

impl Method {
    /// The baseline with the tolerance of the source, 1e-6.
    pub const MOLLER: Self = Self::Moller {
        epsilon: moller::DEFAULT_EPSILON,
    };
}

/// A question about the colliding pairs of two meshes: set it up, then ask.
///
/// Unless said otherwise both meshes stand where their files put them, the method is exact, and one thread works.
/// Answers do not depend on the number of threads.
///
/// ```no_run
/// use vertebra_collision::{Query, TriangleMesh};
///
/// let (cup, spoon) = (TriangleMesh::read("cup.obj")?, TriangleMesh::read("spoon.obj")?);
/// for [i, j] in Query::new(&cup, &spoon).threads(0).pairs()? {
///     println!("triangle {i} of the cup meets triangle {j} of the spoon");
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct Query<'a> {
    a: &'a TriangleMesh,
    b: &'a TriangleMesh,
    pose: RelativePose,
    method: Method,
    threads: usize,
}

impl<'a> Query<'a> {
    /// A query over meshes A and B.
    pub fn new(a: &'a TriangleMesh, b: &'a TriangleMesh) -> Self {
        Self {
            a,
            b,
            pose: RelativePose::IDENTITY,
            method: Method::default(),
            threads: 1,
        }
    }

    /// Places both meshes in the world.
    ///
    /// # Errors
    ///
    /// A pose that [`RelativePose::between`] refuses.
    pub fn poses(mut self, a: Pose, b: Pose) -> Result<Self, QueryError> {
        self.pose = RelativePose::between(&a, &b)?;
        Ok(self)
    }

    /// Places mesh B, seen from A.
    ///
    /// # Errors
    ///
    /// A pose that [`RelativePose::between`] refuses.
    pub fn pose_b(self, b: Pose) -> Result<Self, QueryError> {
        self.poses(Pose::IDENTITY, b)
    }

    /// Chooses the test.
    pub fn method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// Uses at most this many threads of the current rayon pool; 0 uses all of them. Without the feature `rayon` there
    /// is one.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// Where B stands, seen from A: what defines B's posed vertices.
    #[must_use]
    pub fn relative_pose(&self) -> &RelativePose {
        &self.pose
    }

    /// Whether any two triangles meet; stops at the first pair found.
    ///
    /// # Errors
    ///
    /// A tolerance of Möller's test that is negative or not finite.
    pub fn any(&self) -> Result<bool, QueryError> {
        Ok(self.run(Any::default)?.iter().any(|found| found.0))
    }

    /// How many pairs of triangles meet.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn count(&self) -> Result<u64, QueryError> {
        Ok(self.run(Count::default)?.iter().map(|count| count.0).sum())
    }

    /// Which triangles of A and which of B meet some triangle of the other mesh.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn mask(&self) -> Result<(Vec<bool>, Vec<bool>), QueryError> {
        let empty = || Mask::new(self.a.len(), self.b.len());
        let masks = self.run(empty)?.into_iter();
        let Mask { a, b } = masks
            .reduce(|merged, mask| merged.merge(&mask))
            .unwrap_or_else(empty);
        Ok((a, b))
    }

    /// All pairs (triangle of A, triangle of B) that meet, in lexicographic order.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn pairs(&self) -> Result<Vec<[u32; 2]>, QueryError> {
        let mut pairs: Vec<[u32; 2]> = self
            .run(Pairs::default)?
            .into_iter()
            .flat_map(|found| found.0)
            .collect();
        pairs.sort_unstable();
        Ok(pairs)
    }

    fn run<S: Sink>(&self, new_sink: impl Fn() -> S + Sync) -> Result<Vec<S>, QueryError> {
        let Self { a, b, pose, .. } = self;
        match self.method {
            Method::Exact => Ok(run(&ExactTest::new(a, b, pose), self.threads, new_sink)),
            Method::Moller { epsilon } if epsilon.is_finite() && epsilon >= 0.0 => {
                let test = MollerTest::new(a, b, pose, epsilon);
                Ok(run(&test, self.threads, new_sink))
            }
            Method::Moller { epsilon } => Err(QueryError::InvalidEpsilon { epsilon }),
        }
    }
}
