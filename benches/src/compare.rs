//! One run against another: what became faster, slower, more or less accurate.

use crate::row::Row;
use crate::table::Grid;
use crate::table::format::{count, seconds, times};

/// Medians closer than this ratio are the same whatever their spread.
const TIME_TOLERANCE: f64 = 1.05;
/// Errors closer than this ratio are the same: rounding is a matter of luck to that extent.
const ERROR_TOLERANCE: f64 = 2.0;

/// What became of the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Speed {
    /// The new median is smaller, beyond doubt.
    Faster,
    /// The new median is larger, beyond doubt.
    Slower,
    /// The spreads do not tell the two apart.
    Same,
}

/// What became of the error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accuracy {
    /// An error figure fell to less than half and none rose.
    Better,
    /// An error figure rose to more than twice, or is gone.
    Worse,
    /// No error figure changed beyond a factor of two.
    Same,
}

/// What must agree for two rows to be compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the algorithm.
    pub method: String,
    /// Floating-point type of the computation.
    pub precision: String,
    /// Kind of device that computed.
    pub backend: String,
    /// Model name of the processor.
    pub device: String,
    /// Threads that computed \[count\].
    pub threads: usize,
    /// Size of the problem.
    pub size: u64,
}

impl Key {
    /// The key of a row.
    #[must_use]
    pub fn of(row: &Row) -> Self {
        Self {
            scenario: row.scenario.clone(),
            method: row.method.clone(),
            precision: row.precision.clone(),
            backend: row.backend.clone(),
            device: row.device.clone(),
            threads: row.threads,
            size: row.size,
        }
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            scenario,
            method,
            precision,
            backend,
            device,
            threads,
            size,
        } = self;
        write!(
            f,
            "{scenario} / {method} {precision} on {backend} ({device}, threads: {threads}), size {}",
            count(*size)
        )
    }
}

/// The run that has a row the other lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The earlier run.
    Old,
    /// The later run.
    New,
}

/// Refuses runs that have no row in common: nothing would have been judged.
///
/// # Errors
/// If there is none, and why the first row has no counterpart.
pub fn refuse_strangers(verdicts: &[Verdict]) -> anyhow::Result<()> {
    let mut why = None;
    for verdict in verdicts {
        match verdict {
            Verdict::Compared { .. } => return Ok(()),
            Verdict::Unmatched { key, reason, .. } => {
                why.get_or_insert_with(|| format!("{key}: {reason}"));
            }
        }
    }
    anyhow::bail!(
        "the runs have no row in common, so that nothing was judged ({}); compare runs of the same scenarios on the same device",
        why.unwrap_or_else(|| "there are no rows".to_owned())
    )
}

/// The outcome for one row.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Both runs have the row.
    Compared {
        /// What the two rows agree in.
        key: Key,
        /// Old median \[s\].
        old_s: f64,
        /// New median \[s\].
        new_s: f64,
        /// What became of the time.
        speed: Speed,
        /// What became of the error.
        accuracy: Accuracy,
    },
    /// Only one run has the row.
    Unmatched {
        /// The row.
        key: Key,
        /// The run that has it.
        side: Side,
        /// Why the other run has no counterpart.
        reason: String,
    },
}

impl Verdict {
    /// Whether the new run is worse here: slower, or less accurate.
    #[must_use]
    pub fn is_regression(&self) -> bool {
        matches!(
            self,
            Self::Compared {
                speed: Speed::Slower,
                ..
            } | Self::Compared {
                accuracy: Accuracy::Worse,
                ..
            }
        )
    }
}

