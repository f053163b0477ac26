//! Spatial (6-D) vector algebra for articulated-body dynamics.
//!
//! # Conventions
//! Used by every crate of vertebra; `docs/conventions.md` has the whole table.
//! - Spatial vectors hold the **angular part first** (Featherstone, Drake; Pinocchio puts linear first).
//! - Vectors are columns, frames right-handed, units SI, angles in radians, quaternions x, y, z, w.
//! - A [`Pose`] or [`Transform`] of B in A takes coordinates in B to coordinates in A.
//! - The solvers keep all vectors in world axes and give each body its own origin. Between two such
//!   frames a motion vector transforms by X = [1 0; -r~ 1], which [`Motion::shifted`] applies; the
//!   methods named `shifted_back` apply X' to forces and inertias.
//! - Accelerations are conventional: the linear part is that of the material point at the origin.
//!
//! # Precision
//! Everything is written once over the sealed trait [`Number`]: a [`Real`] (f32, f64, or the 106 bits of
//! [`DoubleDouble`], the reference that tells the error of the others), or several in [`Lanes`]. Values
//! that cross a public boundary are f64, as glam types. Nothing here allocates.
//!
//! ```
//! use vertebra_spatial::{Force, Motion, RigidInertia, Sym3, vec3};
//!
//! // A 2 kg body whose centre of mass lies 0.5 m along x from the origin.
//! let inertia = RigidInertia::<f64>::from_center(2.0, vec3(0.5, 0.0, 0.0), Sym3::from_diagonal(0.1));
//! let velocity = Motion::new(vec3(0.0, 0.0, 3.0), vec3(0.0, 0.0, 0.0));
//! let momentum: Force<f64> = inertia.mul(velocity);
//! assert_eq!(momentum.linear.y, 3.0); // m (w x c) = 2 * 3 * 0.5 N s
//! assert_eq!(0.5 * velocity.dot(momentum), 0.5 * (0.1 + 2.0 * 0.25) * 9.0);
//! ```

mod cholesky;
mod double_double;
mod force;
mod inertia;
mod lanes;
mod matrix;
pub mod matrix6;
mod motion;
mod pose;
mod quaternion;
mod scalar;
mod sin_cos;
pub mod subspace;
mod transform;
pub mod twofold;
mod vector;

pub use cholesky::SmallCholesky;
pub use double_double::DoubleDouble;
pub use force::Force;
pub use inertia::{ArticulatedInertia, RigidInertia};
pub use lanes::{F32Lanes, F64Lanes, Lanes, WideLanes};
pub use matrix::{Mat3, Sym3};
pub use matrix6::Mat6;
pub use motion::Motion;
pub use pose::Pose;
pub use quaternion::{Quat, rotation_vector_rate};
pub use scalar::{Number, Real};
pub use subspace::MotionSubspace;
pub use transform::Transform;
pub use twofold::Twofold;
pub use vector::{Vec3, vec3};
