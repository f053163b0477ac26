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
        "a step of {step} s is too long for the implicit midpoint rule: {iterations} iterations left a change of {change:.0e}; take smaller steps"
    )]
    NotConverged {
        /// Length of the step \[s\].
        step: f64,
        /// Iterations made.
        iterations: u32,
        /// Change of the rates by the last one, as part of the largest rate.
        change: f64,
    },
    /// A tolerance that no method meets here.
    #[error(
        "a relative error of {tolerance:e} was asked for, and the best method reached {error:.0e} (residual {residual:.0e}): accept more, or make the model's masses and lengths less uneven"
    )]
    ToleranceMissed {
        /// Forward error asked for.
        tolerance: f64,
        /// Estimated forward error of the best solution.
        error: f64,
        /// Its residual of the bodies' own equations.
        residual: f64,
    },
    /// A tolerance that is no number or below what f64 can hold.
    #[error("a tolerance of {tolerance:e} cannot be met in f64: ask for 2.3e-16 or more")]
    ToleranceRange {
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
    /// A model with loops or couplings, given to what simulates trees alone.
    #[error(
        "the model closes loops or couples joints (`{name}`), which {by} does not do: use the articulated-body algorithm on the processor without a tolerance, or take them out of the model"
    )]
    LoopsUnavailable {
        /// The first loop or coupling.
        name: String,
        /// What does not do it.
        by: &'static str,
    },
    /// A loop that cannot be closed.
    #[error(
        "`{name}` stays open by {violation:.0e} of its size at t = {time} s; the state before is kept: take smaller steps, or start from a state in which the loop can close"
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
        /// Why.
        source: Box<Self>,
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
    /// One of several steps failed.
    #[error("step {step} of {count} (counted from 0) failed: {source}")]
    Step {
        /// Steps taken before it.
        step: usize,
        /// Steps asked for.
        count: usize,
        /// Why.
        source: Box<Self>,
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
    /// Another number of states or forces than a batch has items.
    #[cfg(feature = "gpu")]
    #[error("the batch has {expected} items, {given} were given: give one for each")]
    ItemCount {
        /// Items of the batch.
        expected: usize,
        /// How many were given.
        given: usize,
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
