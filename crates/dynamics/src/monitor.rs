//! Accuracy watched while a model moves.

use crate::Refinement;

/// What a check of the accelerations has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// Time of the state \[s\].
    pub time: f64,
    /// Residual, and the error that one correction shows.
    pub found: Refinement,
}

/// Watches the error of the accelerations in a [`Simulation`](crate::Simulation): a check every so many
/// steps, and what was worse than wanted.
///
/// ```
/// use vertebra_assembly::generate;
/// use vertebra_dynamics::{Monitor, Precision, Simulation};
///
/// let model = generate::random_chain(16, &generate::Rod::default(), 7)?;
/// let mut simulation = Simulation::new(model)?
///     .with_precision(Precision::F32)?
///     .with_monitor(Monitor::every(10, 1e-9));
/// for _ in 0..100 {
///     simulation.step(1e-3)?;
/// }
/// let monitor = simulation.monitor().ok_or("none")?;
/// assert_eq!((monitor.checks(), monitor.exceeded()), (10, 10)); // f32 has not 1e-9
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor {
    every: u64,
    tolerance: f64,
    steps: u64,
    checks: u64,
    exceeded: u64,
    latest: Option<Check>,
    worst: Option<Check>,
}

impl Monitor {
    /// A check every so many steps (none means every one) against a forward error.
    #[must_use]
    pub const fn every(steps: u64, tolerance: f64) -> Self {
        Self {
            every: if steps == 0 { 1 } else { steps },
            tolerance,
            steps: 0,
            checks: 0,
            exceeded: 0,
            latest: None,
            worst: None,
        }
    }

    /// Checks so far \[count\].
    #[must_use]
    pub const fn checks(&self) -> u64 {
        self.checks
    }

    /// Checks that found a larger error than the tolerance \[count\].
    #[must_use]
    pub const fn exceeded(&self) -> u64 {
        self.exceeded
    }

    /// The latest check.
    #[must_use]
    pub const fn latest(&self) -> Option<&Check> {
        self.latest.as_ref()
    }

    /// The check that found the largest error.
    #[must_use]
    pub const fn worst(&self) -> Option<&Check> {
        self.worst.as_ref()
    }

    pub(crate) const fn is_due(&self) -> bool {
        self.steps.is_multiple_of(self.every)
    }

    pub(crate) const fn count(&mut self) {
        self.steps += 1;
    }

    pub(crate) fn record(&mut self, time: f64, found: Refinement) {
        let check = Check { time, found };
        self.checks += 1;
        self.exceeded += u64::from(found.change > self.tolerance);
        let worst = |worst: Check| found.change > worst.found.change;
        if self.worst.is_none_or(worst) {
            self.worst = Some(check);
        }
        self.latest = Some(check);
    }
}
