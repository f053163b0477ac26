//! Forward errors over 64 seeds of every case: against bounds, and against what they were before.
//!
//! One problem can hide a digit lost: over the seeds of one case errors differ a hundredfold, the
//! median of 64 by a quarter. So a median that doubles is a change for the worse, whatever the
//! bounds would allow.

use super::{Figure, Outcome};
use crate::accuracy::case::{Case, Pattern, Shape};
use crate::accuracy::entry::{Entry, TOLERANCE, TOLERANCE_METHOD, measure};
use crate::accuracy::{Lost, Solvers, parse};
use crate::interrupt::Interrupt;
use anyhow::Context;

/// Seeds of each case.
pub(super) const SEEDS: u32 = 64;

/// Numbers of bodies: a few chunks, and a tree of several levels.
const SIZES: [usize; 2] = [32, 128];

/// The largest error may be this many times the 95th percentile's bound: 5e-10 and 1e-10 of f32 joins.
const TAIL: f64 = 5.0;

/// The entries before; `benches/accuracy/README.md` tells how they are made.
const STORED: &str = include_str!("../../accuracy/accuracy.json");

/// A median may be this many times that of the stored entry.
const GROWTH: f64 = 2.0;

/// Median, 95th percentile and maximum of every solver on every case, and refusals: none more than stored. Of 64 seeds the
/// 99th percentile is the maximum; what is asked of it beyond that is asked of the 95th.
///
/// # Errors
/// If a problem cannot be measured, or there is no stored entry for it.
pub fn forward_errors() -> Outcome {
    let stored = parse(STORED)?;
    let solvers = Solvers::on_cpu();
    let mut figures = Vec::new();
    for case in Case::all() {
        for bodies in SIZES {
            let measured = measure(&solvers, &case, bodies, SEEDS, &Interrupt::default())?;
            for entry in measured.into_iter().flatten() {
                let before = find(&stored, &entry);
                let before =
                    before.with_context(|| format!("no stored entry for {:?}", entry.key()))?;
                let bounds = Bounds::of(&case, &entry);
                figures.extend(judge(&case, &entry, Some(before), bounds));
            }
        }
    }
    Ok(figures)
}

/// The entry before, if there is one.
pub(super) fn find<'a>(stored: &'a [Entry], entry: &Entry) -> Option<&'a Entry> {
    let is_same = |before: &&Entry| before.key() == entry.key() && before.seeds == entry.seeds;
    stored.iter().find(is_same)
}

/// The figures of one entry.
pub(super) fn judge(
    case: &Case,
    entry: &Entry,
    before: Option<&Entry>,
    bounds: Option<Bounds>,
) -> Vec<Figure> {
    let (.., method, precision) = entry.key();
    let name = |what| {
        format!(
            "{what}: {} of {}, {method} {precision}",
            case.name(),
            entry.bodies
        )
    };
    let mut figures = Vec::new();
    if let Some(before) = before {
        let refused = Figure::new(name("refused"), entry.refused.into(), before.refused.into());
        figures.push(refused);
        if let (Some(median), Some(before)) = (entry.median, before.median) {
            let growth = Figure::new(name("median before"), median, GROWTH * before);
            figures.push(growth);
        }
    }
    if let Some(bounds) = bounds
        && let (Some(median), Some(p95), Some(max)) = (entry.median, entry.p95, entry.max)
    {
        figures.push(Figure::new(name("median"), median, bounds.median));
        figures.push(Figure::new(name("95 %"), p95, bounds.p95));
        figures.push(Figure::new(name("largest"), max, bounds.max));
    }
    figures
}

/// What the errors over the seeds may be.
pub(super) struct Bounds {
    median: f64,
    p95: f64,
    max: f64,
}

impl Bounds {
    fn new(median: f64, max: f64) -> Self {
        Self {
            median,
            p95: max / TAIL,
            max,
        }
    }

    /// Of rounding that loses so many digits along paths of sqrt(n) bodies.
    fn of_rounding(walk: f64, epsilon: f64, lost: f64) -> Self {
        Self::new(32.0 * walk * epsilon * lost, 512.0 * walk * epsilon * lost)
    }

