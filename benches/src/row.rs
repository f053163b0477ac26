//! One measurement: what ran where, how long it took, and how wrong the result was.

mod host;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::measure::Timing;
pub use host::Host;

/// One measurement, as one flat object in `results.json` and one line in `results.csv`.
///
/// At least one error figure is set ([`Row::validate`]): `error_forward`, `error_residual`, or both
/// of `false_pairs` and `missed_pairs`. A time without one says nothing about whether the right
/// thing was computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the algorithm that was timed.
    pub method: String,
    /// Floating-point type of the computation: `"f32"`, `"f64"`, `"f64/f32"` where an assembly tree
    /// has chunks in one and joins in the other, or `"-"` where none describes it.
    pub precision: String,
    /// Kind of device that computed, `"cpu"`.
    pub backend: String,
    /// Model name of the processor that computed, `"unknown"` where the system does not tell.
    pub device: String,
    /// Operating system and architecture.
    pub os: String,
    /// Threads that computed \[count\].
    pub threads: usize,
    /// Size of the problem, in units of [`size_unit`](Self::size_unit).
    pub size: u64,
    /// What `size` counts, in the plural: `"bodies"`, `"triangle pairs"`.
    pub size_unit: String,
    /// Median over the samples of the time of one call \[s\].
    pub time_median_s: f64,
    /// Time of the fastest sample \[s\].
    pub time_min_s: f64,
    /// First quartile of the samples \[s\]; absent in results of earlier versions.
    pub time_q1_s: Option<f64>,
    /// Third quartile of the samples \[s\]; absent in results of earlier versions.
    pub time_q3_s: Option<f64>,
    /// Time of the slowest sample \[s\].
    pub time_max_s: f64,
    /// Samples taken, after a warm-up \[count\].
    pub samples: usize,
    /// Largest difference from the reference result, divided by the largest reference value \[1\].
    pub error_forward: Option<f64>,
    /// Largest amount by which the result fails an equation it should satisfy, divided by the sum of
    /// the absolute values of that equation's terms, or by the largest of them \[1\].
    pub error_residual: Option<f64>,
    /// Pairs reported that do not intersect in exact arithmetic \[count\].
    pub false_pairs: Option<u64>,
    /// Pairs not reported that intersect in exact arithmetic \[count\].
    pub missed_pairs: Option<u64>,
    /// Pairs reported \[count\].
    pub hits: Option<u64>,
    /// Time that the source published for this problem, on the source's hardware \[s\].
    pub reference_time_s: Option<f64>,
    /// Anything a reader of the row should know, empty for nothing.
    pub note: String,
    /// Version of the benchmark.
    pub version: String,
    /// Commit the benchmark was built from and its date, where the build knew it: `1a2b3c4d5e6f of 2026-01-31`,
    /// with `-dirty` where it had changes.
    pub commit: Option<String>,
}

impl Row {
    /// A row of this build on this machine: backend `"cpu"`, one thread, and no error figure yet.
    ///
    /// The rest is filled in by struct update:
    ///
    /// ```
    /// # use vertebra_bench::{measure::Timing, row::Row};
    /// # let timing = Timing::from_samples(vec![1e-3]).unwrap();
    /// let row = Row {
    ///     error_forward: Some(1e-14),
    ///     ..Row::new("chain", "aba", "f64", 128, "bodies", &timing)
    /// };
    /// row.validate().unwrap();
    /// ```
    #[must_use]
    pub fn new(
        scenario: &str,
        method: &str,
        precision: &str,
        size: u64,
        size_unit: &str,
        timing: &Timing,
    ) -> Self {
        let host = Host::detect();
        Self {
            scenario: scenario.to_owned(),
            method: method.to_owned(),
            precision: precision.to_owned(),
            backend: "cpu".to_owned(),
            device: host.device,
            os: host.os,
            threads: 1,
            size,
            size_unit: size_unit.to_owned(),
            time_median_s: timing.median_s,
            time_min_s: timing.min_s,
            time_q1_s: Some(timing.q1_s),
            time_q3_s: Some(timing.q3_s),
            time_max_s: timing.max_s,
            samples: timing.samples,
            error_forward: None,
            error_residual: None,
            false_pairs: None,
            missed_pairs: None,
            hits: None,
            reference_time_s: None,
            note: String::new(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: option_env!("VERTEBRA_COMMIT").map(str::to_owned),
        }
    }

    /// The times between which the middle half of the samples lies \[s\], or all of them in a row
    /// that has no quartiles.
    #[must_use]
    pub fn middle_half_s(&self) -> (f64, f64) {
        (
            self.time_q1_s.unwrap_or(self.time_min_s),
            self.time_q3_s.unwrap_or(self.time_max_s),
        )
    }

    /// Pairs that are wrong either way, when both kinds were counted \[count\].
    #[must_use]
    pub fn wrong_pairs(&self) -> Option<u64> {
        Some(self.false_pairs?.saturating_add(self.missed_pairs?))
    }

    /// Checks that the row may be written.
    ///
    /// # Errors
    /// When a name is empty, a number is not finite or negative, the times are not ordered and
    /// positive, no sample was taken, or no error figure is set.
    pub fn validate(&self) -> Result<(), RowError> {
        let case = || Case {
            scenario: self.scenario.clone(),
            method: self.method.clone(),
            size: self.size,
        };
        for (field, text) in [
            ("scenario", &self.scenario),
            ("method", &self.method),
            ("precision", &self.precision),
            ("backend", &self.backend),
            ("device", &self.device),
            ("size_unit", &self.size_unit),
        ] {
            if text.trim().is_empty() {
                return Err(RowError::Empty {
                    case: case(),
                    field,
                });
            }
        }
        for (field, value) in [
            ("time_median_s", Some(self.time_median_s)),
            ("time_min_s", Some(self.time_min_s)),
            ("time_q1_s", self.time_q1_s),
            ("time_q3_s", self.time_q3_s),
            ("time_max_s", Some(self.time_max_s)),
            ("error_forward", self.error_forward),
            ("error_residual", self.error_residual),
            ("reference_time_s", self.reference_time_s),
        ] {
            if let Some(value) = value.filter(|value| !value.is_finite() || *value < 0.0) {
                return Err(RowError::NotANumber {
                    case: case(),
                    field,
                    value,
                });
            }
        }
        let (q1, q3) = self.middle_half_s();
        let times = [self.time_min_s, q1, self.time_median_s, q3, self.time_max_s];
        if !times.is_sorted() || self.time_min_s <= 0.0 || self.reference_time_s == Some(0.0) {
            return Err(RowError::Times { case: case() });
        }
        if self.samples == 0 || self.threads == 0 || self.size == 0 {
            return Err(RowError::Zero { case: case() });
        }
        if self.error_forward.is_none()
            && self.error_residual.is_none()
            && self.wrong_pairs().is_none()
        {
            return Err(RowError::NoErrorFigure { case: case() });
        }
        Ok(())
    }
}

/// The row an error is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the algorithm.
    pub method: String,
    /// Size of the problem.
    pub size: u64,
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} / {} at size {}",
            self.scenario, self.method, self.size
        )
    }
}

