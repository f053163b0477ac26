//! Queries over two meshes on a device.

use vertebra_spatial::Pose;

use super::batch::Batch;
use super::collider::Collider;
use super::error::Error;
use super::job::job;
use super::matrix::PairMatrix;
use super::search::Search;
use crate::culling::Culling;
use crate::curves::Curves;
use crate::error::QueryError;
use crate::query::{ClassifiedPair, Method};
use crate::transform::RelativePose;

/// A question about the colliding pairs of two meshes on a device: the verbs and the answers of [`crate::Query`].
///
/// It keeps its queues and its programs, so ask again with the same one: `query = query.pose_b(pose)?`.
#[derive(Debug)]
#[must_use]
pub struct Query {
    search: Search,
    pose: RelativePose,
    culling: Culling,
    method: Method,
}

/// What a query took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Statistics {
    /// Pairs of blocks, of eight triangles each, whose boxes overlap.
    pub block_pairs: u64,
    /// Pairs of triangles that meet.
    pub hits: u64,
    /// Pairs of triangles that single precision left undecided.
    pub undecided: u64,
    /// Those of them that the host decided; of many, integers on the device settle most.
    pub on_host: u64,
    /// Levels of the trees that were descended; 0 if all blocks were held against all.
    pub levels: u32,
    /// Time on the device \[s], if it takes times.
    pub gpu_time: Option<f64>,
    /// Time in which the host decided its pairs \[s]; none where there is no clock.
    pub settle_time: Option<f64>,
}

impl Query {
    /// A query over A and B, which stand where their files put them.
    ///
    /// # Errors
    ///
    /// [`Error::OtherDevice`].
    pub fn new(a: &Collider, b: &Collider) -> Result<Self, Error> {
        Ok(Self {
            search: Search::new(a.resident(), b.resident())?,
            pose: RelativePose::IDENTITY,
            culling: Culling::default(),
            method: Method::default(),
        })
    }

    /// Places both meshes in the world.
    ///
    /// # Errors
    ///
    /// A pose that [`RelativePose::between`] refuses.
    pub fn poses(self, a: Pose, b: Pose) -> Result<Self, Error> {
        Ok(self.relative(RelativePose::between(&a, &b)?))
    }

    /// Places mesh B, seen from A.
    ///
    /// # Errors
    ///
    /// A pose that [`RelativePose::between`] refuses.
    pub fn pose_b(self, b: Pose) -> Result<Self, Error> {
        self.poses(Pose::IDENTITY, b)
    }

    /// Places mesh B as this relative pose says.
    pub fn relative(mut self, pose: RelativePose) -> Self {
        self.set_relative(pose);
        self
    }

    pub(super) fn set_relative(&mut self, pose: RelativePose) {
        self.pose = pose;
    }

    /// Chooses the test. Möller's poses vertices in `f32`, where the CPU does in `f64`, and its answers are the device's:
    /// the CPU's only where no operation is rounded. It is here to be compared with.
    ///
    /// # Errors
    ///
    /// [`QueryError::InvalidEpsilon`].
    pub fn method(mut self, method: Method) -> Result<Self, Error> {
        if let Method::Moller { epsilon } = method
            && !(epsilon.is_finite() && epsilon >= 0.0)
        {
            return Err(QueryError::InvalidEpsilon { epsilon }.into());
        }
        self.method = method;
        Ok(self)
    }

    /// Chooses how pairs are culled: blocks all against all, or down the tree of A.
    pub fn culling(mut self, culling: Culling) -> Self {
        self.culling = culling;
        self
    }

    /// Where B stands, seen from A.
    #[must_use]
    pub fn relative_pose(&self) -> &RelativePose {
        &self.pose
    }

    /// Whether any two triangles meet.
    ///
    /// # Errors
    ///
    /// [`Error::Device`]; [`Error::Mesh`] for vertices that the device has found not to be finite.
    pub fn any(&self) -> Result<bool, Error> {
        Ok(self.batch().any()?.contains(&true))
    }

