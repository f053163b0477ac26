//! The assembly tree of a model and the rounds in which it is worked through: what the
//! divide-and-conquer algorithm does when, whatever the shape of the model.
//!
//! # What is assembled
//! The bodies are laid out in **paths**, each running from a head towards the tips ([`Path`]). On
//! each path some bodies are **cut** in two halves at their centre of mass: heavy ones, so that
//! every piece has heavy ends, about every [`window`](ScheduleOptions::window)-th. A [`Chunk`] runs
//! from one cut to the next: the outboard half of a cut body (at a head: the joint that carries the
//! path), the joints and bodies between, the inboard half of the next cut body (at a tail: the last
//! body, whole). A [`Join`] puts two neighbours together, half to half, rigidly. A finished path is
//! free at its tail: to the body that carries it, it is no more than an inertia and a bias force,
//! which are added to the body's own (**rake**) before the body becomes part of a chunk, half of
//! them to either half of a cut body. A body takes up to two rakes itself; a [`RakeSum`] adds two up
//! where there are more. So no node ever has more than two handles.
//!
//! # Arrays
//! Every result has a [`NodeId`]: chunks first, then joins, then rake sums, each kind in the order of
//! its rounds. A round is therefore one contiguous slice of each kind ([`Schedule::chunks_in`],
//! [`joins_in`](Schedule::joins_in), [`sums_in`](Schedule::sums_in)), its results are contiguous too,
//! and whatever an entry of a round reads was written in an earlier one. A path of m chunks has m
//! chunks and m - 1 joins, and nothing points anywhere but by index. Bodies are read through
//! [`Schedule::order`], in which each path is contiguous and a chunk is a range.
//!
//! # What a solver does with it
//! Up, round by round: rake sums add pairs (Ia, pa). Chunks run the articulated-body recursion from
//! their outboard end, carrying the tip wrench as six right-hand sides: (IA, pA, B, C, d), where the
//! tip moves as a2 = B'a + C f2 + d; an inner chunk ends by inverting IA of the outboard half of its
//! inboard cut body (Phi11 = IA^-1, Phi12 = IA^-1 B, Phi22 = C + B'Phi12), a head's chunk behind its
//! first joint, as (Ia, pa, B, C, d). Chunk and rake data are wanted in the working precision,
//! joins may do with less. A join of A and B has W = (Phi22 + Phi11)^-1, where a head's A has
//! C for Phi22, and a head again as its result: Ia + B W B', pa + B W (d - b1), only positive
//! semidefinite additions. A path's last node is its [`root`](Path::root): (Ia, pa), where the path
//! hangs from a body, and the solution itself, where it hangs from the world, whose acceleration
//! is known. Down, rounds in reverse: a join hands each half its wrench; a chunk, knowing its two
//! ends, finds the accelerations of its bodies, which the paths raked onto them start from. Rotations
//! and velocities run over the same rounds: up, relative ones from handle to handle; down, absolute.
//!
//! # Depth
//! Where a path goes on and where it ends decides the depth. A path that ends at a body rakes all of
//! its children, at one round; a path that goes on spares the chunk a rake but must join what lies
//! beyond, and what lies before, one after the other; an estimate of both says which is sooner. Joins are
//! made as soon as two neighbours are there, sums soonest first. Chains and stars take log2 n rounds
//! and a few. Of all families of trees tested the worst, forks of unequal halves on stems of 13,
//! take 2 log2 n rounds at a million bodies in windows of 8; in windows of 1, 2 log2 n + 8.

mod build;
mod cuts;
mod draw;
mod paths;

use crate::{BodyId, Model, ModelError};
use core::ops::Range;

/// How bodies are gathered into chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScheduleOptions {
    /// Joints of a chunk on average: the bodies to be cut are about so far apart. 1 gives the classic
    /// tree, in which each leaf is a joint between two halves of bodies.
    pub window: usize,
    /// Most joints of a chunk, at least `window`; exceeded only where there is no body with mass to
    /// be cut.
    pub longest_chunk: usize,
}

impl ScheduleOptions {
    /// A window, and chunks at most half as long again.
    #[must_use]
    pub const fn with_window(window: usize) -> Self {
        Self {
            window,
            longest_chunk: window.saturating_add(window / 2),
        }
    }
}

impl Default for ScheduleOptions {
    /// Windows of 8.
    fn default() -> Self {
        Self::with_window(8)
    }
}

/// Names a result: of a chunk, a join or a rake sum. See the module's documentation for the order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

