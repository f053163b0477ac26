//! Solutions of a GPU to a tolerance: the cheapest precisions and corrections that are expected to meet it, the
//! next dearer ones where they do not.
//!
//! A correction on a device takes out what its joins have rounded and what uneven masses cost inside its chunks
//! (`docs/gpu.md`); how large it was, the device does not say. The error is measured where nothing of the device takes
//! part (`judge.rs`).

use super::judge::Judge;
use crate::solver::MOST_SWEEPS;
use crate::tolerance::{ROUNDING, check_tolerance, hidden_errors};
use crate::{Achieved, Algorithm, Error, Forces, Precision, Refinement, cost, gpu};
use vertebra_assembly::{Model, State};

/// Steps between two measurements of the error: one takes about as long as 18 steps of 2048 bodies on an H100.
const EVERY: usize = 64;

/// Measurements that a rung has to pass before the next cheaper one, which failed before, is tried again: making one and
/// coming back from it takes as long as some hundred steps, of the 4096 in between a few hundredths.
const RETRY: usize = 64;

/// Precisions of chunks and of joins, and corrections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rung {
    chunks: Precision,
    tree: Precision,
    sweeps: usize,
}

impl Rung {
    /// The error that its factors make likely.
    fn likely(self) -> f64 {
        let joins = ROUNDING * self.tree.epsilon();
        let corrected = (0..self.sweeps).fold(joins, |error, _| error * joins);
        corrected.max(ROUNDING * self.chunks.epsilon())
    }

    fn cost(self, bodies: usize) -> f64 {
        cost::gpu_refined_step(bodies, self.chunks, self.tree, self.sweeps)
    }

    /// Options of a GPU of this rung, otherwise as they were.
    pub(super) const fn options(self, own: &gpu::Options) -> gpu::Options {
        gpu::Options {
            chunks: Some(self.chunks),
            tree: Some(self.tree),
            sweeps: self.sweeps,
            ..*own
        }
    }
}

/// The rungs that a device has, from the cheapest to the dearest, and the one in use.
#[derive(Debug)]
pub(super) struct Exact {
    tolerance: f64,
    rungs: Vec<Rung>,
    at: usize,
    /// Steps until the error is measured again.
    left: usize,
    /// Measurements that the rung in use has passed.
    passed: usize,
    achieved: Option<Achieved>,
}

impl Exact {
    /// # Errors
    /// [`Error::ToleranceRange`].
    pub(super) fn new(model: &Model, has_f64: bool, tolerance: f64) -> Result<Self, Error> {
        use Precision::{F32, F64};
        check_tolerance(tolerance)?;
        let rung = |chunks, tree, sweeps| Rung {
            chunks,
            tree,
            sweeps,
        };
        let mut rungs = vec![rung(F32, F32, 0)];
        if has_f64 {
            rungs.extend((0..=MOST_SWEEPS).map(|sweeps| rung(F64, F32, sweeps)));
            rungs.extend((0..=1).map(|sweeps| rung(F64, F64, sweeps)));
        }
        let bodies = model.bodies().len();
        // What costs more than f64 throughout, corrected, gains nothing on it.
        let dearest = rung(F64, F64, 1).cost(bodies);
        // The processor judges by factors in f64.
        let is_judged = hidden_errors(model) * F64.epsilon() <= tolerance;
        rungs
            .retain(|rung| is_judged && rung.likely() <= tolerance && rung.cost(bodies) <= dearest);
        rungs.sort_by(|a, b| a.cost(bodies).total_cmp(&b.cost(bodies)));
        Ok(Self {
            tolerance,
            rungs,
            at: 0,
            left: 0,
            passed: 0,
            achieved: None,
        })
    }

    /// The rung in use; none where the device has none left.
    pub(super) fn rung(&self) -> Option<Rung> {
        self.rungs.get(self.at).copied()
    }

    /// Goes on to the next rung, to be measured before it is used.
    pub(super) const fn climb(&mut self) {
        self.at += 1;
        self.passed = 0;
        self.measure_next();
    }

