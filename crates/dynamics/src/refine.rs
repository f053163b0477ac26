//! Iterative refinement: solutions corrected by what they leave of the bodies' own equations.

use crate::{Error, Forces, Solved};
use vertebra_spatial::{Force, Motion, Real, RigidInertia, Vec3, vec3};

/// What one [`refine`] found and did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Refinement {
    /// Residual of the bodies' own equations **before** the correction: of each body, largest entry of
    /// what its Newton-Euler equation or its joint's match of accelerations leaves, over the largest
    /// entry of any term, in the model's units. Weights and the acceleration of gravity are among the terms, though
    /// solutions leave gravity out: of what only falls all others are rounding.
    pub residual: f64,
    /// The correction: max |change of qdd| / max |qdd|, 1 at most. Where loads balance, max |qdd| is replaced
    /// as in [`forward_error`](crate::forward_error).
    ///
    /// It estimates the forward error before the correction, as long as that is more than rounding: the
    /// correction errs itself, by as large a part as the factors do. The error after it is about this times
    /// the ratio of this to the change before. Neither says anything below what rounding makes of the
    /// residual, some tens of epsilons: there a change is as much noise as correction, and errors stay
    /// while changes may vanish.
    pub change: f64,
}

/// Corrects a solution once: evaluates the residual of the bodies' own equations in the precision of
/// the solver (chunks, if it is [`dca`](crate::dca)) and solves for what is missing with the factors
/// at hand, one sweep of vectors up and down. `forces` are those of the solution.
///
/// Where the factors are coarser than that precision (a tree in f32 over chunks in f64), or have lost
/// digits to uneven masses, each call gains the digits that the factors have, until the rounding of the
/// residual is reached. The second call for a solution also takes out what rounding has added up, from body to
/// body, of where these are, and costs about a solution more than the others; it ends at a hundredth of what the
/// best of solvers do (`docs/accuracy.md`).
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
/// assert!(first.change < 1e-9 && second.change < 1e-12);
/// assert_eq!(workspace.joint_accelerations()?.len(), 512);
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
pub fn refine(forces: &Forces, solved: &mut impl Solved) -> Result<Refinement, Error> {
    solved.refine(forces)
}

/// What a sweep through the factors starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Loads {
    /// What is left of the bodies' equations: a correction.
    Left,
    /// The same, once the [drift](crate::drift) of the bodies' places has been taken out.
    Settled,
    /// Forces as large as the rounding of those equations, which are gone through on the way: this finds the residual too. Their
    /// response is what no correction in this precision can take out, however small a residual it leaves: the condition
    /// of the problem in its own equations, times epsilon. The solution stays as it was.
    Rounding,
}

impl Loads {
    /// Those of a correction that takes the drift out or does not.
    pub(crate) const fn of_correction(settles: bool) -> Self {
        if settles { Self::Settled } else { Self::Left }
    }
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

/// The largest entries of the terms of an equation, of moments and of forces (or of the two parts of
/// accelerations).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size<T> {
    angular: T,
    linear: T,
}

impl<T: Real> Size<T> {
    pub(crate) const ZERO: Self = Self {
        angular: T::ZERO,
        linear: T::ZERO,
    };

    #[inline(always)]
    pub(crate) fn of_force(f: Force<T>) -> Self {
        Self {
            angular: largest(f.angular),
            linear: largest(f.linear),
        }
    }

    #[inline(always)]
    pub(crate) fn of_motion(m: Motion<T>) -> Self {
        Self::of_force(Force::new(m.angular, m.linear))
    }

    /// Of the terms that an inertia's moment about its axes is summed from, which cancel for thin bodies
    /// in world axes.
    #[inline(always)]
    pub(crate) fn of_turning(inertia: &RigidInertia<T>, a: Motion<T>) -> Self {
        Self {
            angular: inertia.rotational.trace() * largest(a.angular),
            linear: T::ZERO,
        }
    }

    /// The larger of two, each part by itself.
    #[inline(always)]
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            angular: larger(self.angular, other.angular),
            linear: larger(self.linear, other.linear),
        }
    }

    /// The same beside a weight.
    #[inline(always)]
    pub(crate) fn or_weight(self, weight: T) -> Self {
        Self {
            linear: larger(self.linear, weight),
            ..self
        }
    }

    /// What is left of an equation, whose size is `rest`, as part of the largest of its terms; all of it where that has
    /// overflowed, beside which nothing is known.
    #[inline(always)]
    pub(crate) fn left(self, rest: Self) -> f64 {
        let (rest, terms) = (
            larger(rest.angular, rest.linear),
            larger(self.angular, self.linear),
        );
        if !terms.is_finite() {
            return 1.0;
        }
        if rest == T::ZERO {
            return 0.0;
        }
        (rest / terms).to_f64()
    }

    /// The same of an equation of which one term is not among those measured, and may be all there is.
    #[inline(always)]
    pub(crate) fn leaving(self, rest: Force<T>) -> f64 {
        let rest = Self::of_force(rest);
        self.or(rest).left(rest)
    }

    /// A force as large as the rounding of an equation of this size, its signs those of a body's
    /// number and the same in every run.
    #[inline]
    pub(crate) fn rounding(self, body: usize) -> Force<T> {
        // Weyl's sequence of the golden section, of whose bits no six neighbours are alike for long.
        let bits = (body as u64)
            .wrapping_add(1)
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            >> 32;
        let [n, f] = [self.angular, self.linear].map(|size| size * T::EPSILON);
        let signed = |size: T, bit: u32| if bits >> bit & 1 == 0 { size } else { -size };
        Force::new(
            vec3(signed(n, 0), signed(n, 1), signed(n, 2)),
            vec3(signed(f, 3), signed(f, 4), signed(f, 5)),
        )
    }
}

#[inline(always)]
fn larger<T: Real>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

#[inline(always)]
fn largest<T: Real>(v: Vec3<T>) -> T {
    let Vec3 { x, y, z } = v.abs();
    larger(larger(x, y), z)
}
