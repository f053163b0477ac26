//! Work on the chunks and joins of a round, on one thread or several, with the same results.

use super::plan::Extent;
use crate::residual::worst_of;
use core::ops::Range;

/// Fewest chunks or joins that are worth handing to another thread.
const GRAIN: usize = 8;

/// Fewest bodies for which threads are worth waking at all.
pub(crate) const PARALLEL_BODIES: usize = 2048;

/// What a piece of work comes to.
pub(super) trait Outcome: Send {
    /// Of no work at all.
    const DONE: Self;

    /// Of two pieces, whichever was first.
    fn and(self, other: Self) -> Self;
}

impl Outcome for () {
    const DONE: Self = ();

    fn and(self, (): Self) -> Self {}
}

/// The larger of two residuals.
impl Outcome for f64 {
    const DONE: Self = 0.0;

    fn and(self, other: Self) -> Self {
        worst_of(self, other)
    }
}

/// What can go wrong, and the slot concerned.
#[derive(Clone, Copy, Debug)]
pub(super) enum Fault {
    /// A joint moves no inertia.
    Singular(usize),
    /// A body cannot be cut, or its halves cannot be joined, in the precision at hand.
    Unjoined(usize),
    /// An acceleration is not finite.
    Overflow(usize),
}

impl Fault {
    pub(super) const fn slot(self) -> usize {
        match self {
            Self::Singular(slot) | Self::Unjoined(slot) | Self::Overflow(slot) => slot,
        }
    }
}

/// Of several faults the one of the first slot is reported.
impl Outcome for Result<(), Fault> {
    const DONE: Self = Ok(());

    fn and(self, other: Self) -> Self {
        match (self, other) {
            (Err(a), Err(b)) => Err(if b.slot() < a.slot() { b } else { a }),
            (Err(fault), Ok(())) | (Ok(()), Err(fault)) => Err(fault),
            (Ok(()), Ok(())) => Ok(()),
        }
    }
}

/// A run of chunks' own shares of some arrays.
pub(super) trait Divide: Sized + Send {
    /// Those of the chunks before and from the one whose arrays start at `at`, counted from here.
    fn divide(self, at: &Extent) -> (Self, Self);
}

/// An array with one entry a slot.
pub(super) struct Slots<'a, X>(pub(super) &'a mut [X]);

impl<X: Send> Divide for Slots<'_, X> {
    fn divide(self, at: &Extent) -> (Self, Self) {
        let (own, rest) = self.0.split_at_mut(at.slot);
        (Self(own), Self(rest))
    }
}

impl<A: Divide, B: Divide> Divide for (A, B) {
    fn divide(self, at: &Extent) -> (Self, Self) {
        let ((a, more_a), (b, more_b)) = (self.0.divide(at), self.1.divide(at));
        ((a, b), (more_a, more_b))
    }
}

/// Runs a function on each of a range of chunks with its own share. `share` starts with the first
/// one's.
pub(super) fn divide<S: Divide, R: Outcome>(
    parallel: bool,
    extents: &[Extent],
    chunks: Range<usize>,
    mut share: S,
    run: &(impl Fn(usize, S) -> R + Sync),
) -> R {
    if parallel && chunks.len() >= 2 * GRAIN {
        let middle = usize::midpoint(chunks.start, chunks.end);
        let (before, after) = share.divide(&extents[middle].beyond(&extents[chunks.start]));
        return both(
            || divide(parallel, extents, chunks.start..middle, before, run),
            || divide(parallel, extents, middle..chunks.end, after, run),
        );
    }
    let mut outcome = R::DONE;
    for chunk in chunks {
        let (own, rest) = share.divide(&extents[chunk + 1].beyond(&extents[chunk]));
        outcome = outcome.and(run(chunk, own));
        share = rest;
    }
    outcome
}

/// Runs a function on each entry of a slice and its index, which counts from `range.start`.
pub(super) fn for_each<T: Send, R: Outcome>(
    parallel: bool,
    range: Range<usize>,
    entries: &mut [T],
    run: &(impl Fn(usize, &mut T) -> R + Sync),
) -> R {
    if parallel && range.len() >= 2 * GRAIN {
        let middle = range.len() / 2;
        let (before, after) = entries.split_at_mut(middle);
        let at = range.start + middle;
        return both(
            || for_each(parallel, range.start..at, before, run),
            || for_each(parallel, at..range.end, after, run),
        );
    }
    let mut outcome = R::DONE;
    for (index, entry) in range.zip(entries) {
        outcome = outcome.and(run(index, entry));
    }
    outcome
}

fn both<R: Outcome>(left: impl FnOnce() -> R + Send, right: impl FnOnce() -> R + Send) -> R {
    #[cfg(feature = "rayon")]
    let (left, right) = rayon::join(left, right);
    #[cfg(not(feature = "rayon"))]
    let (left, right) = (left(), right());
    left.and(right)
}
