//! The same questions, answered on a GPU with the same answers.
//!
//! A [`Collider`] keeps a mesh on a [`Device`]; a [`Query`] over two of them has the verbs of
//! [`crate::Query`] and gives its answers, bit for bit, whatever the device. A [`MeshPair`] asks the device or the
//! processor, whichever should be faster.
//!
//! ```
//! use glam::{DVec3, Vec3};
//! use vertebra_collision::{TriangleMesh, gpu};
//! use vertebra_gpu::Device;
//! use vertebra_spatial::Pose;
//!
//! # if vertebra_gpu::tests_are_left_out() { return Ok(()); }
//! let device = Device::auto()?;
//! let tile = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
//! let tile = gpu::Collider::new(&device, tile)?;
//! let mut query = gpu::Query::new(&tile, &tile)?;
//! assert_eq!(query.pairs()?, [[0, 0]]);
//! query = query.pose_b(Pose::from_translation(DVec3::Z))?;
//! assert!(!query.any()?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How
//!
//! Triangles stand in blocks of eight, along a Hilbert curve; eight nodes in a row have one above. Pairs of nodes whose
//! boxes overlap are found in a level of both trees, all against all, and from there down, one level a kernel, to pairs
//! of blocks. The last kernel holds their triangles against each other: box against box, then by the signs of determinants in `f32`, of which only
//! those count that are larger than a bound on their error, whatever the device does with roundings. Pairs with a sign
//! that is not certain are left to the host, with the coordinates of their corners, and settled by the test of
//! [`crate::exact`]. So the answer is exact, and how many pairs are left says only what it costs.
//!
//! Queues that are too small are made larger and the question is asked again: nothing is ever left out.

mod batch;
mod choice;
mod collider;
mod cost;
mod error;
mod job;
mod links;
mod matrix;
mod mesh_pair;
mod quality;
mod query;
mod ready;
mod room;
mod search;
mod self_query;
mod settle;

pub use choice::{Choice, Processor, Reason};
pub use collider::Collider;
pub use error::Error;
pub use links::{AtConfigurations, Following, Links};
pub use matrix::PairMatrix;
pub use mesh_pair::MeshPair;
pub use query::{AtPoses, Query, Statistics};
pub use self_query::SelfQuery;
pub use vertebra_gpu::Device;