impl NodeId {
    /// The index as the size type of slices.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Node<'a> {
    /// A leaf.
    Chunk(&'a Chunk),
    /// Two neighbours on a path.
    Join(&'a Join),
    /// Two rakes onto one body.
    RakeSum(&'a RakeSum),
}

/// A run of joints and bodies along a path that one lane assembles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// First and one past the last of the bodies in [`Schedule::order`] whose joints it holds, inboard
    /// first.
    pub(crate) start: u32,
    pub(crate) end: u32,
    /// Whether it starts at a path's joint to its carrier, not at a cut body.
    pub head: bool,
    /// Whether it ends with a path's last body, whole and free, not at a cut body.
    pub tail: bool,
}

impl Chunk {
    /// The bodies whose joints it holds, as a range of [`Schedule::order`], inboard first.
    #[must_use]
    pub const fn joints(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// Two neighbours on a path, put together at the halves of one cut body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Join {
    /// The part towards the path's head.
    pub inboard: NodeId,
    /// The part towards its tail.
    pub outboard: NodeId,
    /// The cut body.
    pub cut: BodyId,
}

/// Two rakes onto one body, added up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RakeSum {
    /// Roots of paths, or rake sums.
    pub parts: [NodeId; 2],
    /// The body that carries them.
    pub body: BodyId,
}

/// A run of bodies, each the parent of the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Path {
    pub(crate) start: u32,
    pub(crate) end: u32,
    /// The body that carries the first one; none for the world.
    pub carrier: Option<BodyId>,
    /// The node that assembles it all.
    pub root: NodeId,
}

impl Path {
    /// Its bodies, as a range of [`Schedule::order`].
    #[must_use]
    pub const fn bodies(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// The assembly tree of a model, in rounds. Constant; made once for a model.
///
/// ```
/// use vertebra_assembly::generate::{self, Rod};
/// use vertebra_assembly::schedule::{Schedule, ScheduleOptions};
///
/// let model = generate::random_chain(1024, &Rod::default(), 7)?;
/// let schedule = Schedule::new(&model, &ScheduleOptions::default())?;
/// // Chunks of about 8 in one round, then joins two by two.
/// assert_eq!(schedule.joins().len(), schedule.chunks().len() - 1);
/// assert_eq!(schedule.round_count(), 8);
/// # Ok::<(), vertebra_assembly::ModelError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Schedule {
    order: Vec<BodyId>,
    paths: Vec<Path>,
    chunks: Vec<Chunk>,
    joins: Vec<Join>,
    sums: Vec<RakeSum>,
    /// Where each round's slice starts, one entry more than rounds.
    chunk_rounds: Vec<usize>,
    join_rounds: Vec<usize>,
    sum_rounds: Vec<usize>,
    /// Where each body's rakes start in `rakes`, one entry more than bodies.
    rake_starts: Vec<u32>,
    rakes: Vec<NodeId>,
}

impl Schedule {
    /// The schedule of a model; bodies to be cut are chosen by their masses.
    ///
    /// # Errors
    /// [`ModelError::BadParameter`] if the window is zero or longer than the longest chunk.
    pub fn new(model: &Model, options: &ScheduleOptions) -> Result<Self, ModelError> {
        let bodies = model.bodies();
        let parents: Vec<_> = bodies.iter().map(|body| body.parent).collect();
        let masses: Vec<_> = bodies.iter().map(|body| body.mass.mass).collect();
        Self::of_tree(&parents, &masses, options)
    }

    /// The schedule of a tree or forest given by each body's parent, with the weights \[kg\] by which
    /// bodies to be cut are chosen: those of zero never are. In O(n log n), without recursion.
    ///
    /// # Errors
    /// [`ModelError::BadParameter`] as [`new`](Self::new), and if a parent does not stand before its
    /// child or a weight is negative or NaN; [`ModelError::WrongLength`] if the lengths differ;
    /// [`ModelError::TooLarge`].
    pub fn of_tree(
        parents: &[Option<BodyId>],
        weights: &[f64],
        options: &ScheduleOptions,
    ) -> Result<Self, ModelError> {
        check(parents, weights, options)?;
        Ok(build::schedule(parents, weights, options))
    }

    /// Number of rounds; each needs only what earlier ones have done.
    #[must_use]
    pub fn round_count(&self) -> usize {
        self.chunk_rounds.len() - 1
    }

    /// All bodies, path by path.
    #[must_use]
    pub fn order(&self) -> &[BodyId] {
        &self.order
    }

    /// The paths, by the index of their first bodies.
    #[must_use]
    pub fn paths(&self) -> &[Path] {
        &self.paths
    }

    /// The chunks, by rounds.
    #[must_use]
    pub fn chunks(&self) -> &[Chunk] {
        &self.chunks
    }

    /// The joins, by rounds.
    #[must_use]
    pub fn joins(&self) -> &[Join] {
        &self.joins
    }

    /// The rake sums, by rounds.
    #[must_use]
    pub fn sums(&self) -> &[RakeSum] {
        &self.sums
    }

    /// The slice of [`chunks`](Self::chunks) to be assembled in a round below
    /// [`round_count`](Self::round_count).
    #[must_use]
    pub fn chunks_in(&self, round: usize) -> Range<usize> {
        self.chunk_rounds[round]..self.chunk_rounds[round + 1]
    }

    /// The slice of [`joins`](Self::joins) of a round.
    #[must_use]
    pub fn joins_in(&self, round: usize) -> Range<usize> {
        self.join_rounds[round]..self.join_rounds[round + 1]
    }

