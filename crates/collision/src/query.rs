//! Queries over two meshes, from cheap to rich.

use glam::DVec3;
use vertebra_spatial::Pose;

use crate::all_pairs::{ExactTest, MollerTest};
use crate::bounds::Bounds;
use crate::classify::{PairClass, classify};
use crate::criterion::Criterion;
use crate::culling::Culling;
use crate::curves::{Builder, Corners, Curves};
use crate::distance::DistanceBounds;
use crate::error::QueryError;
use crate::mesh::TriangleMesh;
use crate::moller;
use crate::operand::Operand;
use crate::parallel;
use crate::sink::{Any, Count, Mask, Pairs, Sink, Statistics, run};
use crate::transform::RelativePose;
use crate::traverse::{Tree, TreeTest};

/// Distances asked for must stay below this \[m].
const FARTHEST: f64 = f64::from_bits((1023 + 127) << 52);

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

/// Two triangles that meet, and in what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClassifiedPair {
    /// The triangle of A.
    pub a: u32,
    /// The triangle of B.
    pub b: u32,
    /// What they share.
    pub class: PairClass,
}

/// Two triangles that are close, and how close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosePair {
    /// The triangle of A.
    pub a: u32,
    /// The triangle of B.
    pub b: u32,
    /// How far apart they are.
    pub distance: DistanceBounds,
}

/// A question about the colliding pairs of two meshes: set it up, then ask.
///
/// Unless said otherwise both meshes stand where their files put them, the method is exact, and one thread works.
/// Answers do not depend on the number of threads, nor on how pairs are culled.
///
/// For many questions about the same meshes, prepare them as [`Collider`](crate::Collider)s.
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
    a: Operand<'a>,
    b: Operand<'a>,
    pose: RelativePose,
    method: Method,
    culling: Culling,
    threads: usize,
}