    /// With more that is allowed.
    fn beside(self, median: f64, max: f64) -> Self {
        Self::new(self.median + median, self.max + max)
    }

    /// Rounding errors add up along a path like a random walk, and the pattern costs the digits of
    /// [`lost`]: sqrt(n) eps lost, times a small constant for the median and sixteen times that for
    /// the largest. An f32 tree over f64 chunks adds the square of what its joins lose, (6e-7)^2 and (2.2e-5)^2 at these
    /// sizes, and once corrected nothing.
    ///
    /// The second correction takes out the drift of places too and ends at the rounding of its own equations: a quarter of what one correction of the recursion may leave.
    /// All of these are about four times what is measured, and tapered chains, which without that ended at 30 sqrt(n) eps, far less.
    ///
    /// None where not one digit is promised.
    pub(super) fn of(case: &Case, entry: &Entry) -> Option<Self> {
        let is_tree = entry.method == "dca";
        let lost = match case.shape {
            Shape::Hard(hard) => hard.lost(entry.bodies),
            _ => Lost {
                solution: lost(case, is_tree),
                ..Lost::NOTHING
            },
        };
        #[expect(clippy::cast_precision_loss, reason = "a size in a bound")]
        let walk = (entry.bodies as f64).sqrt();
        let plain = |epsilon: f64, lost: f64| Self::of_rounding(walk, epsilon, lost);
        let bounds = match (entry.method.as_str(), entry.precision.as_str()) {
            // In f64 no pattern of masses costs a digit then.
            // Better than without them where factors have digits, which the pattern's factor says.
            ("dca+1" | "dca+2", "f32") => plain(f32::EPSILON.into(), lost.solution),
            ("dca+1", _) => plain(f64::EPSILON, lost.once),
            ("dca+2", _) => plain(f64::EPSILON, 0.25 * slender(case) * lost.twice),
            // Where the first is not at rounding yet, the second gains two digits.
            ("aba+2", _) => {
                let lost = lost.twice.max(0.01 * lost.recursion);
                plain(f64::EPSILON, 0.25 * slender(case) * lost)
            }
            ("aba+1", _) => plain(f64::EPSILON, lost.recursion),
            // Met, or refused.
            (TOLERANCE_METHOD, _) => Self::new(TOLERANCE, TOLERANCE),
            (_, "f64/f32") => {
                let joins = lost.joins;
                plain(f64::EPSILON, lost.solution).beside(4e-13 * joins, 5e-10 * joins)
            }
            (_, "f64") => plain(f64::EPSILON, lost.solution),
            _ => plain(f32::EPSILON.into(), lost.solution),
        };
        (bounds.max < 1.0).then_some(bounds)
    }
}

impl Bounds {
    /// What a GPU may do. Its chunks have 4 joints, 8 next to heavy bodies or 16 with corrections over f32 joins: more of what comes out of
    /// these is left. Each correction takes out what joins, and masses inside a chunk, have lost, by the same factor
    /// again, down to the rounding of the bodies' equations. Of what hangs at rest that is all there is of a solution's error, too.
    pub(super) fn on_gpu(case: &Case, entry: &Entry) -> Option<Self> {
        let (lost, left, carried) = match case.shape {
            Shape::Hard(hard) => {
                let lost = hard.lost(entry.bodies);
                (lost.solution.max(lost.twice), lost.twice, lost.carried)
            }
            _ => (lost(case, false), slender(case), 1.0),
        };
        #[expect(clippy::cast_precision_loss, reason = "a size in a bound")]
        let walk = (entry.bodies as f64).sqrt();
        let plain = |epsilon: f64, lost: f64| Self::of_rounding(walk, epsilon, lost);
        let joins = slender(case) * lost.sqrt();
        let joined = |lost: f64, sweeps: i32| {
            plain(f64::EPSILON, lost).beside(
                carried * (4e-6 * joins).powi(1 + sweeps),
                carried * (2e-4 * joins).powi(1 + sweeps),
            )
        };
        let bounds = match (entry.method.as_str(), entry.precision.as_str()) {
            // The cheapest that meets it, by however little.
            (TOLERANCE_METHOD, _) => Self {
                median: TOLERANCE,
                p95: TOLERANCE,
                max: TOLERANCE,
            },
            ("dca", "f64/f32") => joined(lost, 0),
            ("dca+1", "f64/f32") => joined(left, 1),
            ("dca+2", "f64/f32") => joined(left, 2),
            ("dca+1", "f64") => {
                let chunks = plain(f64::EPSILON, lost);
                plain(f64::EPSILON, left).beside(chunks.median.powi(2), chunks.max.powi(2))
            }
            (_, "f64") => plain(f64::EPSILON, lost),
            _ => plain(f32::EPSILON.into(), lost),
        };
        (bounds.max < 1.0).then_some(bounds)
    }
}

