//! Timing of one call: a warm-up, then samples until the budget is spent.

use std::convert::Infallible;
use std::hint::black_box;
use std::time::{Duration, Instant};

use crate::interrupt::Interrupt;

/// Fewest samples whose median and spread are worth anything.
const FEWEST: usize = 3;
/// A call at least this long is a sample by itself; shorter ones are repeated, as reading the clock
/// would weigh in.
const LONG_CALL: Duration = Duration::from_micros(20);
/// Repeated calls fill at least this much of a sample.
const BATCH: Duration = Duration::from_micros(200);

/// Times of the samples of one measurement \[s\]; finite, with minimum <= first quartile <= median
/// <= third quartile <= maximum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Median \[s\]; the mean of the middle two when their number is even.
    pub median_s: f64,
    /// Fastest sample \[s\].
    pub min_s: f64,
    /// First quartile \[s\]: a quarter of the samples are faster.
    pub q1_s: f64,
    /// Third quartile \[s\]: a quarter of the samples are slower.
    pub q3_s: f64,
    /// Slowest sample \[s\].
    pub max_s: f64,
    /// Number of samples.
    pub samples: usize,
}

impl Timing {
    /// Summarises samples \[s\]; `None` when there are none or one is not finite.
    #[must_use]
    pub fn from_samples(mut samples: Vec<f64>) -> Option<Self> {
        if !samples.iter().all(|sample| sample.is_finite()) {
            return None;
        }
        samples.sort_by(f64::total_cmp);
        Some(Self {
            median_s: quartile(&samples, 2)?,
            min_s: *samples.first()?,
            q1_s: quartile(&samples, 1)?,
            q3_s: quartile(&samples, 3)?,
            max_s: *samples.last()?,
            samples: samples.len(),
        })
    }
}

/// The first, second or third quartile of sorted samples, between the two nearest in proportion
/// (R. J. Hyndman and Y. Fan, "Sample quantiles in statistical packages", The American Statistician
/// 50(4), 1996, definition 7); `None` when there are no samples.
fn quartile(sorted: &[f64], number: usize) -> Option<f64> {
    let quarters = number * sorted.len().checked_sub(1)?;
    let below = *sorted.get(quarters / 4)?;
    let above = sorted.get(quarters / 4 + 1).copied().unwrap_or(below);
    Some(below + (quarters % 4) as f64 / 4.0 * (above - below))
}

/// How long to measure.
///
/// Sampling ends at `max_time` once `min_samples` are taken, and at `max_samples` in any case. A
/// call so slow that `min_samples` of it would not fit in `max_time` is sampled until `max_time`,
/// but three times at least.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Samples to take even when that needs more than `max_time`; three at least.
    pub min_samples: usize,
    /// Samples after which no more are taken: the slowest of very many tells of the machine, not of
    /// the method.
    pub max_samples: usize,
    /// Time for the samples together.
    pub max_time: Duration,
}

impl Default for Budget {
    fn default() -> Self {
        Self {
            min_samples: 10,
            max_samples: 100,
            max_time: Duration::from_secs(2),
        }
    }
}

impl Budget {
    /// A budget to see that everything runs; too short for numbers to publish.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            min_samples: 10,
            max_samples: 20,
            max_time: Duration::from_millis(100),
        }
    }

    /// Samples that must be taken of a call of this length.
    fn required(&self, call: Duration) -> usize {
        let wanted = self.min_samples.max(FEWEST);
        let fits = call.as_secs_f64() * wanted as f64 <= self.max_time.as_secs_f64();
        if fits { wanted } else { FEWEST }
    }
}

/// Times `call`: one warm-up call, then samples within `budget`.
///
/// A call shorter than 20 us is repeated until a sample lasts 200 us, and the sample divided by the
/// repetitions. `None` when `interrupt` was raised before three samples were taken.
pub fn sample<T>(
    budget: &Budget,
    interrupt: &Interrupt,
    mut call: impl FnMut() -> T,
) -> Option<Timing> {
    match try_sample(budget, interrupt, || Ok::<T, Infallible>(call())) {
        Ok(timing) => timing,
    }
}