/// Compares two runs row by row; rows are matched by [`Key`].
///
/// A row is faster or slower when the two medians differ by more than 5 % and each lies outside the
/// other row's quartiles ([`Row::middle_half_s`]), which a few samples that something else held up
/// do not move; otherwise the times are the same. Its error is better or worse when a figure changed by more than a factor of two, where figures below the
/// rounding unit of f64 count as that unit; a wrong pair where there was none is worse, and so is a
/// figure that the new run no longer has.
#[must_use]
pub fn compare(old: &[Row], new: &[Row]) -> Vec<Verdict> {
    let mut verdicts = Vec::new();
    for (index, row) in new.iter().enumerate() {
        let key = Key::of(row);
        let repeated = new[..index].iter().any(|earlier| Key::of(earlier) == key);
        let counterpart = old.iter().find(|other| Key::of(other) == key);
        verdicts.push(match counterpart {
            Some(old) if !repeated => Verdict::Compared {
                key,
                old_s: old.time_median_s,
                new_s: row.time_median_s,
                speed: speed(old, row),
                accuracy: accuracy(old, row),
            },
            _ => unmatched(key, Side::New, repeated, old),
        });
    }
    for (index, row) in old.iter().enumerate() {
        let key = Key::of(row);
        let repeated = old[..index].iter().any(|earlier| Key::of(earlier) == key);
        if repeated || !new.iter().any(|other| Key::of(other) == key) {
            verdicts.push(unmatched(key, Side::Old, repeated, new));
        }
    }
    verdicts
}

/// The verdict on a row without counterpart among `others`.
fn unmatched(key: Key, side: Side, repeated: bool, others: &[Row]) -> Verdict {
    let near = |same: fn(&mut Key, &Key)| {
        others.iter().map(Key::of).find(|other| {
            let mut adjusted = key.clone();
            same(&mut adjusted, other);
            adjusted == *other
        })
    };
    let other_run = match side {
        Side::Old => "new",
        Side::New => "old",
    };
    let reason = if repeated {
        "the same row appears earlier in this run".to_owned()
    } else if let Some(other) = near(|key, other| key.device.clone_from(&other.device)) {
        format!(
            "the {other_run} run was on another device: {}",
            other.device
        )
    } else if let Some(other) = near(|key, other| key.threads = other.threads) {
        format!(
            "the {other_run} run used another number of threads: {}",
            other.threads
        )
    } else {
        format!("not measured in the {other_run} run")
    };
    Verdict::Unmatched { key, side, reason }
}

fn speed(old: &Row, new: &Row) -> Speed {
    let ratio = new.time_median_s / old.time_median_s;
    let inside = |median: f64, row: &Row| {
        let (q1, q3) = row.middle_half_s();
        (q1..=q3).contains(&median)
    };
    if inside(new.time_median_s, old) || inside(old.time_median_s, new) {
        Speed::Same
    } else if ratio > TIME_TOLERANCE {
        Speed::Slower
    } else if ratio < 1.0 / TIME_TOLERANCE {
        Speed::Faster
    } else {
        Speed::Same
    }
}

fn accuracy(old: &Row, new: &Row) -> Accuracy {
    // The floors below which two figures do not differ: the rounding unit, and less than one pair.
    let relative = 0.5 * f64::EPSILON;
    let pairs = |pairs: Option<u64>| pairs.map(|pairs| pairs as f64);
    let figures = [
        (old.error_forward, new.error_forward, relative),
        (old.error_residual, new.error_residual, relative),
        (pairs(old.false_pairs), pairs(new.false_pairs), 0.25),
        (pairs(old.missed_pairs), pairs(new.missed_pairs), 0.25),
    ];
    let mut verdict = Accuracy::Same;
    for (old, new, floor) in figures {
        match (old, new) {
            (Some(old), Some(new)) => {
                let ratio = new.max(floor) / old.max(floor);
                if ratio > ERROR_TOLERANCE {
                    return Accuracy::Worse;
                }
                if ratio < 1.0 / ERROR_TOLERANCE {
                    verdict = Accuracy::Better;
                }
            }
            (Some(_), None) => return Accuracy::Worse,
            (None, _) => {}
        }
    }
    verdict
}

