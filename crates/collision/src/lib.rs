//! Triangle-mesh collision, exact: which triangles of one mesh meet which triangles of another.
//!
//! A [`TriangleMesh`] holds `f32` vertices and triangles in file order. A [`Query`] over two meshes, each with a
//! pose, answers from cheap to rich: [`any`](Query::any), [`count`](Query::count), [`mask`](Query::mask),
//! [`pairs`](Query::pairs), [`classified`](Query::classified), [`curves`](Query::curves),
//! [`within`](Query::within) a distance. Lists are complete and sorted, and the same for every number of threads. For
//! many queries, a [`Collider`] keeps a mesh with its bounding volume hierarchy;
//! [`at_poses`](Query::at_poses) asks about many poses, and [`Links`] about many bodies, in one call. A [`SelfQuery`]
//! is about one mesh, a [`Solid`] about the inside of a closed one.
//!
//! # What exact means
//!
//! * The input is what the mesh holds: `f32` coordinates. Readers round a file's numbers to the nearest `f32`.
//! * The pose of B seen from A is P = A⁻¹ B in `f64`. A posed vertex of B is *defined* as
//!   `((r0*x + r1*y) + r2*z) + t` per coordinate, in this order and without fused operations
//!   ([`RelativePose`]); A's vertices stay as given, and the identity changes nothing.
//! * [`Method::Exact`] answers as rational arithmetic on these points would: no false pair, no missed pair, in any
//!   unit of length, for slivers, coplanar triangles and triangles of zero area alike.
//! * Triangles are closed: touching in one point is a hit. A triangle of zero area is the segment or the point that
//!   its vertices span.
//!
//! [`Method::Moller`] is the single-precision interval test of Möller 1997 with its absolute tolerance. It is here
//! to be compared with, and its documentation says where it errs.
//!
//! # Units
//!
//! Coordinates are in whatever unit the file is in \[m by convention]; poses use the same unit.
//!
//! # Example
//!
//! ```
//! use glam::Vec3;
//! use vertebra_collision::{Query, TriangleMesh};
//! use vertebra_spatial::Pose;
//!
//! let floor = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
//! let needle = TriangleMesh::new(
//!     vec![Vec3::new(0.2, 0.2, 0.0), Vec3::new(0.2, 0.2, 1.0), Vec3::new(0.3, 0.2, 1.0)],
//!     vec![[0, 1, 2]],
//! )?;
//! // The tip of the needle touches the floor: a hit, exactly.
//! assert_eq!(Query::new(&floor, &needle).pairs()?, [[0, 0]]);
//! // Lifted by the smallest step there is, it does not.
//! let lifted = Pose::from_translation(glam::DVec3::new(0.0, 0.0, f64::from(f32::MIN_POSITIVE)));
//! assert!(!Query::new(&floor, &needle).pose_b(lifted)?.any()?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod all_pairs;
mod bounds;
mod box_pose;
mod bvh;
mod classify;
mod collider;
mod construct;
mod criterion;
mod culling;
mod curves;
mod degenerate;
mod distance;
mod error;
pub mod exact;
mod format;
#[cfg(feature = "gpu")]
pub mod gpu;
mod links;
mod meeting;
mod mesh;
pub mod moller;
mod operand;
mod parallel;
mod places;
mod predicates;
mod query;
mod self_query;
mod sink;
mod solid;
mod transform;
mod traverse;

pub use classify::PairClass;
pub use collider::Collider;
pub use culling::Culling;
pub use curves::{Curve, CurvePoint, Curves};
pub use distance::DistanceBounds;
pub use error::{MeshError, Place, PolygonProblem, PoseProblem, QueryError, Side};
pub use format::ply::{PlyPart, write_ply};
pub use links::Links;
pub use mesh::TriangleMesh;
pub use operand::Operand;
pub use query::{ClassifiedPair, ClosePair, Method, Query};
pub use self_query::SelfQuery;
pub use sink::Statistics;
pub use solid::{Location, Solid};
pub use transform::RelativePose;
