//! Iterative refinement: solutions corrected by what they leave of the bodies' own equations.

use crate::{Error, Forces, Solved};
use vertebra_spatial::Real;

/// What one [`refine`] found and did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Refinement {
    /// Residual of the bodies' own equations **before** the correction: of each body, largest entry of
    /// what its Newton-Euler equation or its joint's match of accelerations leaves, over the largest
    /// entry of any term, in the model's units.
    pub residual: f64,
    /// The correction: max |change of qdd| / max |qdd|, 1 at most, which is the forward error before but
    /// for the error of the correction itself. As long as corrections become smaller, the error after one is
    /// at most about this times the ratio of this to the one before.
    pub change: f64,
}

/// Corrects a solution once: evaluates the residual of the bodies' own equations in the precision of
/// the solver (chunks, if it is [`dca`](crate::dca)) and solves for what is missing with the factors
/// at hand, one sweep of vectors up and down. `forces` are those of the solution.
///
/// Where the factors are coarser than that precision (a tree in f32 over chunks in f64), or have lost
/// digits to uneven masses, each call gains the digits that the factors have, until the rounding of the
/// residual is reached; two end as well as the best of solvers or better (`docs/accuracy.md`).
///
/// Memory is taken on the first call for a workspace and never again.
///
/// # Errors
/// [`Error::NotComputed`] if nothing has been solved, [`Error`] if the forces do not fit the model,
/// [`Error::Overflow`] if the correction is not finite; the workspace then offers no results.
///
/// ```
/// use vertebra_assembly::{State, generate};
/// use vertebra_dynamics::{DcaOptions, DcaWorkspace, Forces, Precision, dca, refine};
///
/// let model = generate::random_chain(512, &generate::Rod::default(), 7)?;
/// let options = DcaOptions { tree: Precision::F32, ..DcaOptions::default() };
/// let mut workspace = DcaWorkspace::new(&model, &options)?;
/// let (state, forces) = (State::random(&model, 8), Forces::none(&model));
/// dca(&model, &state, &forces, &mut workspace)?;
/// let first = refine(&forces, &mut workspace)?;
/// let second = refine(&forces, &mut workspace)?;
/// assert!(second.change < 1e-3 * first.change);
/// assert_eq!(workspace.joint_accelerations()?.len(), 512);
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
pub fn refine(forces: &Forces, solved: &mut impl Solved) -> Result<Refinement, Error> {
    solved.refine(forces)
}

/// A largest change as part of the largest value; all of it, where the change is larger than what it
/// leaves, or nothing is left.
pub(crate) fn relative(change: f64, largest: f64) -> f64 {
    if change == 0.0 {
        return 0.0;
    }
    // `min` takes the number of the two, should both have overflowed.
    (change / largest.max(change)).min(1.0)
}

/// Takes the larger absolute value, entry by entry.
#[inline(always)]
pub(crate) fn enlarge<T: Real>(size: &mut [T; 6], term: [T; 6]) {
    for (size, entry) in size.iter_mut().zip(term) {
        *size = larger(*size, entry.abs());
    }
}

#[inline(always)]
fn larger<T: Real>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

#[inline(always)]
fn largest<T: Real>([a, b, c, x, y, z]: &[T; 6]) -> T {
    larger(larger(larger(*a, *x), larger(*b, *y)), larger(*c, *z))
}

/// What is left of an equation, as part of the largest of its terms, whose entries are at most `size`.
#[inline(always)]
pub(crate) fn left<T: Real>(rest: [T; 6], size: &[T; 6]) -> f64 {
    let rest = largest(&rest.map(T::abs));
    if rest == T::ZERO {
        return 0.0;
    }
    (rest / largest(size)).to_f64()
}
