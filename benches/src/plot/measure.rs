//! Figures of error that rows have in common, and the axes of them.

use super::axis::{LogAxis, count_label, power_label};
use crate::row::Row;

/// A figure of error.
pub(super) struct Measure {
    /// Title of the axis.
    pub(super) title: &'static str,
    /// What rows without it lack.
    pub(super) name: &'static str,
    pub(super) value: fn(&Row) -> Option<f64>,
    pub(super) label: fn(f64) -> String,
    /// Least ratio of the ends of the axis, so that nothing of the order of rounding looks like a
    /// difference.
    least_ratio: f64,
}

/// Least ratio of the ends of an axis of rounding errors.
const ROUNDING: f64 = 1e4;

static MEASURES: [Measure; 4] = [
    Measure {
        title: "forward error, relative to the largest reference value",
        name: "forward error",
        value: |row| row.error_forward,
        label: power_label,
        least_ratio: ROUNDING,
    },
    Measure {
        title: "residual of the bodies' equations, relative to its terms",
        name: "residual",
        value: |row| row.error_residual.filter(|_| !is_of_loops(row)),
        label: power_label,
        least_ratio: ROUNDING,
    },
    Measure {
        title: "what the worst loop is open by, over its size",
        name: "opening",
        value: |row| row.error_residual.filter(|_| is_of_loops(row)),
        label: power_label,
        least_ratio: ROUNDING,
    },
    Measure {
        title: "wrong pairs, false and missed",
        name: "wrong pairs",
        value: |row| row.wrong_pairs().map(|pairs| pairs as f64),
        label: count_label,
        least_ratio: 1.0,
    },
];

/// Whether the residual of a row is that of loops, which is no equation of the bodies.
fn is_of_loops(row: &Row) -> bool {
    row.scenario.starts_with("loops ")
}

impl Measure {
    /// The figure that most of the rows have, the first of equals.
    pub(super) fn of(rows: &[&Row]) -> &'static Self {
        let measured = |measure: &&Self| rows.iter().filter_map(|row| (measure.value)(row)).count();
        let [first, ..] = &MEASURES;
        MEASURES.iter().rev().max_by_key(measured).unwrap_or(first)
    }

    /// Whether the rows' errors tell them apart: there are several, and one is not zero.
    pub(super) fn tells(&self, rows: &[&Row]) -> bool {
        let errors: Vec<f64> = rows.iter().filter_map(|row| (self.value)(row)).collect();
        errors.len() > 1 && errors.iter().any(|error| *error > 0.0)
    }

    /// The axis of those errors of the rows that are above zero, between two places \[px\].
    pub(super) fn axis(&self, rows: &[&Row], places: (f64, f64)) -> LogAxis {
        let errors = rows.iter().filter_map(|row| (self.value)(row));
        let errors = errors.filter(|error| *error > 0.0);
        LogAxis::decimal(errors, places).widened(self.least_ratio)
    }
}
