//! Many bodies on a device in one call: the links of a robot, in one or many configurations.

use std::collections::BTreeSet;
use std::sync::Arc;

use vertebra_gpu::{Buffer, Device};
use vertebra_shaders::collision::{Job, POSE};
use vertebra_spatial::Pose;

use super::batch::Batch;
use super::collider::{Resident, count};
use super::error::Error;
use super::job::job;
use super::search::Search;
use crate::bvh::Bvh;
use crate::culling::Culling;
use crate::error::QueryError;
use crate::links::check_pair;
use crate::mesh::TriangleMesh;
use crate::transform::RelativePose;

/// Bodies on a device that move against each other, and which pairs of them are of no interest: the pairs and the
/// answers of [`crate::Links`], all of a call found in one run.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use vertebra_collision::{TriangleMesh, gpu};
/// use vertebra_spatial::Pose;
///
/// # if vertebra_gpu::tests_are_left_out() { return Ok(()); }
/// let device = gpu::Device::auto()?;
/// let tile = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// // Neighbours in the chain always touch.
/// let links = gpu::Links::new(&device, &[&tile; 3])?.ignore(0, 1)?.ignore(1, 2)?;
/// assert_eq!(links.pairs(), [[0, 2]]);
/// let at = |z: [f64; 3]| z.map(|z| Pose::from_translation(DVec3::Z * z));
/// let configurations = [at([0.0, 1.0, 2.0]), at([0.0, 1.0, 0.0])];
/// assert_eq!(links.at(&configurations)?.any()?, [[false], [true]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
#[must_use]
pub struct Links {
    search: Search,
    /// First block and number of blocks of each body.
    bodies: Vec<[u32; 2]>,
    ignored: BTreeSet<[usize; 2]>,
    culling: Culling,
}

impl Links {
    /// All pairs of these bodies are of interest. Bodies may be the same mesh, which is then on the device once.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`] for all together; [`Error::Device`].
    pub fn new(device: &Device, bodies: &[&TriangleMesh]) -> Result<Self, Error> {
        let mut shapes: Vec<(&TriangleMesh, [u32; 2])> = Vec::new();
        let (mut coordinates, mut leaves) = (Vec::new(), Vec::new());
        let mut places = Vec::new();
        for &mesh in bodies {
            let known = shapes.iter().find(|(shape, _)| std::ptr::eq(*shape, mesh));
            if let Some((_, place)) = known {
                places.push(*place);
                continue;
            }
            let first_block = count(leaves.len() / Resident::WIDTH);
            let first_vertex = count(coordinates.len() / 3);
            coordinates.extend(mesh.vertices().iter().flat_map(|v| v.to_array()));
            let tree = Bvh::new(mesh, None, 1);
            let blocks = mesh.len().div_ceil(Resident::WIDTH);
            for &triangle in (0..blocks).flat_map(|block| tree.leaf(block)) {
                let [p, q, r] = mesh.triangles()[triangle as usize].map(|v| v + first_vertex);
                leaves.push([p, q, r, triangle]);
            }
            Resident::fill_up(&mut leaves);
            let place = [first_block, count(blocks)];
            shapes.push((mesh, place));
            places.push(place);
        }
        let triangles = shapes.iter().map(|(mesh, _)| mesh.len()).sum();
        let resident = Resident::new(device, &coordinates, &leaves, triangles)?;
        resident.refit()?;
        let resident = Arc::new(resident);
        Ok(Self {
            search: Search::of(&resident, &resident),
            bodies: places,
            ignored: BTreeSet::new(),
            culling: Culling::default(),
        })
    }

    /// Chooses how pairs are culled: blocks all against all, or down the trees.
    pub fn culling(mut self, culling: Culling) -> Self {
        self.culling = culling;
        self
    }