    /// Goes back to the next cheaper rung where it is time to, to be measured before it is used; says whether it does.
    pub(super) const fn descend(&mut self) -> bool {
        if self.at == 0 || self.passed < RETRY {
            return false;
        }
        self.at -= 1;
        self.passed = 0;
        self.measure_next();
        true
    }

    /// Has the error measured before the next step.
    pub(super) const fn measure_next(&mut self) {
        self.left = 0;
    }

    pub(super) const fn is_due(&self) -> bool {
        self.left == 0
    }

    /// Steps to the next measurement.
    pub(super) const fn steps_to_next(&self) -> usize {
        self.left
    }

    pub(super) const fn count(&mut self, steps: usize) {
        self.left = self.left.saturating_sub(steps);
    }

    pub(super) const fn achieved(&self) -> Option<&Achieved> {
        self.achieved.as_ref()
    }

    /// That the device has no rung left.
    pub(super) fn missed(&self) -> Error {
        let none = f64::INFINITY;
        let (error, residual) = (self.achieved).map_or((none, none), |a| (a.error, a.residual));
        Error::ToleranceMissed {
            tolerance: self.tolerance,
            error,
            residual,
        }
    }

    /// Measures the error of accelerations of the rung in use; says whether the tolerance is met.
    pub(super) fn measure(
        &mut self,
        problem: (&Model, &State, &Forces),
        qdd: &[f64],
        judge: &mut Judge,
    ) -> Result<bool, Error> {
        let Some(rung) = self.rung() else {
            return Ok(false);
        };
        let Refinement {
            residual,
            change: error,
        } = judge.measure(problem, qdd)?;
        self.achieved = Some(Achieved {
            algorithm: Algorithm::Dca,
            precision: rung.chunks,
            tree: rung.tree,
            sweeps: u32::try_from(rung.sweeps).unwrap_or(u32::MAX),
            residual,
            error,
        });
        self.left = EVERY;
        self.passed += 1;
        Ok(error <= self.tolerance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Workspace;
    use vertebra_assembly::generate::{self, Rod};

    /// Cheap where that is enough; none where f64 is not.
    #[test]
    fn rungs_are_those_that_may_do() {
        use Precision::{F32, F64};
        let model = generate::random_chain(100, &Rod::default(), 1).unwrap();
        let first = |tolerance| {
            let exact = Exact::new(&model, true, tolerance).unwrap();
            (exact.rung()).map(|rung| (rung.chunks, rung.tree, rung.sweeps))
        };
        assert_eq!(first(1e-3), Some((F32, F32, 0)));
        assert_eq!(first(1e-9), Some((F64, F64, 0)));
        assert_eq!(first(1e-14), None);
        let single = Exact::new(&model, false, 1e-9).unwrap();
        assert!(single.rung().is_none());
        for tolerance in [0.0, f64::NAN, f64::INFINITY] {
            assert!(Exact::new(&model, true, tolerance).is_err());
        }
        let mut exact = Exact::new(&model, true, 1e-9).unwrap();
        let mut rungs = Vec::new();
        while let Some(rung) = exact.rung() {
            rungs.push((rung.tree, rung.sweeps));
            exact.climb();
        }
        assert_eq!(rungs, [(F64, 0), (F64, 1)]);
    }

    /// A cheaper rung is tried again after a while, the cheapest has none.
    #[test]
    fn cheaper_rungs_are_tried_again() {
        let model = generate::random_chain(20, &Rod::default(), 1).unwrap();
        let mut exact = Exact::new(&model, true, 1e-9).unwrap();
        let (state, forces) = (State::random(&model, 2), Forces::none(&model));
        let mut workspace = Workspace::new(&model, Precision::F64);
        let qdd = (crate::aba(&model, &state, &forces, &mut workspace).unwrap()).to_vec();
        let mut judge = Judge::new(&model).unwrap();
        for climbed in [1, 0] {
            let dearer = exact.rung();
            if climbed == 1 {
                exact.climb();
            }
            for _ in 0..RETRY {
                assert!(!exact.descend());
                let problem = (&model, &state, &forces);
                assert!(exact.measure(problem, &qdd, &mut judge).unwrap());
                exact.count(EVERY);
            }
            assert_eq!(exact.descend(), climbed == 1);
            assert_eq!(exact.rung(), dearer);
        }
    }
}