/// The factor by which a pattern of masses makes errors larger.
///
/// A recursion towards the base carries the inertia of a heavy body through the light ones inboard
/// of it and keeps only the digits that theirs have in it. Single light bodies cost nothing: the
/// inertia beyond is let go after six freedoms. A heavy tip costs the tree nothing either, on a
/// chain: it is a leaf of its own. On branched trees heavy bodies come side by side with light ones
/// in all the ways there are.
fn lost(case: &Case, is_tree: bool) -> f64 {
    use vertebra::generate::Masses;
    match (case.pattern.masses, case.shape) {
        (Masses::HeavyLast(_), Shape::Chain) if is_tree => 1.0,
        (Masses::Alternating(_), Shape::Chain) => 1.0,
        (Masses::HeavyLast(ratio) | Masses::HeavyTips(ratio) | Masses::Alternating(ratio), _) => {
            ratio.max(1.0)
        }
        (Masses::Decades(decades), _) => 10_f64.powf(decades),
        (Masses::EveryEighth(ratio), _) => ratio.max(1.0),
        (Masses::Equal | Masses::HeavyBase(_), _) => 1.0,
    }
}

/// Twice the error of f32 joins on a GPU and of two corrections is allowed for rods a thousand times as long as thick, whose
/// inertia about their axis is a millionth of that across.
fn slender(case: &Case) -> f64 {
    let Pattern { rod, .. } = &case.pattern;
    if rod.radius < 0.01 * rod.length {
        2.0
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An entry of plain masses whose errors are these.
    fn entry(precision: &str, median: f64, max: f64) -> Entry {
        Entry {
            shape: "chain".to_owned(),
            pattern: "equal".to_owned(),
            bodies: 64,
            method: "dca".to_owned(),
            precision: precision.to_owned(),
            seeds: SEEDS,
            refused: 0,
            median: Some(median),
            p95: Some(0.2 * max),
            p99: Some(max),
            max: Some(max),
            device: String::new(),
        }
    }

    #[test]
    fn each_kind_of_worsening_is_found() {
        let case = &Case::all()[0];
        let failures = |now: &Entry, before: &Entry| {
            let figures = judge(case, now, Some(before), Bounds::of(case, now));
            let failed = figures.iter().filter(|figure| !figure.passes());
            failed
                .map(|figure| figure.name.split(':').next().unwrap().to_owned())
                .collect::<Vec<_>>()
        };
        let before = entry("f64/f32", 2e-13, 1e-10);
        assert!(failures(&before, &before).is_empty());
        let doubled = entry("f64/f32", 4.1e-13, 1e-10);
        assert_eq!(failures(&doubled, &before), ["median before"]);
        let tail = entry("f64/f32", 2e-13, 6e-10);
        assert_eq!(failures(&tail, &before), ["95 %", "largest"]);
        let broad = Entry {
            p95: Some(1.1e-10),
            max: Some(4e-10),
            ..before.clone()
        };
        assert_eq!(failures(&broad, &before), ["95 %"]);
        let coarse = entry("f64/f32", 5e-13, 1e-10);
        assert_eq!(failures(&coarse, &coarse), ["median"]);
        let refusing = Entry {
            refused: 1,
            ..before.clone()
        };
        assert_eq!(failures(&refusing, &before), ["refused"]);
        let f64s = entry("f64", 1e-13, 1e-11);
        assert_eq!(failures(&f64s, &f64s), ["median", "95 %", "largest"]);
    }
}