    /// How many pairs of triangles meet.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn count(&self) -> Result<u64, Error> {
        Ok(self.batch().count()?.iter().sum())
    }

    /// Which triangles of A and which of B meet some triangle of the other mesh.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn mask(&self) -> Result<(Vec<bool>, Vec<bool>), Error> {
        let [a, b] = self.batch().mask(self.triangles())?;
        Ok((a, b))
    }

    /// All pairs (triangle of A, triangle of B) that meet, in lexicographic order.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn pairs(&self) -> Result<Vec<[u32; 2]>, Error> {
        Ok(self.batch().pairs()?.pop().unwrap_or_default())
    }

    /// All pairs that meet, in lexicographic order, each with what it meets in.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any); [`QueryError::NotExact`] for other methods than [`Method::Exact`].
    pub fn classified(&self) -> Result<Vec<ClassifiedPair>, Error> {
        self.check_exact()?;
        self.batch().classified()
    }

    /// Where the surfaces meet, as polylines in the frame of A: see [`crate::Query::curves`].
    ///
    /// # Errors
    ///
    /// As for [`classified`](Self::classified).
    pub fn curves(&self) -> Result<Curves, Error> {
        self.check_exact()?;
        self.batch().curves()
    }

    /// A bit for every pair of triangles.
    ///
    /// # Errors
    ///
    /// [`Error::MatrixTooLarge`]; else as for [`any`](Self::any).
    pub fn matrix(&self) -> Result<PairMatrix, Error> {
        let limits = self.search.a.device.limits();
        PairMatrix::ask(&self.batch(), self.triangles(), &limits)
    }

    /// Asks the same for many poses of B, seen from A, in one run on the device. This query's own pose is left out of
    /// account.
    ///
    /// # Errors
    ///
    /// [`QueryError::AtPose`] with the first pose that is refused.
    pub fn at_poses(&self, poses: &[Pose]) -> Result<AtPoses<'_>, Error> {
        let relative = |(index, pose): (usize, &Pose)| {
            RelativePose::between(&Pose::IDENTITY, pose).map_err(|error| QueryError::AtPose {
                index,
                error: Box::new(error),
            })
        };
        let poses: Result<Vec<_>, _> = poses.iter().enumerate().map(relative).collect();
        Ok(AtPoses(self.at(poses?)))
    }

    /// What [`pairs`](Self::pairs) takes.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn statistics(&self) -> Result<Statistics, Error> {
        self.batch().statistics()
    }

    fn check_exact(&self) -> Result<(), Error> {
        match self.method {
            Method::Exact => Ok(()),
            Method::Moller { .. } => Err(QueryError::NotExact.into()),
        }
    }

    fn triangles(&self) -> [u32; 2] {
        [&self.search.a, &self.search.b].map(|mesh| mesh.triangles)
    }

    fn batch(&self) -> Batch<'_> {
        self.at(vec![self.pose])
    }

    fn at(&self, poses: Vec<RelativePose>) -> Batch<'_> {
        let [a, b] = [&self.search.a, &self.search.b].map(|mesh| mesh.blocks());
        let jobs = poses.iter().map(|pose| job(pose, [0, a], [0, b])).collect();
        let batch = Batch::new(&self.search, poses, jobs, self.culling);
        match self.method {
            Method::Exact => batch,
            Method::Moller { epsilon } => batch.moller(epsilon),
        }
    }
}

/// A question about many poses, all asked in one run: see [`Query::at_poses`]. Answers are in the order of the poses.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use vertebra_collision::{TriangleMesh, gpu};
/// use vertebra_spatial::Pose;
///
/// # if vertebra_gpu::tests_are_left_out() { return Ok(()); }
/// let device = gpu::Device::auto()?;
/// let tile = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let tile = gpu::Collider::new(&device, tile)?;
/// let poses = [0.0, 0.5, 1.5].map(|x| Pose::from_translation(DVec3::X * x));
/// let hits = gpu::Query::new(&tile, &tile)?.at_poses(&poses)?.any()?;
/// assert_eq!(hits, [true, true, false]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
#[must_use]
pub struct AtPoses<'a>(Batch<'a>);

impl AtPoses<'_> {
    /// Whether any two triangles meet.
    ///
    /// # Errors
    ///
    /// As for [`Query::any`].
    pub fn any(&self) -> Result<Vec<bool>, Error> {
        self.0.any()
    }

    /// How many pairs of triangles meet.
    ///
    /// # Errors
    ///
    /// As for [`Query::any`].
    pub fn count(&self) -> Result<Vec<u64>, Error> {
        self.0.count()
    }

    /// All pairs that meet, in lexicographic order.
    ///
    /// # Errors
    ///
    /// As for [`Query::any`].
    pub fn pairs(&self) -> Result<Vec<Vec<[u32; 2]>>, Error> {
        self.0.pairs()
    }
}
