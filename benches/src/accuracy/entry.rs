//! The errors of one solver over the seeds of one case.

use super::case::{Case, Problem};
use super::solvers::{Measured, Solvers};
use crate::interrupt::Interrupt;
use anyhow::Context;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use vertebra::{Error, Precision, Workspace, aba, forward_error};

/// The forward errors of one solver on one case and size: max |qdd - ref| / max |ref| of each seed,
/// against the articulated-body algorithm in the reference precision.
///
/// A percentile is the smallest error that so many percent of the solved seeds do not exceed (R. J.
/// Hyndman and Y. Fan, "Sample quantiles in statistical packages", The American Statistician 50(4),
/// 1996, definition 1): errors of neighbouring ranks can be decades apart, where no mean of them
/// would tell anything.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// How bodies carry each other: `"chain"`, `"tree"`, `"hard"`, `"mixed"`.
    pub shape: String,
    /// Name of the pattern of masses, rods and rates.
    pub pattern: String,
    /// Bodies \[count\].
    pub bodies: usize,
    /// Name of the algorithm; `+1`: refined once.
    pub method: String,
    /// Floating-point type; `"f64/f32"` for chunks in f64 and joins in f32.
    pub precision: String,
    /// Problems \[count\], with seeds from 0.
    pub seeds: u32,
    /// Problems that the solver refused, with an error that says why \[count\].
    pub refused: u32,
    /// Median; absent, as are the others, when all were refused.
    pub median: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// 99th percentile.
    pub p99: Option<f64>,
    /// Largest error.
    pub max: Option<f64>,
    /// Name, interface and driver of a GPU; empty of a processor.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub device: String,
}

/// The columns of an entry, in the order of its fields.
pub(super) const COLUMNS: [&str; 12] = [
    "shape",
    "pattern",
    "bodies",
    "method",
    "precision",
    "seeds",
    "refused",
    "median",
    "p95",
    "p99",
    "max",
    "device",
];

impl Entry {
    /// What the entry is about: the same for a stored entry and a new one.
    #[must_use]
    pub fn key(&self) -> (&str, &str, usize, &str, &str) {
        (
            &self.shape,
            &self.pattern,
            self.bodies,
            &self.method,
            &self.precision,
        )
    }
}

/// The tolerance that solvers are asked for.
pub const TOLERANCE: f64 = 1e-10;
/// Name of the method that is asked for it.
pub const TOLERANCE_METHOD: &str = "to 1e-10";

/// The entries of every solver on one case and size, over seeds from 0. The first seed is solved alone, so that
/// kernels of a GPU are compiled once; the others are shared out among the threads of the current rayon pool. None
/// if interrupted.
///
/// # Errors
/// If a problem cannot be made, or has no solution in the reference precision, or a GPU fails.
pub fn measure(
    solvers: &Solvers,
    case: &Case,
    bodies: usize,
    seeds: u32,
    interrupt: &Interrupt,
) -> anyhow::Result<Option<Vec<Entry>>> {
    let errors_of = |seed| match interrupt.requested() {
        false => errors(case, bodies, seed, &solvers.list),
        true => Ok(Vec::new()),
    };
    let mut of_seeds: Vec<Vec<Option<f64>>> = (0..seeds.min(1))
        .map(errors_of)
        .collect::<anyhow::Result<_>>()?;
    let others = (1..seeds).into_par_iter().map(errors_of);
    of_seeds.extend(others.collect::<anyhow::Result<Vec<_>>>()?);
    if interrupt.requested() {
        return Ok(None);
    }
    let entry = |(index, (precision, solver)): (usize, &Measured)| {
        let errors = of_seeds.iter().filter_map(|errors| errors[index]).collect();
        let named = (solver.method(), *precision, solvers.device.as_str());
        entry(case, bodies, seeds, named, errors)
    };
    Ok(Some(solvers.list.iter().enumerate().map(entry).collect()))
}

/// The error of each solver on one problem; none where it refuses.
fn errors(
    case: &Case,
    bodies: usize,
    seed: u32,
    solvers: &[Measured],
) -> anyhow::Result<Vec<Option<f64>>> {
    let label = || format!("{} of {bodies}, seed {seed}", case.name());
    let Problem {
        model,
        state,
        forces,
    } = case.problem(bodies, seed.into()).with_context(label)?;
    let mut reference = Workspace::new(&model, Precision::Reference);
    aba(&model, &state, &forces, &mut reference).with_context(label)?;
    solvers
        .iter()
        .map(|(_, solver)| match solver.solve(&model, &state, &forces) {
            Ok(qdd) => Ok(Some(forward_error(&qdd, &reference)?)),
            // No answer of the solver's.
            Err(error @ Error::Gpu(_)) => Err(error).with_context(label),
            Err(_) => Ok(None),
        })
        .collect()
}

/// Summarises the errors of the seeds that were solved.
fn entry(
    case: &Case,
    bodies: usize,
    seeds: u32,
    (method, precision, device): (&str, &str, &str),
    mut errors: Vec<f64>,
) -> Entry {
    errors.sort_by(f64::total_cmp);
    let solved = u32::try_from(errors.len()).unwrap_or(seeds);
    Entry {
        shape: case.shape.name().to_owned(),
        pattern: case.pattern.name.to_owned(),
        bodies,
        method: method.to_owned(),
        precision: precision.to_owned(),
        seeds,
        refused: seeds - solved,
        median: percentile(&errors, 50),
        p95: percentile(&errors, 95),
        p99: percentile(&errors, 99),
        max: errors.last().copied(),
        device: device.to_owned(),
    }
}

/// The smallest of sorted values that so many percent of them do not exceed.
fn percentile(sorted: &[f64], percent: usize) -> Option<f64> {
    let rank = (percent * sorted.len()).div_ceil(100);
    sorted.get(rank.max(1) - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_occurred() {
        let hundred: Vec<f64> = (1..=100).map(f64::from).collect();
        let of = |percent| percentile(&hundred, percent).unwrap();
        assert_eq!([50, 95, 99, 100].map(of), [50.0, 95.0, 99.0, 100.0]);
        assert_eq!(percentile(&[7.0], 50), Some(7.0));
        assert_eq!(percentile(&[1.0, 2.0, 3.0], 50), Some(2.0));
        assert_eq!(percentile(&[], 50), None);
    }

    #[test]
    fn refusals_are_counted_and_left_out() {
        let case = &Case::all()[0];
        let some = entry(case, 3, 5, ("aba", "f64", ""), vec![3.0, 1.0, 2.0]);
        assert_eq!(
            (some.refused, some.median, some.max),
            (2, Some(2.0), Some(3.0))
        );
        let none = entry(case, 3, 5, ("aba", "f64", ""), Vec::new());
        assert_eq!((none.refused, none.median, none.max), (5, None, None));
    }

    #[test]
    fn the_same_whatever_the_number_of_threads() {
        let case = &Case::all()[0];
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build()
                .unwrap()
                .install(|| measure(&Solvers::on_cpu(), case, 20, 9, &Interrupt::default()))
                .unwrap()
                .unwrap()
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn columns_are_the_fields() {
        let entry = entry(&Case::all()[0], 3, 1, ("aba", "f64", "a GPU"), vec![1.0]);
        let value = serde_json::to_value(entry).unwrap();
        let fields = value.as_object().unwrap();
        assert_eq!(fields.len(), COLUMNS.len());
        assert!(COLUMNS.iter().all(|column| fields.contains_key(*column)));
    }
}