/// Why a row may not be written.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RowError {
    /// A name is missing.
    #[error(
        "{case}: `{field}` is empty; give it a name, or \"-\" or \"unknown\" where there is none"
    )]
    Empty {
        /// The row.
        case: Case,
        /// The empty field.
        field: &'static str,
    },
    /// A figure is NaN, infinite or negative.
    #[error(
        "{case}: `{field}` is {value}; it must be finite and not negative: see what the method returned"
    )]
    NotANumber {
        /// The row.
        case: Case,
        /// The field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The times contradict each other.
    #[error(
        "{case}: times must be positive, with minimum <= first quartile <= median <= third quartile <= maximum; take them from `measure::sample`"
    )]
    Times {
        /// The row.
        case: Case,
    },
    /// A count that cannot be zero is.
    #[error("{case}: samples, threads and size must be at least 1")]
    Zero {
        /// The row.
        case: Case,
    },
    /// A speed without an accuracy.
    #[error(
        "{case}: no error figure; set `error_forward` or `error_residual`, or both `false_pairs` and `missed_pairs`"
    )]
    NoErrorFigure {
        /// The row.
        case: Case,
    },
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A valid row with three equal digits of spread around `median_s` \[s\].
    pub(crate) fn row(
        scenario: &str,
        method: &str,
        precision: &str,
        size: u64,
        median_s: f64,
    ) -> Row {
        let timing =
            Timing::from_samples(vec![0.98 * median_s, median_s, 1.03 * median_s]).unwrap();
        Row {
            device: "Test CPU".to_owned(),
            error_forward: Some(1e-13),
            ..Row::new(scenario, method, precision, size, "bodies", &timing)
        }
    }

    #[test]
    fn a_row_without_error_figure_is_refused() {
        let mut row = row("chain", "aba", "f64", 128, 1e-3);
        row.validate().unwrap();
        row.error_forward = None;
        assert!(matches!(
            row.validate(),
            Err(RowError::NoErrorFigure { .. })
        ));
        row.false_pairs = Some(0);
        assert!(matches!(
            row.validate(),
            Err(RowError::NoErrorFigure { .. })
        ));
        row.missed_pairs = Some(3);
        row.validate().unwrap();
        assert_eq!(row.wrong_pairs(), Some(3));
    }

    #[test]
    fn figures_that_mean_nothing_are_refused_by_name() {
        let good = row("chain", "aba", "f64", 128, 1e-3);
        for value in [f64::NAN, f64::INFINITY, -1.0] {
            let bad = Row {
                error_residual: Some(value),
                ..good.clone()
            };
            let error = bad.validate().unwrap_err();
            assert!(matches!(
                error,
                RowError::NotANumber {
                    field: "error_residual",
                    ..
                }
            ));
            assert!(
                error.to_string().contains("chain / aba at size 128"),
                "{error}"
            );
        }
        let bad = Row {
            time_max_s: 1e-6,
            ..good.clone()
        };
        assert!(matches!(bad.validate(), Err(RowError::Times { .. })));
        let bad = Row {
            time_min_s: 0.0,
            ..good.clone()
        };
        assert!(matches!(bad.validate(), Err(RowError::Times { .. })));
        let bad = Row {
            time_q3_s: Some(0.5e-3),
            ..good.clone()
        };
        assert!(matches!(bad.validate(), Err(RowError::Times { .. })));
        let bad = Row {
            samples: 0,
            ..good.clone()
        };
        assert!(matches!(bad.validate(), Err(RowError::Zero { .. })));
        let bad = Row {
            method: " ".to_owned(),
            ..good
        };
        assert!(matches!(
            bad.validate(),
            Err(RowError::Empty {
                field: "method",
                ..
            })
        ));
    }
    #[test]
    fn a_row_of_an_earlier_version_has_its_range_for_quartiles() {
        let row = row("chain", "aba", "f64", 128, 1e-3);
        assert!(row.time_min_s < row.middle_half_s().0 && row.middle_half_s().1 < row.time_max_s);
        let mut fields = serde_json::to_value(&row).unwrap();
        for field in ["time_q1_s", "time_q3_s"] {
            assert!(fields.as_object_mut().unwrap().remove(field).is_some());
        }
        let old: Row = serde_json::from_value(fields).unwrap();
        old.validate().unwrap();
        assert_eq!(old.middle_half_s(), (row.time_min_s, row.time_max_s));
    }
}
