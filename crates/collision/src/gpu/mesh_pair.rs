//! One door to the colliding pairs of two meshes: what computes is chosen from their sizes, or by the user.

use glam::Vec3;
use vertebra_gpu::Device;
use vertebra_spatial::Pose;

use super::choice::{Choice, Processor};
use super::collider::Collider;
use super::error::Error;
use super::query::Query;
use crate::curves::Curves;
use crate::error::Side;
use crate::mesh::TriangleMesh;
use crate::parallel;
use crate::query::ClassifiedPair;
use crate::transform::RelativePose;

/// Two meshes that are asked about again and again, in one pose after another, on whichever of processor and device is
/// expected to answer sooner. Answers are the same on both.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use vertebra_collision::{TriangleMesh, gpu};
/// use vertebra_spatial::Pose;
///
/// let device = gpu::Device::auto().ok();
/// let tile = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let mut pair = gpu::MeshPair::new(device.as_ref(), tile.clone(), tile, None)?;
/// // Of so few triangles the processor has told before a device has begun.
/// assert_eq!(pair.choice().processor, gpu::Processor::Cpu);
/// println!("{}", pair.choice());
/// assert_eq!(pair.pairs()?, [[0, 0]]);
/// pair.set_pose_b(Pose::from_translation(DVec3::Z))?;
/// assert!(!pair.any()?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MeshPair {
    choice: Choice,
    pose: RelativePose,
    meshes: Meshes,
}

#[derive(Debug)]
enum Meshes {
    Cpu(Box<[crate::Collider; 2]>),
    Gpu(Box<[Collider; 2]>, Box<Query>),
}

/// Asks both kinds of query the same.
macro_rules! ask {
    ($pair:expr, $verb:ident) => {
        match &$pair.meshes {
            Meshes::Cpu(meshes) => Ok($pair.on_cpu(meshes).$verb()?),
            Meshes::Gpu(_, query) => query.$verb(),
        }
    };
}

impl MeshPair {
    /// Prepares two meshes, where their files put them, on the device if there is one and it is expected to be faster,
    /// or on the processor asked for.
    ///
    /// # Errors
    ///
    /// [`Error::NoDevice`] if a device is asked for and none given; as [`Collider::new`].
    pub fn new(
        device: Option<&Device>,
        a: TriangleMesh,
        b: TriangleMesh,
        asked: Option<Processor>,
    ) -> Result<Self, Error> {
        let choice = Choice::new(device, [a.len(), b.len()], parallel::available(0), asked)?;
        let meshes = match (choice.processor, device) {
            (Processor::Gpu, Some(device)) => {
                let meshes = [Collider::new(device, a)?, Collider::new(device, b)?];
                let query = Query::new(&meshes[0], &meshes[1])?;
                Meshes::Gpu(Box::new(meshes), Box::new(query))
            }
            _ => Meshes::Cpu(Box::new([a, b].map(crate::Collider::new))),
        };
        Ok(Self {
            choice,
            pose: RelativePose::IDENTITY,
            meshes,
        })
    }

    /// What computes, and why.
    #[must_use]
    pub const fn choice(&self) -> &Choice {
        &self.choice
    }

    /// Places mesh B, seen from A.
    ///
    /// # Errors
    ///
    /// A pose that [`RelativePose::between`] refuses; then nothing changes.
    pub fn set_pose_b(&mut self, b: Pose) -> Result<(), Error> {
        self.set_poses(Pose::IDENTITY, b)
    }

    /// Places both meshes in the world.
    ///
    /// # Errors
    ///
    /// A pose that [`RelativePose::between`] refuses; then nothing changes.
    pub fn set_poses(&mut self, a: Pose, b: Pose) -> Result<(), Error> {
        self.pose = RelativePose::between(&a, &b)?;
        if let Meshes::Gpu(_, query) = &mut self.meshes {
            query.set_relative(self.pose);
        }
        Ok(())
    }

    /// Moves the vertices of a mesh \[m], as many as there are, and fits its boxes to them.
    ///
    /// # Errors
    ///
    /// Another number of vertices, or a coordinate that is not finite; then nothing changes. [`Error::Device`].
    pub fn set_vertices(&mut self, mesh: Side, vertices: Vec<Vec3>) -> Result<(), Error> {
        let place = usize::from(mesh == Side::B);
        match &mut self.meshes {
            Meshes::Cpu(meshes) => Ok(meshes[place].set_vertices(vertices)?),
            Meshes::Gpu(meshes, _) => meshes[place].set_vertices(vertices),
        }
    }

    /// Whether any two triangles meet.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn any(&self) -> Result<bool, Error> {
        ask!(self, any)
    }

    /// How many pairs of triangles meet.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn count(&self) -> Result<u64, Error> {
        ask!(self, count)
    }

    /// Which triangles of A and which of B meet some triangle of the other mesh.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn mask(&self) -> Result<(Vec<bool>, Vec<bool>), Error> {
        ask!(self, mask)
    }

    /// All pairs (triangle of A, triangle of B) that meet, in lexicographic order.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn pairs(&self) -> Result<Vec<[u32; 2]>, Error> {
        ask!(self, pairs)
    }

    /// All pairs that meet, in lexicographic order, each with what it meets in.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn classified(&self) -> Result<Vec<ClassifiedPair>, Error> {
        ask!(self, classified)
    }

    /// Where the surfaces meet, as polylines in the frame of A.
    ///
    /// # Errors
    ///
    /// [`Error::Device`].
    pub fn curves(&self) -> Result<Curves, Error> {
        ask!(self, curves)
    }

    fn on_cpu<'a>(&self, [a, b]: &'a [crate::Collider; 2]) -> crate::Query<'a> {
        let query = crate::Query::new(a, b).relative(self.pose);
        query.threads(self.choice.threads)
    }
}