    /// Leaves out the pair of two bodies.
    ///
    /// # Errors
    ///
    /// [`QueryError::NoSuchBody`]; [`QueryError::SameBody`] if the two are one.
    pub fn ignore(mut self, one: usize, other: usize) -> Result<Self, Error> {
        check_pair([one, other], self.bodies.len())?;
        self.ignored.insert([one.min(other), one.max(other)]);
        Ok(self)
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

    /// A question about every pair in every configuration, which is a pose of each body in the world.
    ///
    /// # Errors
    ///
    /// [`QueryError::PoseCount`] for a configuration of other than one pose a body; [`QueryError::InPair`] with the
    /// first pair of which a pose is refused.
    pub fn at(&self, configurations: &[impl AsRef<[Pose]>]) -> Result<AtConfigurations<'_>, Error> {
        let pairs = self.pairs();
        let (mut relative, mut jobs) = (Vec::new(), Vec::new());
        for (configuration, poses) in configurations.iter().enumerate() {
            let poses = poses.as_ref();
            let (expected, found) = (self.bodies.len(), poses.len());
            if expected != found {
                return Err(QueryError::PoseCount {
                    configuration,
                    expected,
                    found,
                }
                .into());
            }
            for &pair in &pairs {
                let [a, b] = pair;
                let pose = RelativePose::between(&poses[a], &poses[b]).map_err(|error| {
                    QueryError::InPair {
                        configuration,
                        pair,
                        error: Box::new(error),
                    }
                })?;
                relative.push(pose);
                jobs.push(job(&pose, self.bodies[a], self.bodies[b]));
            }
        }
        Ok(AtConfigurations {
            batch: Batch::new(&self.search, relative, jobs, self.culling),
            pairs: pairs.len(),
            configurations: configurations.len(),
        })
    }

    /// The same bodies, posed by a buffer on the device, which a simulation writes and nobody reads back: for each
    /// configuration and each body eight words, a quaternion of unit length (x, y, z, w), a translation \[m], and one
    /// that does not count.
    ///
    /// Answers are those about the `f64` values of these words. Poses that are none are found when asked:
    /// [`QueryError::AtPose`].
    ///
    /// # Errors
    ///
    /// [`QueryError::PoseCount`] unless the buffer holds whole configurations.
    pub fn following(&self, poses: &Buffer<f32>) -> Result<Following, Error> {
        let expected = self.bodies.len();
        let found = poses.len() / POSE;
        let configurations = found / expected.max(1);
        if poses.len() != POSE * expected * configurations {
            return Err(QueryError::PoseCount {
                configuration: configurations,
                expected,
                found: found - expected * configurations,
            }
            .into());
        }
        let pairs = self.pairs();
        let jobs = (0..configurations).flat_map(|configuration| {
            let first = configuration * expected;
            pairs.iter().map(move |&[a, b]| Job {
                a_pose: count(first + a),
                b_pose: count(first + b),
                ..job(&RelativePose::IDENTITY, self.bodies[a], self.bodies[b])
            })
        });
        Ok(Following {
            search: self.search.placed(poses),
            jobs: jobs.collect(),
            pairs: pairs.len(),
            configurations,
            culling: self.culling,
        })
    }
}

/// Bodies that follow poses in a buffer on the device: see [`Links::following`].
#[derive(Debug)]
#[must_use]
pub struct Following {
    search: Search,
    jobs: Vec<Job>,
    pairs: usize,
    configurations: usize,
    culling: Culling,
}

impl Following {
    /// A question about where the bodies are now.
    pub fn now(&self) -> AtConfigurations<'_> {
        let jobs = self.jobs.clone();
        AtConfigurations {
            batch: Batch::new(&self.search, Vec::new(), jobs, self.culling),
            pairs: self.pairs,
            configurations: self.configurations,
        }
    }
}

/// A question about bodies in some configurations: see [`Links::at`]. For each configuration, the answers are in the
/// order of [`Links::pairs`].
#[derive(Debug)]
#[must_use]
pub struct AtConfigurations<'a> {
    batch: Batch<'a>,
    pairs: usize,
    configurations: usize,
}

impl AtConfigurations<'_> {
    /// Whether any two triangles meet.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn any(&self) -> Result<Vec<Vec<bool>>, Error> {
        Ok(self.grouped(self.batch.any()?))
    }

    /// How many pairs of triangles meet.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn count(&self) -> Result<Vec<Vec<u64>>, Error> {
        Ok(self.grouped(self.batch.count()?))
    }

    /// All pairs of triangles that meet, in lexicographic order.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn pairs(&self) -> Result<Vec<Vec<Vec<[u32; 2]>>>, Error> {
        Ok(self.grouped(self.batch.pairs()?))
    }

    /// The answers of each configuration.
    fn grouped<T>(&self, answers: Vec<T>) -> Vec<Vec<T>> {
        let mut answers = answers.into_iter();
        let of_one = |_| answers.by_ref().take(self.pairs).collect();
        (0..self.configurations).map(of_one).collect()
    }
}
