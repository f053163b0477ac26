//! Which rows compare with each other, and the best of them: the Pareto front of speed and error.

use crate::row::Row;

/// What a row is asked for, whatever answers it.
pub(super) fn task(row: &Row) -> &str {
    let (family, question) = row.method.split_once('-').unwrap_or((&row.method, ""));
    match family {
        _ if row.method == "aba-derivatives" => &row.method,
        "aba" | "crba" | "dca" | "mujoco" | "pinocchio" | "tolerance" => "forward dynamics",
        "step" if matches!(question, "" | "16") => "a whole step",
        "exact" | "moller" | "moller0" if question.is_empty() => "listed pairs",
        "separating" => "listed pairs",
        "exact" | "moller" | "moller0" => question,
        // Meshes lie on the device, unless they are uploaded for each answer.
        "collision" => match question {
            "pairs-upload" => "pairs",
            "pairs" | "pairs-all" | "pairs-tree" | "pairs-chosen" | "moller" => "pairs-resident",
            "any" => "any-resident",
            "count" => "count-resident",
            "mask" => "mask-resident",
            "error-exact" | "error-moller" => "listed pairs",
            _ => &row.method,
        },
        _ => &row.method,
    }
}

/// Whether the size of a row is a setting of its method, so many of one thing to another, and no
/// amount of work.
fn is_setting(row: &Row) -> bool {
    row.size_unit.contains(" a ")
}

/// What one call does, and the unit of that.
pub(super) fn work(row: &Row) -> (f64, &str) {
    if is_setting(row) {
        (1.0, "calls")
    } else {
        (row.size as f64, &row.size_unit)
    }
}

/// What a row is compared with: the same input, and asked the same of it.
fn rivals(row: &Row) -> (&str, Option<u64>, &str) {
    let size = (!is_setting(row)).then_some(row.size);
    (&row.scenario, size, task(row))
}

/// Whether no other row of the same input, of which there are some, is both faster and more exact.
pub(super) fn is_on_front(row: &Row, rows: &[&Row], error: fn(&Row) -> Option<f64>) -> bool {
    let others = || {
        rows.iter()
            .filter(|other| rivals(other) == rivals(row) && error(other).is_some())
    };
    let (time, own) = (row.time_median_s, error(row));
    let beats = |other: &Row| {
        let (faster, better) = (other.time_median_s <= time, error(other) <= own);
        faster && better && (other.time_median_s < time || error(other) < own)
    };
    own.is_some() && others().nth(1).is_some() && !others().any(|other| beats(other))
}

/// Whether one line along the front makes sense of the rows: all are rivals.
pub(super) fn is_one_contest(rows: &[&Row]) -> bool {
    rows.iter().all(|row| rivals(row) == rivals(rows[0]))
}
