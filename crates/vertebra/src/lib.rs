//! Articulated-body dynamics and exact mesh collision that report their error beside their speed.
//!
//! This crate is what an application imports. It only gathers the others, each of which can be used
//! alone: `vertebra-spatial` (6-D algebra), `vertebra-assembly` (models, generators, URDF),
//! `vertebra-dynamics` (ABA, divide and conquer, batches, RNEA, CRBA, integrators, residuals),
//! `vertebra-files` (MJCF, SDF, proteins, motion capture, strands, recordings),
//! `vertebra-collision` (meshes and their colliding triangles), `vertebra-gpu` (recordings of
//! compute shaders) and `vertebra-shaders` (scan, sort and other primitives).
//!
//! Conventions (frames, order, units) stand in the documentation of [`spatial`].

pub use glam;
#[cfg(feature = "urdf")]
pub use vertebra_assembly::urdf;
pub use vertebra_assembly::{
    self as assembly, BallRange, Body, BodyDescription, BodyId, BodyProperties, BodyShape,
    BuildError, Builder, Built, Centerline, Closure, Compound, Coupling, CouplingDescription, Edit,
    Edited, Frame, FrameDescription, Joint, JointKind, JointLimits, Loop, LoopDescription,
    MassProperties, Mimic, Model, ModelDescription, ModelError, NotSimulated, Random, Rest, Spring,
    State, Stop, Units, generate, mechanism, schedule,
};
pub use vertebra_collision::{
    self as collision, ClassifiedPair, ClosePair, Collider, Culling, Curve, CurvePoint, Curves,
    DistanceBounds, Links, Location, MeshError, Method, Operand, PairClass, PlyPart, PoseProblem,
    Query, QueryError, RelativePose, SelfQuery, Side, Solid, Statistics, TriangleMesh, write_ply,
};
pub use vertebra_dynamics::{
    self as dynamics, Achieved, Algorithm, Batch, BodyForce, BodyMotion, BodyPoint, Centroidal,
    Check, Choice, DcaOptions, DcaWorkspace, Derivatives, Device, Elements, Error, Forces,
    Integrator, LoopForces, LoopViolation, Mechanics, Monitor, Motor, PendingPoses, Precision,
    Refinement, Residual, Simulation, Solved, Solver, SolverOptions, SphericalMotor, Stored, Work,
    Workspace, Wrench, aba, aba_batch, aba_derivatives, body_poses, centroidal,
    check_accelerations, crba, crba_forward_dynamics, dca, forward_error, forward_kinematics,
    inverse_operational_inertia, joint_wrenches, mechanics, operational_inertia, refine, residual,
    rnea, rnea_derivatives,
};
#[cfg(feature = "files")]
pub use vertebra_files as files;
#[cfg(feature = "gpu")]
pub use vertebra_gpu as gpu;
#[cfg(feature = "gpu")]
pub use vertebra_shaders as shaders;
pub use vertebra_spatial::{self as spatial, Pose};

/// The README's example, compiled and run with the documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// The example of the guide to GPUs, compiled with the documentation tests.
#[cfg(all(doctest, feature = "gpu"))]
#[doc = include_str!("../../../docs/gpu.md")]
struct Guide;

/// The examples of the guide to closed loops, compiled and run with the documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/loops.md")]
struct Loops;

/// The example of the guide to what acts in joints, compiled and run with the documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/joints.md")]
struct Joints;

/// The example of the guide to files, compiled and run with the documentation tests.
#[cfg(all(doctest, feature = "files"))]
#[doc = include_str!("../../../docs/files.md")]
struct Files;

#[cfg(test)]
mod tests {
    #[test]
    fn the_guide_shows_the_example_that_is_run() {
        let guide = include_str!("../../../docs/gpu.md");
        let example = include_str!("../examples/own_kernel.rs");
        assert!(guide.contains(&format!("```rust,no_run\n{example}```")));
    }
}