/// [`sample`] for a call that can fail.
///
/// # Errors
/// The first error of `call`, which ends the measurement.
pub fn try_sample<T, E>(
    budget: &Budget,
    interrupt: &Interrupt,
    mut call: impl FnMut() -> Result<T, E>,
) -> Result<Option<Timing>, E> {
    let mut time = |repetitions: u32| -> Result<Duration, E> {
        let start = Instant::now();
        for _ in 0..repetitions {
            black_box(call()?);
        }
        Ok(start.elapsed())
    };

    let warm_up = time(1)?;
    let mut repetitions = 1;
    // The first call also fills caches and allocates: a call that took 2 ms then may be a short one.
    if warm_up < 10 * BATCH {
        let mut elapsed = time(1)?;
        if elapsed < LONG_CALL {
            while elapsed < BATCH {
                repetitions *= 2;
                elapsed = time(repetitions)?;
            }
        }
    }

    let required = budget.required(warm_up);
    let mut samples = Vec::new();
    let start = Instant::now();
    while samples.len() < required
        || (samples.len() < budget.max_samples && start.elapsed() < budget.max_time)
    {
        if interrupt.requested() {
            break;
        }
        samples.push(time(repetitions)?.as_secs_f64() / f64::from(repetitions));
    }
    Ok(if samples.len() < FEWEST {
        None
    } else {
        Timing::from_samples(samples)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread::sleep;

    #[test]
    fn the_median_and_quartiles_of_odd_and_even_counts() {
        let odd = Timing::from_samples(vec![3.0, 1.0, 2.0]).unwrap();
        assert_eq!(
            (odd.median_s, odd.min_s, odd.max_s, odd.samples),
            (2.0, 1.0, 3.0, 3)
        );
        let even = Timing::from_samples(vec![4.0, 1.0, 2.0, 8.0]).unwrap();
        assert_eq!(
            (even.median_s, even.min_s, even.max_s, even.samples),
            (3.0, 1.0, 8.0, 4)
        );
        assert_eq!((odd.q1_s, odd.q3_s), (1.5, 2.5));
        assert_eq!((even.q1_s, even.q3_s), (1.75, 5.0));
        let five = Timing::from_samples(vec![5.0, 90.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!((five.q1_s, five.median_s, five.q3_s), (2.0, 3.0, 5.0));
        let one = Timing::from_samples(vec![7.0]).unwrap();
        assert_eq!((one.q1_s, one.median_s, one.q3_s), (7.0, 7.0, 7.0));
        assert_eq!(Timing::from_samples(vec![]), None);
        assert_eq!(Timing::from_samples(vec![1.0, f64::NAN]), None);
    }

    #[test]
    fn short_calls_are_repeated_and_long_ones_are_not() {
        let budget = Budget {
            min_samples: 10,
            max_samples: 10,
            max_time: Duration::ZERO,
        };
        let mut calls = 0_u64;
        let timing = sample(
            &Budget {
                max_time: Duration::from_secs(1),
                ..budget
            },
            &Interrupt::default(),
            || {
                calls += 1;
                calls
            },
        )
        .unwrap();
        assert_eq!(timing.samples, 10);
        assert!(
            calls > 1000,
            "{calls} calls of nothing cannot fill ten samples of 200 us"
        );
        assert!(
            timing.min_s > 0.0
                && timing.min_s <= timing.q1_s
                && timing.q1_s <= timing.median_s
                && timing.median_s <= timing.q3_s
                && timing.q3_s <= timing.max_s
        );

        let mut calls = 0;
        let timing = sample(&budget, &Interrupt::default(), || {
            calls += 1;
            sleep(Duration::from_millis(3));
        })
        .unwrap();
        assert_eq!(
            (timing.samples, calls),
            (FEWEST, 1 + FEWEST),
            "no time at all leaves the three samples"
        );
        assert!(
            timing.min_s >= 3e-3,
            "a sample of a 3 ms sleep took {} s",
            timing.min_s
        );
    }

    #[test]
    fn at_least_min_samples_of_a_call_that_fits() {
        let budget = Budget {
            min_samples: 12,
            max_samples: 100,
            max_time: Duration::from_secs(1),
        };
        assert_eq!(budget.required(Duration::from_millis(80)), 12);
        assert_eq!(budget.required(Duration::from_millis(90)), FEWEST);
        assert_eq!(
            Budget {
                min_samples: 1,
                ..budget
            }
            .required(Duration::from_millis(1)),
            FEWEST
        );
    }

    #[test]
    fn an_interrupt_ends_the_samples_and_an_error_the_measurement() {
        let budget = Budget {
            min_samples: 50,
            max_samples: 50,
            max_time: Duration::from_secs(10),
        };
        let interrupt = Interrupt::default();
        let mut calls = 0;
        let timing = sample(&budget, &interrupt, || {
            calls += 1;
            sleep(Duration::from_millis(3));
            if calls == 6 {
                interrupt.request();
            }
        });
        assert_eq!(timing.map(|timing| timing.samples), Some(5));
        assert_eq!(sample(&budget, &interrupt, || ()), None);

        let mut calls = 0;
        let failed = try_sample(&budget, &Interrupt::default(), || {
            calls += 1;
            sleep(Duration::from_millis(3));
            if calls == 4 { Err("broken") } else { Ok(()) }
        });
        assert_eq!((failed, calls), (Err("broken"), 4));
    }
}
