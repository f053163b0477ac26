//! Articulated-body dynamics and exact mesh collision that report their error beside their speed.
//!
//! This crate is what an application imports. It only gathers the others, each of which can be used
//! alone: `vertebra-spatial` (6-D algebra), `vertebra-assembly` (models, generators, URDF),
//! `vertebra-dynamics` (ABA, RNEA, CRBA, integrators, residuals) and `vertebra-collision` (meshes
//! and their colliding triangles).
//!
//! Conventions (frames, order, units) stand in the documentation of [`spatial`].

pub use glam;
#[cfg(feature = "urdf")]
pub use vertebra_assembly::urdf;
pub use vertebra_assembly::{
    self as assembly, Body, BodyDescription, BodyId, Frame, FrameDescription, Joint, JointKind,
    JointLimits, MassProperties, Mimic, Model, ModelDescription, ModelError, NotSimulated, Random,
    State, Units, generate, schedule,
};
pub use vertebra_collision::{
    self as collision, ClassifiedPair, ClosePair, Collider, Culling, Curve, CurvePoint, Curves,
    DistanceBounds, Links, Location, MeshError, Method, Operand, PairClass, PlyPart, PoseProblem,
    Query, QueryError, RelativePose, SelfQuery, Side, Solid, Statistics, TriangleMesh, write_ply,
};
pub use vertebra_dynamics::{
    self as dynamics, Achieved, Algorithm, Batch, BodyForce, BodyMotion, Check, Choice, DcaOptions,
    DcaWorkspace, Error, Forces, Integrator, Mechanics, Monitor, Precision, Refinement, Residual,
    Simulation, Solved, Solver, SolverOptions, Workspace, Wrench, aba, aba_batch, body_poses, crba,
    crba_forward_dynamics, dca, forward_error, forward_kinematics, joint_wrenches, mechanics,
    refine, residual, rnea,
};
pub use vertebra_spatial::{self as spatial, Pose};

/// The README's example, compiled and run with the documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
