//! What can go wrong in a computation.

use thiserror::Error;
use vertebra_assembly::ModelError;

/// Why a computation was refused or given up. State and forces are as they were before the call; the
/// workspace offers no results until a call succeeds.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A state that does not fit the model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A workspace made for another model.
    #[error(
        "the workspace was made for another model (`{workspace}`) than this (`{model}`; clones of one model share workspaces, two built alike do not): make one for it"
    )]
    WrongWorkspace {
        /// Model the workspace was made for.
        workspace: String,
        /// Model of the call.
        model: String,
    },
    /// A result that was not computed since the state was last changed.
    #[error("{what} have not been computed; call `{remedy}` first")]
    NotComputed {
        /// Which result.
        what: &'static str,
        /// The function that computes it.
        remedy: &'static str,
    },
    /// A body that is not in the model.
    #[error("the model `{model}` has no body number {body}; take ids from the model itself")]
    UnknownBody {
        /// Name of the model.
        model: String,
        /// Index of the body.
        body: usize,
    },
    /// Gravity of its own for a body that is carried by another.
    #[error(
        "gravity is that of a whole articulation: set it for `{root}`, which carries `{body}`, or for its root"
    )]
    NotARoot {
        /// The body that was named.
        body: String,
        /// The body that carries it.
        root: String,
    },
    /// A force, acceleration or step size that is not a finite number.
    #[error("{quantity} of `{element}` is not finite ({value}); give a number")]
    NonFiniteInput {
        /// Which number.
        quantity: &'static str,
        /// Body or object it belongs to.
        element: String,
        /// The number.
        value: f64,
    },
    /// A motor on a joint of other freedoms than it drives.
    #[error(
        "the joint of body `{body}` has no motor of this kind: `set_motor` drives joints of one freedom, `set_spherical_motor` spherical ones; use joint forces on others"
    )]
    NoMotor {
        /// The body whose joint it is.
        body: String,
    },
    /// A motor with an impossible number.
    #[error(
        "{quantity} in the joint of body `{body}` is {value}: give a finite number, gains and limits not below zero, quaternions of length 1"
    )]
    BadMotor {
        /// The body whose joint it is.
        body: String,
        /// Which number.
        quantity: &'static str,
        /// The number.
        value: f64,
    },
    /// Elements whose forces jump, in an integrator that takes them as smooth.
    #[error(
        "the joint of body `{body}` has friction or a hard stop, whose forces jump, and {integrator:?} steps take forces as smooth: choose SemiImplicitEuler, a soft stop, or a model without them (`Model::bare`)"
    )]
    RoughElement {
        /// The body whose joint it is.
        body: String,
        /// The integrator.
        integrator: crate::Integrator,
    },
    /// A step back in time with elements in the joints.
    #[error(
        "a step of {step} s with springs, dampers or motors in joints, such as that of `{body}`: their steps are implicit and go forward only; give a positive step, or a model without them (`Model::bare`)"
    )]
    StepBack {
        /// The first body with such a joint.
        body: String,
        /// Length of the step \[s\].
        step: f64,
    },
    /// The inertia that a joint moves vanishes in this position and precision.
    #[error(
        "the joint of body `{body}` moves no inertia in this position, to working precision: give the body more inertia, avoid aligned joint axes, or compute in f64"
    )]
    SingularJoint {
        /// The body whose joint it is.
        body: String,
    },
    /// The two halves of a body that the assembly tree cuts cannot be put together.
    #[error(
        "body `{body}` cannot be cut and joined again in {precision}: choose a more precise tree, longer chunks, or ABA"
    )]
    Unjoined {
        /// The cut body.
        body: String,
        /// Precision of the tree.
        precision: crate::Precision,
    },
    /// An assembly tree asked to be more precise than its chunks.
    #[error(
        "a tree in {tree} over chunks in {chunks} gains nothing: choose at most {chunks} for the tree"
    )]
    TreePrecision {
        /// Precision of the chunks.
        chunks: crate::Precision,
        /// Precision asked for the tree.
        tree: crate::Precision,
    },
    /// The result left the range of numbers.
    #[error(
        "{quantity} of body `{body}` overflowed at t = {time} s; the state before is kept: take smaller steps, or compute in f64"
    )]
    Overflow {
        /// Which result.
        quantity: &'static str,
        /// The first body concerned.
        body: String,
        /// Time of the state \[s\].
        time: f64,
    },
    /// An implicit step whose equations are not solved.
    #[error(
        "a step of {step} s is too long for the implicit midpoint rule: {iterations} iterations left a change of {change:.0e}; take smaller steps{}",
        .near.as_deref().map_or_else(String::new, |name| format!(
            ", or use Runge-Kutta: `{name}` may be near a position in which it jams or may move in another way"
        ))
    )]
    NotConverged {
        /// Length of the step \[s\].
        step: f64,
        /// Iterations made.
        iterations: u32,
        /// Change of the rates by the last one, as part of the largest rate.
        change: f64,
        /// The loop or coupling that is nearest to a singular position, if there are any.
        near: Option<String>,
    },
    /// A tolerance that no method meets here.
    #[error(
        "a relative error of {tolerance:e} was asked for, and the best method reached {error:.0e} (residual {residual:.0e}): accept more; masses and lengths of very different sizes cost digits, and so do closed loops near positions in which they jam or may move in another way"
    )]
    ToleranceMissed {
        /// Forward error asked for.
        tolerance: f64,
        /// Estimated forward error of the best solution.
        error: f64,
        /// Its residual of the bodies' own equations.
        residual: f64,
    },
    /// A check of a [`Monitor`](crate::Monitor) that found too large an error, where that ends the run.
    #[error(
        "at {time} s the accelerations have a relative error of {error:.2e} where {tolerance:e} was wanted: ask for more precision or a tolerance, or let the monitor go on"
    )]
    Inexact {
        /// Time of the state \[s\].
        time: f64,
        /// Forward error, as one correction shows it.
        error: f64,
        /// Forward error wanted.
        tolerance: f64,
    },
    /// A tolerance that is no number, below what f64 can hold, or as large as what it is a part of.
    #[error(
        "{tolerance:e} is no tolerance: ask for a number from 2.3e-16, the last bit of f64, to less than 1, at which no digit is right"
    )]
    ToleranceRange {
        /// Forward error asked for.
        tolerance: f64,
    },
    /// Something asked for beside a tolerance that decides it.
    #[error(
        "{what} beside a tolerance of {tolerance:e}, which decides that itself: give one of the two (`Simulation::with_solver`)"
    )]
    DecidedByTolerance {
        /// What else was asked for.
        what: &'static str,
        /// Forward error asked for.
        tolerance: f64,
    },
    /// The joint-space inertia is not positive definite to working precision.
    #[error(
        "the {dofs} x {dofs} mass matrix is not positive definite in working precision (pivot {pivot}); use ABA"
    )]
    SingularMassMatrix {
        /// Its order.
        dofs: usize,
        /// The pivot that is not positive.
        pivot: usize,
    },
    /// A model with loops or couplings, given to what computes trees alone.
    #[error(
        "the model closes loops or couples joints (`{name}`), which {by} does not do: {remedy}"
    )]
    LoopsUnavailable {
        /// The first loop or coupling.
        name: String,
        /// What does not do it.
        by: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// Loops that are solved together and too many for a GPU.
    #[cfg(feature = "gpu")]
    #[error(
        "`{name}` and the loops and couplings that move the same joints have {rows} equations together, and a GPU solves {fit} of them: simulate on `Device::cpu()`, or take loops out of the model"
    )]
    TooManyLoops {
        /// The first of them.
        name: String,
        /// Their equations.
        rows: usize,
        /// How many equations a GPU solves together.
        fit: usize,
    },
    /// A step that would start from an open loop.
    #[error(
        "`{name}` is open by {violation:.0e} of its size at t = {time} s, more than the {limit:e} that a step closes by itself: close it first (`Simulation::close_loops`), or set a state in which it is closed"
    )]
    LoopOpen {
        /// The loop or coupling.
        name: String,
        /// How far it is open, over the loop's size.
        violation: f64,
        /// What a step starts from at most.
        limit: f64,
        /// Time of the state \[s\].
        time: f64,
    },
    /// A loop that cannot be closed.
    #[error(
        "`{name}` stays open by {violation:.0e} of its size at t = {time} s; the state before is kept: what it connects may be too far apart to meet, or a position in which it jams be in between. Set a state nearer to a closed one, check the frames of the loop, or take smaller steps"
    )]
    LoopNotClosed {
        /// The loop or coupling.
        name: String,
        /// What is left, over the loop's size.
        violation: f64,
        /// Time of the state \[s\].
        time: f64,
    },
    /// Points that cannot accelerate in every direction have no operational-space inertia.
    #[error(
        "the points have no operational-space inertia: that of body `{body}` cannot accelerate in direction {direction} (0 to 2 turn about x, y, z, 3 to 5 move along) independently of the others; ask for the inverse, or for fewer points"
    )]
    SingularOperationalInertia {
        /// The body whose point it is.
        body: String,
        /// The first direction that depends on those before.
        direction: usize,
    },
    /// A dense matrix that is too large, or for which there is no memory.
    #[error(
        "a dense {dofs} x {dofs} matrix does not fit: at most {limit} degrees of freedom, given the memory; use ABA, which needs none"
    )]
    DenseTooLarge {
        /// Its order.
        dofs: usize,
        /// The largest order allowed.
        limit: usize,
    },
    /// A batch with another number of states than of forces.
    #[error("{states} states, but forces for {forces}: give as many of one as of the other")]
    BatchLengths {
        /// Number of states.
        states: usize,
        /// Number of forces.
        forces: usize,
    },
    /// An item of a batch that could not be computed.
    #[error(
        "item {item} of the batch failed, one of {failed} of {count}: {source}; the others can be read from the batch"
    )]
    Item {
        /// Index of the first item that failed.
        item: usize,
        /// How many failed.
        failed: usize,
        /// How many there are.
        count: usize,
        /// Why. Said in the message, so that it is no `Error::source` (which the raw name keeps it from being).
        r#source: Box<Self>,
    },
    /// A precision that a device does not compute in.
    #[error(
        "{adapter} does not compute in {precision}: choose {} for it, or simulate on the CPU",
        crate::Precision::F32
    )]
    PrecisionUnavailable {
        /// Name of the adapter.
        adapter: String,
        /// The precision asked for.
        precision: crate::Precision,
    },
    /// More corrections of every solution than are made, or, on a GPU, any of chunks in f32.
    #[error(
        "{sweeps} corrections of every solution in {chunks}: ask for {} at most, on a GPU for none unless chunks are in {}",
        crate::solver::MOST_SWEEPS,
        crate::Precision::F64
    )]
    Sweeps {
        /// Corrections of each solution asked for.
        sweeps: usize,
        /// Precision of the solutions, of divide and conquer that of the chunks.
        chunks: crate::Precision,
    },
    /// One of several steps failed.
    #[error("step {step} of {count} (counted from 0) failed: {source}")]
    Step {
        /// Steps taken before it.
        step: usize,
        /// Steps asked for.
        count: usize,
        /// Why. Said in the message, so that it is no `Error::source` (which the raw name keeps it from being).
        r#source: Box<Self>,
    },
    /// The GPU.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] vertebra_gpu::Error),
    /// An item that is not in the batch.
    #[error("the batch has no item {item}; it has {count}")]
    UnknownItem {
        /// Index asked for.
        item: usize,
        /// Number of items.
        count: usize,
    },
    /// An integrator whose steps are not taken on a GPU.
    #[cfg(feature = "gpu")]
    #[error(
        "{integrator:?} steps are not taken on a GPU: choose another integrator, or the processor"
    )]
    IntegratorUnavailable {
        /// The integrator.
        integrator: crate::Integrator,
    },
    /// A joint that no kernel computes.
    #[cfg(feature = "gpu")]
    #[error(
        "the joint of body `{body}` is a screw, which a GPU does not compute in {by}: {remedy}"
    )]
    JointUnavailable {
        /// The body whose joint it is.
        body: String,
        /// What does not compute it.
        by: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// An element in a joint that no kernel computes.
    #[cfg(feature = "gpu")]
    #[error(
        "the joint of body `{body}` has a range, damping, friction, a rotor, a motor or a spring, which a GPU does not compute in {by}: {remedy}, or simulate without all of these (`Model::bare`)"
    )]
    ElementUnavailable {
        /// The body whose joint it is.
        body: String,
        /// What does not compute it.
        by: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// Inertia of a freedom's own that no kernel computes.
    #[cfg(feature = "gpu")]
    #[error(
        "`Forces::joint_inertia` gives the joint of body `{body}` an inertia of its own, which a GPU does not compute in {by}: {remedy}, or leave it at 0"
    )]
    JointInertiaUnavailable {
        /// The body whose joint it is.
        body: String,
        /// What does not compute it.
        by: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// Another number of states or forces than a batch has items.
    #[cfg(feature = "gpu")]
    #[error("the batch has {expected} items, {given} were given: give one for each")]
    ItemCount {
        /// Items of the batch.
        expected: usize,
        /// How many were given.
        given: usize,
    },
    /// What simulations on a GPU do not do.
    #[error("{what} is not available on a GPU: {remedy}")]
    UnavailableOnGpu {
        /// What was asked for.
        what: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// A GPU asked of a build that has none.
    #[error(
        "this build does not compute on a GPU: enable the feature `gpu`, or use `Device::cpu()`"
    )]
    GpuNotBuilt,
    /// A model that does not fit a device.
    #[error(
        "a model of {bodies} bodies needs more memory for its {what} than the device's {limit} = {available}: one like it of {fit} bodies fits; make several models, or simulate on the CPU"
    )]
    ModelTooLarge {
        /// Bodies of the model.
        bodies: usize,
        /// What needs the most: bodies or closed loops.
        what: &'static str,
        /// Bodies that would fit, of a model like it.
        fit: usize,
        /// The limit.
        limit: &'static str,
        /// Its value \[byte\].
        available: u64,
    },
    /// A batch that does not fit a device.
    #[cfg(feature = "gpu")]
    #[error(
        "{items} items need more than the device's {limit} = {available}: {fit} fit; make several batches"
    )]
    BatchTooLarge {
        /// Items asked for.
        items: usize,
        /// Items that fit.
        fit: usize,
        /// The limit.
        limit: &'static str,
        /// Its value \[byte\].
        available: u64,
    },
}