/// The verdicts as text for a terminal: a table of the compared rows, then the rows without
/// counterpart, then a count.
#[must_use]
pub fn to_table(verdicts: &[Verdict]) -> String {
    let headings = vec![
        ("scenario", false),
        ("method", false),
        ("prec", false),
        ("thr", true),
        ("size", true),
        ("old", true),
        ("new", true),
        ("new/old", true),
        ("time", false),
        ("error", false),
    ];
    let mut lines = Vec::new();
    let mut unmatched = String::new();
    for verdict in verdicts {
        match verdict {
            Verdict::Compared {
                key,
                old_s,
                new_s,
                speed,
                accuracy,
            } => lines.push(vec![
                key.scenario.clone(),
                key.method.clone(),
                key.precision.clone(),
                key.threads.to_string(),
                count(key.size),
                seconds(*old_s),
                seconds(*new_s),
                times(new_s / old_s),
                match speed {
                    Speed::Faster => "faster",
                    Speed::Slower => "SLOWER",
                    Speed::Same => "same",
                }
                .to_owned(),
                match accuracy {
                    Accuracy::Better => "better",
                    Accuracy::Worse => "WORSE",
                    Accuracy::Same => "same",
                }
                .to_owned(),
            ]),
            Verdict::Unmatched { key, side, reason } => {
                let side = match side {
                    Side::Old => "old",
                    Side::New => "new",
                };
                unmatched.push_str(&format!("only in the {side} run: {key}: {reason}\n"));
            }
        }
    }
    let regressions = verdicts
        .iter()
        .filter(|verdict| verdict.is_regression())
        .count();
    let compared = lines.len();
    let mut text = String::new();
    if compared > 0 {
        text.push_str(&Grid::new(headings, lines).terminal());
        text.push('\n');
    }
    text.push_str(&unmatched);
    text.push_str(&format!(
        "{compared} compared, {regressions} worse, {} without counterpart\n",
        verdicts.len() - compared
    ));
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::Timing;
    use crate::row::tests::row;

    fn base() -> Row {
        row("chain", "aba", "f64", 128, 1e-3)
    }

    /// The verdict on time and error of one row against another.
    fn judge(old: &Row, new: &Row) -> (Speed, Accuracy) {
        match compare(std::slice::from_ref(old), std::slice::from_ref(new)).as_slice() {
            [
                Verdict::Compared {
                    speed, accuracy, ..
                },
            ] => (*speed, *accuracy),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn times_differ_only_when_the_spreads_separate() {
        let old = base();
        let scaled = |ratio: f64| row("chain", "aba", "f64", 128, ratio * 1e-3);
        assert_eq!(judge(&old, &old).0, Speed::Same);
        assert_eq!(judge(&old, &scaled(1.5)).0, Speed::Slower);
        assert_eq!(judge(&old, &scaled(0.5)).0, Speed::Faster);
        // The quartiles separate, but by less than 5 %.
        assert_eq!(judge(&old, &scaled(1.04)).0, Speed::Same);
        assert_eq!(judge(&old, &scaled(0.96)).0, Speed::Same);
        // Twice as slow in the median, but a quarter of the old samples were slower still.
        let noisy = Row {
            time_q3_s: Some(2.5e-3),
            time_max_s: 3e-3,
            ..old.clone()
        };
        assert_eq!(judge(&noisy, &scaled(2.0)).0, Speed::Same);
        assert_eq!(judge(&scaled(2.0), &noisy).0, Speed::Same);
    }

    #[test]
    fn one_outlier_does_not_hide_a_change() {
        let sampled = |median: f64, outlier: f64| {
            let mut samples: Vec<f64> = (0..19)
                .map(|i| median * (1.0 + 1e-3 * (f64::from(i) - 9.0)))
                .collect();
            samples.push(outlier);
            let timing = Timing::from_samples(samples).unwrap();
            Row {
                device: "Test CPU".to_owned(),
                error_forward: Some(1e-13),
                ..Row::new("chain", "aba", "f64", 128, "bodies", &timing)
            }
        };
        let (old, new) = (sampled(1e-3, 9e-3), sampled(2e-3, 0.5e-3));
        assert_eq!(judge(&old, &new).0, Speed::Slower);
        assert_eq!(judge(&new, &old).0, Speed::Faster);
        // Without quartiles the range is all there is, and it covers the change.
        let without = |row: &Row| Row {
            time_q1_s: None,
            time_q3_s: None,
            ..row.clone()
        };
        assert_eq!(judge(&without(&old), &new).0, Speed::Same);
    }

    #[test]
    fn errors_differ_by_a_factor_of_two_above_rounding() {
        let with = |error: f64| Row {
            error_forward: Some(error),
            ..base()
        };
        assert_eq!(judge(&with(1e-13), &with(1.9e-13)).1, Accuracy::Same);
        assert_eq!(judge(&with(1e-13), &with(2.1e-13)).1, Accuracy::Worse);
        assert_eq!(judge(&with(1e-13), &with(0.4e-13)).1, Accuracy::Better);
        assert_eq!(judge(&with(0.0), &with(1e-16)).1, Accuracy::Same);
        assert_eq!(judge(&with(0.0), &with(1e-15)).1, Accuracy::Worse);

        let pairs = |missed| Row {
            false_pairs: Some(0),
            missed_pairs: Some(missed),
            ..base()
        };
        assert_eq!(judge(&pairs(0), &pairs(0)).1, Accuracy::Same);
        assert_eq!(judge(&pairs(0), &pairs(1)).1, Accuracy::Worse);
        assert_eq!(judge(&pairs(1), &pairs(0)).1, Accuracy::Better);
        assert_eq!(
            judge(&pairs(0), &base()).1,
            Accuracy::Worse,
            "a lost figure cannot be vouched for"
        );
        // One figure better does not make up for another that is worse.
        let traded = Row {
            error_forward: Some(1e-15),
            error_residual: Some(1e-3),
            ..base()
        };
        assert_eq!(
            judge(
                &Row {
                    error_residual: Some(1e-9),
                    ..base()
                },
                &traded
            )
            .1,
            Accuracy::Worse
        );
    }

    #[test]
    fn rows_without_counterpart_say_why() {
        let old = [base(), row("chain", "crba", "f64", 128, 1e-3)];
        let new = [
            Row {
                device: "Other CPU".to_owned(),
                ..base()
            },
            Row {
                threads: 8,
                ..base()
            },
            row("star", "aba", "f64", 128, 1e-3),
        ];
        let verdicts = compare(&old, &new);
        let reasons: Vec<(Side, &str)> = verdicts
            .iter()
            .map(|verdict| match verdict {
                Verdict::Unmatched { side, reason, .. } => (*side, reason.as_str()),
                Verdict::Compared { key, .. } => panic!("{key} has no counterpart"),
            })
            .collect();
        assert_eq!(
            reasons,
            [
                (Side::New, "the old run was on another device: Test CPU"),
                (Side::New, "the old run used another number of threads: 1"),
                (Side::New, "not measured in the old run"),
                (Side::Old, "the new run was on another device: Other CPU"),
                (Side::Old, "not measured in the new run"),
            ]
        );
        assert!(!verdicts.iter().any(Verdict::is_regression));
        assert!(to_table(&verdicts).contains("0 compared, 0 worse, 5 without counterpart"));
    }

    #[test]
    fn a_repeated_row_is_listed_and_regressions_are_counted() {
        let slow = row("chain", "aba", "f64", 128, 9e-3);
        let verdicts = compare(&[base(), base()], &[slow.clone(), slow]);
        assert_eq!(
            verdicts
                .iter()
                .filter(|verdict| verdict.is_regression())
                .count(),
            1
        );
        assert_eq!(verdicts.len(), 3);
        let text = to_table(&verdicts);
        assert!(text.contains("SLOWER") && text.contains("9.00x"), "{text}");
        assert_eq!(text.matches("appears earlier").count(), 2, "{text}");
    }
}
