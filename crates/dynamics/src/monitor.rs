//! Accuracy watched while a model moves.

use crate::{Error, Refinement};
use core::fmt;
use core::ops::ControlFlow;

/// What a check of the accelerations has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// Steps taken under the monitor before it \[count\].
    pub step: u64,
    /// Time of the state \[s\].
    pub time: f64,
    /// Residual, and the error that one correction shows.
    pub found: Refinement,
}

/// What is called with each check that found too large an error.
type OnExceeded = Box<dyn FnMut(&Check) -> ControlFlow<()> + Send + Sync>;

/// Watches the error of the accelerations in a [`Simulation`](crate::Simulation), on the CPU and on GPUs: a check
/// every so many steps, and what was worse than wanted.
///
/// What it finds is an estimate: of solutions in f32 that are [corrected](crate::SolverOptions::sweeps) on the CPU at most half of their error,
/// and too little of light bodies between ball joints (`docs/accuracy.md`).
///
/// ```
/// use vertebra_assembly::{State, generate};
/// use vertebra_dynamics::{Monitor, Precision, Simulation};
///
/// let model = generate::random_chain(16, &generate::Rod::default(), 7)?;
/// let state = State::random(&model, 1);
/// let mut simulation = Simulation::new(model)?
///     .with_precision(Precision::F32)?
///     .with_monitor(Monitor::every(10, 1e-9))?;
/// simulation.set_state(state)?;
/// for _ in 0..100 {
///     simulation.step(1e-3)?;
/// }
/// let monitor = simulation.monitor().ok_or("none")?;
/// assert_eq!((monitor.checks(), monitor.exceeded()), (10, 10)); // f32 has not 1e-9
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// It can tell at once, and end the run before the step that would be taken with so large an error:
///
/// ```
/// # use vertebra_assembly::{State, generate};
/// # use vertebra_dynamics::{Error, Monitor, Precision, Simulation};
/// use std::ops::ControlFlow;
///
/// # let model = generate::random_chain(16, &generate::Rod::default(), 7)?;
/// # let state = State::random(&model, 1);
/// let monitor = Monitor::every(10, 1e-9).on_exceeded(|check| {
///     println!("step {}, {} s: error {:e}", check.step, check.time, check.found.change);
///     ControlFlow::Break(()) // or Continue
/// });
/// let mut simulation = Simulation::new(model)?
///     .with_precision(Precision::F32)?
///     .with_monitor(monitor)?;
/// simulation.set_state(state)?;
/// let stopped = simulation.steps(1e-3, 100).unwrap_err();
/// println!("{stopped}");
/// let mut simulation = simulation.with_precision(Precision::F64)?; // from where it stopped
/// simulation.steps(1e-3, 100)?;
/// # Ok::<(), Error>(())
/// ```
pub struct Monitor {
    every: u64,
    tolerance: f64,
    on_exceeded: Option<OnExceeded>,
    steps: u64,
    checks: u64,
    exceeded: u64,
    latest: Option<Check>,
    worst: Option<Check>,
}

impl Monitor {
    /// A check every so many steps (none means every one) against a forward error from 2.3e-16, the last bit of f64, to
    /// less than 1. Of another tolerance [`Simulation::with_monitor`](crate::Simulation::with_monitor) tells.
    #[must_use]
    pub const fn every(steps: u64, tolerance: f64) -> Self {
        Self {
            every: if steps == 0 { 1 } else { steps },
            tolerance,
            on_exceeded: None,
            steps: 0,
            checks: 0,
            exceeded: 0,
            latest: None,
            worst: None,
        }
    }

    /// Calls a function with each check that found a larger error than the tolerance, before the step is taken.
    /// By `ControlFlow::Break` it is not taken: the run ends with [`Error::Inexact`] and the state is the one
    /// that was checked; what is asked for next is checked again.
    #[must_use]
    pub fn on_exceeded(
        mut self,
        call: impl FnMut(&Check) -> ControlFlow<()> + Send + Sync + 'static,
    ) -> Self {
        self.on_exceeded = Some(Box::new(call));
        self
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

    pub(crate) const fn tolerance(&self) -> f64 {
        self.tolerance
    }

    pub(crate) const fn is_due(&self) -> bool {
        self.steps.is_multiple_of(self.every)
    }

    /// Steps from here to the next check, after the one that may be due now.
    #[cfg(feature = "gpu")]
    pub(crate) fn steps_to_next(&self) -> usize {
        usize::try_from(self.every - self.steps % self.every).unwrap_or(usize::MAX)
    }

    pub(crate) const fn count(&mut self, steps: u64) {
        self.steps += steps;
    }

    /// Keeps what a check has found.
    ///
    /// # Errors
    /// [`Error::Inexact`] if the run is to end there.
    pub(crate) fn record(&mut self, time: f64, found: Refinement) -> Result<(), Error> {
        let check = Check {
            step: self.steps,
            time,
            found,
        };
        self.checks += 1;
        let worst = |worst: Check| found.change > worst.found.change;
        if self.worst.is_none_or(worst) {
            self.worst = Some(check);
        }
        self.latest = Some(check);
        if found.change <= self.tolerance {
            return Ok(());
        }
        self.exceeded += 1;
        match self.on_exceeded.as_mut().map(|call| call(&check)) {
            Some(ControlFlow::Break(())) => Err(Error::Inexact {
                time,
                error: found.change,
                tolerance: self.tolerance,
            }),
            _ => Ok(()),
        }
    }
}

impl fmt::Debug for Monitor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Monitor")
            .field("every", &self.every)
            .field("tolerance", &self.tolerance)
            .field("on_exceeded", &self.on_exceeded.is_some())
            .field("steps", &self.steps)
            .field("checks", &self.checks)
            .field("exceeded", &self.exceeded)
            .field("latest", &self.latest)
            .field("worst", &self.worst)
            .finish()
    }
}