    /// The slice of [`sums`](Self::sums) of a round.
    #[must_use]
    pub fn sums_in(&self, round: usize) -> Range<usize> {
        self.sum_rounds[round]..self.sum_rounds[round + 1]
    }

    /// What is raked onto a body: at most two roots of paths or rake sums.
    #[must_use]
    pub fn rakes(&self, body: BodyId) -> &[NodeId] {
        let start = self.rake_starts[body.index()] as usize;
        &self.rakes[start..self.rake_starts[body.index() + 1] as usize]
    }

    /// Number of nodes of all kinds.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.chunks.len() + self.joins.len() + self.sums.len()
    }

    /// What a node is, if there is one of that number.
    #[must_use]
    pub fn node(&self, id: NodeId) -> Option<Node<'_>> {
        let index = id.index();
        let (chunks, joins) = (self.chunks.len(), self.joins.len());
        if index < chunks {
            return Some(Node::Chunk(&self.chunks[index]));
        }
        if index < chunks + joins {
            return Some(Node::Join(&self.joins[index - chunks]));
        }
        self.sums.get(index - chunks - joins).map(Node::RakeSum)
    }

    /// The round in which a node is made, if there is one of that number.
    #[must_use]
    pub fn round_of(&self, id: NodeId) -> Option<usize> {
        let (chunks, joins) = (self.chunks.len(), self.joins.len());
        let (starts, index) = match self.node(id)? {
            Node::Chunk(_) => (&self.chunk_rounds, id.index()),
            Node::Join(_) => (&self.join_rounds, id.index() - chunks),
            Node::RakeSum(_) => (&self.sum_rounds, id.index() - chunks - joins),
        };
        Some(starts.partition_point(|&start| start <= index) - 1)
    }

    /// The node of a chunk, by its index in [`chunks`](Self::chunks).
    #[must_use]
    pub fn chunk_node(&self, index: usize) -> NodeId {
        node_id(index)
    }

    /// The node of a join, by its index in [`joins`](Self::joins).
    #[must_use]
    pub fn join_node(&self, index: usize) -> NodeId {
        node_id(self.chunks.len() + index)
    }

    /// The node of a rake sum, by its index in [`sums`](Self::sums).
    #[must_use]
    pub fn sum_node(&self, index: usize) -> NodeId {
        node_id(self.chunks.len() + self.joins.len() + index)
    }

    /// The cut body where a chunk starts, with its outboard half; none at a path's head.
    #[must_use]
    pub fn inboard_cut(&self, chunk: &Chunk) -> Option<BodyId> {
        (!chunk.head).then(|| self.order[chunk.start as usize - 1])
    }

    /// The cut body where a chunk ends, with its inboard half; none at a path's tail.
    #[must_use]
    pub fn outboard_cut(&self, chunk: &Chunk) -> Option<BodyId> {
        (!chunk.tail).then(|| self.order[chunk.end as usize - 1])
    }

    /// The bodies that make up a chunk, inboard first, each with the share of its inertia, bias and
    /// rakes that goes into this one: 1, or 1/2 of a cut body.
    pub fn members(&self, chunk: &Chunk) -> impl Iterator<Item = (BodyId, f64)> + '_ {
        let Chunk { head, tail, .. } = *chunk;
        let last = chunk.end as usize - 1;
        let inner = chunk.joints().map(move |at| {
            let share = if at == last && !tail { 0.5 } else { 1.0 };
            (self.order[at], share)
        });
        let first = (!head).then(|| (self.order[chunk.start as usize - 1], 0.5));
        first.into_iter().chain(inner)
    }
}

fn check(
    parents: &[Option<BodyId>],
    weights: &[f64],
    options: &ScheduleOptions,
) -> Result<(), ModelError> {
    let bad = |parameter, requirement| {
        Err(ModelError::BadParameter {
            parameter,
            requirement,
        })
    };
    if options.window == 0 {
        return bad("window", "at least 1");
    }
    if options.longest_chunk < options.window {
        return bad("longest_chunk", "at least the window");
    }
    if weights.len() != parents.len() {
        return Err(ModelError::WrongLength {
            quantity: "weights",
            expected: parents.len(),
            found: weights.len(),
        });
    }
    // A body has fewer than four nodes, and a node's number 32 bits.
    let limit = (u32::MAX / 4) as usize;
    if parents.len() > limit {
        return Err(ModelError::TooLarge {
            what: "bodies",
            requested: parents.len(),
            limit,
        });
    }
    let stands_before = |(child, parent): (usize, &Option<BodyId>)| {
        parent.is_none_or(|parent| parent.index() < child)
    };
    if !parents.iter().enumerate().all(stands_before) {
        return bad("parents", "before their children");
    }
    if !weights.iter().all(|&weight| weight >= 0.0) {
        return bad("weights", "zero or above");
    }
    Ok(())
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "indices fit 32 bits: the number of bodies is checked"
)]
const fn small(index: usize) -> u32 {
    index as u32
}

const fn node_id(index: usize) -> NodeId {
    NodeId(small(index))
}