impl<'a> Query<'a> {
    /// A query over A and B, each a [`TriangleMesh`] or a [`Collider`](crate::Collider).
    pub fn new(a: impl Into<Operand<'a>>, b: impl Into<Operand<'a>>) -> Self {
        Self {
            a: a.into(),
            b: b.into(),
            pose: RelativePose::IDENTITY,
            method: Method::default(),
            culling: Culling::default(),
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

    /// Places mesh B as this relative pose says.
    pub fn relative(mut self, pose: RelativePose) -> Self {
        self.pose = pose;
        self
    }

    /// Chooses the test.
    pub fn method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// Chooses how pairs are culled. The baseline looks at all of them, as its source does.
    pub fn culling(mut self, culling: Culling) -> Self {
        self.culling = culling;
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
        let empty = || Mask::new(self.a.mesh().len(), self.b.mesh().len());
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
        Ok(Pairs::sorted(self.run(Pairs::default)?))
    }

    /// All pairs that meet, in lexicographic order, each with what it meets in.
    ///
    /// # Errors
    ///
    /// [`QueryError::NotExact`] for other methods than [`Method::Exact`].
    pub fn classified(&self) -> Result<Vec<ClassifiedPair>, QueryError> {
        self.check_exact()?;
        let pairs = self.pairs()?;
        let (a, b) = (self.a.mesh(), self.b.mesh());
        let class = |index: usize| {
            let [i, j] = pairs[index];
            let class = classify(&a.wide_triangle(i), &self.posed(b, j))?;
            Some(ClassifiedPair { a: i, b: j, class })
        };
        let classes = parallel::map(parallel::available(self.threads), pairs.len(), class);
        Ok(classes.into_iter().flatten().collect())
    }

    /// Where the surfaces meet, as polylines in the frame of A.
    ///
    /// ```
    /// use glam::{DVec3, Vec3};
    /// use vertebra_collision::{Query, TriangleMesh};
    ///
    /// let floor = [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]].map(|[x, y]| Vec3::new(x, y, 0.25)).to_vec();
    /// let floor = TriangleMesh::new(floor, vec![[0, 1, 2]])?;
    /// let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    /// let tetrahedron = TriangleMesh::new(corners, vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])?;
    /// let curves = Query::new(&tetrahedron, &floor).curves()?;
    /// let [outline] = curves.curves() else { panic!("one curve") };
    /// assert!(outline.closed);
    /// assert_eq!(curves.positions(outline).count(), 3);
    /// assert!(curves.positions(outline).any(|p| p == DVec3::new(0.75, 0.0, 0.25)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`QueryError::NotExact`] for other methods than [`Method::Exact`].
    pub fn curves(&self) -> Result<Curves, QueryError> {
        self.check_exact()?;
        let pairs = self.pairs()?;
        let (a, b) = (self.a.mesh(), self.b.mesh());
        let a = Corners::new(pairs.iter().map(|[i, _]| *i), |i| a.wide_triangle(i));
        let b = Corners::new(pairs.iter().map(|[_, j]| *j), |j| self.posed(b, j));
        let mut builder = Builder::new(&a, Some(&b));
        for pair in pairs {
            builder.add(pair);
        }
        Ok(builder.finish())
    }

    /// All pairs that are no further apart than a distance \[m], in lexicographic order, each with bounds on how far.
    ///
    /// Pairs at distance 0 are exactly those of [`pairs`](Self::pairs). Of others, one is left out only if its lower
    /// bound is above the distance; so ties are listed, no pair is missed, and a pair whose upper bound is above the
    /// distance may be further apart than asked, by the difference of its bounds at most.
    ///
    /// ```
    /// use glam::{DVec3, Vec3};
    /// use vertebra_collision::{Query, TriangleMesh};
    /// use vertebra_spatial::Pose;
    ///
    /// let tile = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
    /// let query = Query::new(&tile, &tile).pose_b(Pose::from_translation(DVec3::Z * 0.5))?;
    /// assert!(query.within(0.499)?.is_empty());
    /// let [pair] = query.within(0.5)?[..] else { panic!("one pair") };
    /// assert!((pair.distance.upper - 0.5).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`QueryError::InvalidDistance`]; [`QueryError::NotExact`] for other methods than [`Method::Exact`].
    pub fn within(&self, distance: f64) -> Result<Vec<ClosePair>, QueryError> {
        self.check_exact()?;
        if !(0.0..FARTHEST).contains(&distance) {
            return Err(QueryError::InvalidDistance { distance });
        }
        let criterion = if distance > 0.0 {
            Criterion::Within(distance)
        } else {
            Criterion::Meet
        };
        let pairs = Pairs::sorted(self.run_exact(criterion, Pairs::default));
        let (a, b) = (self.a.mesh(), self.b.mesh());
        let close = |index: usize| {
            let [i, j] = pairs[index];
            let distance = DistanceBounds::of(&a.wide_triangle(i), &self.posed(b, j));
            ClosePair {
                a: i,
                b: j,
                distance,
            }
        };
        let threads = parallel::available(self.threads);
        Ok(parallel::map(threads, pairs.len(), close))
    }

    /// Asks the same for many poses of B, seen from A: the answers in their order. This query's own pose is left out of
    /// account; its threads share the poses.
    ///
    /// Prepare the meshes as [`Collider`](crate::Collider)s, unless they are small: each pose asks anew.
    ///
    /// ```
    /// use glam::{DVec3, Vec3};
    /// use vertebra_collision::{Collider, Query, TriangleMesh};
    /// use vertebra_spatial::Pose;
    ///
    /// let tile = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
    /// let tile = Collider::new(tile);
    /// let poses = [0.0, 0.5, 1.5].map(|x| Pose::from_translation(DVec3::X * x));
    /// let hits = Query::new(&tile, &tile).at_poses(&poses, |query| query.any())?;
    /// assert_eq!(hits, [true, true, false]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`QueryError::AtPose`] with the first pose that is refused or about which the question failed.
    pub fn at_poses<T: Send>(
        &self,
        poses: &[Pose],
        question: impl Fn(&Self) -> Result<T, QueryError> + Send + Sync,
    ) -> Result<Vec<T>, QueryError> {
        let answer = |index: usize| {
            let query = self.clone().threads(1).pose_b(poses[index]);
            query
                .and_then(|query| question(&query))
                .map_err(|error| QueryError::AtPose {
                    index,
                    error: Box::new(error),
                })
        };
        let threads = parallel::available(self.threads);
        parallel::in_order(threads, poses.len(), answer)
            .into_iter()
            .collect()
    }

    /// How often each stage of the exact test decides, over the pairs that [`count`](Self::count) looks at.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any); for other methods all counts but the hits are zero.
    pub fn statistics(&self) -> Result<Statistics, QueryError> {
        let parts = self.run(Statistics::default)?.into_iter();
        Ok(parts.fold(Statistics::default(), |sum, part| sum.merge(&part)))
    }

    fn run<S: Sink>(&self, new_sink: impl Fn() -> S + Send + Sync) -> Result<Vec<S>, QueryError> {
        let (a, b) = (self.a.mesh(), self.b.mesh());
        let threads = parallel::available(self.threads);
        match self.method {
            Method::Exact => Ok(self.run_exact(Criterion::Meet, new_sink)),
            Method::Moller { epsilon } if epsilon.is_finite() && epsilon >= 0.0 => {
                let test = MollerTest::new(a, b, &self.pose, epsilon);
                Ok(run(&test, threads, new_sink))
            }
            Method::Moller { epsilon } => Err(QueryError::InvalidEpsilon { epsilon }),
        }
    }

    fn run_exact<S: Sink>(
        &self,
        criterion: Criterion,
        new_sink: impl Fn() -> S + Send + Sync,
    ) -> Vec<S> {
        let threads = parallel::available(self.threads);
        if self.uses_bvh() {
            let (a, b) = self.trees(criterion, threads);
            let test = TreeTest::new(a, b, &self.pose, criterion, threads);
            run(&test, threads, new_sink)
        } else {
            let (a, b) = (self.a.mesh(), self.b.mesh());
            let test = ExactTest::new(a, b, &self.pose, criterion);
            run(&test, threads, new_sink)
        }
    }

    /// A triangle of B, seen from A.
    fn posed(&self, b: &TriangleMesh, triangle: u32) -> [DVec3; 3] {
        b.wide_triangle(triangle).map(|v| self.pose.apply_wide(v))
    }

    fn check_exact(&self) -> Result<(), QueryError> {
        match self.method {
            Method::Exact => Ok(()),
            Method::Moller { .. } => Err(QueryError::NotExact),
        }
    }

    fn uses_bvh(&self) -> bool {
        let unprepared = self.a.unprepared() + self.b.unprepared();
        let sizes = [self.a, self.b].map(|operand| operand.mesh().len());
        self.culling.uses_bvh(sizes, unprepared)
    }

    /// The trees of both meshes; those built here leave out what is beyond the reach of the other mesh.
    fn trees(&self, criterion: Criterion, threads: usize) -> (Tree<'a>, Tree<'a>) {
        let (a, b) = (self.a.bounds(), self.pose.boxes().apply(&self.b.bounds()));
        let near = |bounds: &Bounds| {
            criterion
                .reach()
                .map_or(*bounds, |reach| bounds.grown(reach))
        };
        let near_b = a.intersection(&near(&b));
        let near_a = self.pose.inverse_boxes().apply(&near(&a).intersection(&b));
        parallel::join(
            threads,
            || self.a.tree(&near_b, threads / 2),
            || self.b.tree(&near_a, threads - threads / 2),
        )
    }
}
