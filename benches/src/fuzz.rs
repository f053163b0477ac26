//! `fuzz`: whatever a model is, what comes back is a number or an error that says why.
//!
//! Models are made as unreasonable as the builder lets through (`wild.rs`), one in three becomes a machine with elements in
//! its joints, motors, closed loops and couplings (`machine.rs`), and everything that can be asked of one is asked of each
//! (`ask.rs`). What is looked for are numbers that are none, and panics;
//! whether the numbers are right is what the suite and `accuracy` are for.

mod ask;
mod machine;
mod wild;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::cli::{Backend, FuzzArgs};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::run::Outcome;
use crate::suite::{self, Figure};
use ask::Answer;
use vertebra::{Body, JointKind, Model};
use vertebra_gpu::Device;

/// Models between two looks at the clock, and where a GPU answers, one at a time and slowly.
const BLOCK: u64 = 512;
const GPU_BLOCK: u64 = 8;

/// Models that are tried unless another number is asked for.
const MODELS: u64 = 100_000;
const GPU_MODELS: u64 = 256;

/// Failures that are printed, of as many as there are.
const SHOWN: usize = 20;

/// What came of the questions.
#[derive(Debug, Default, PartialEq, Eq)]
struct Tally {
    /// Models that were built.
    models: u64,
    /// Of each question, how often there was an answer, and how often an error of each kind.
    outcomes: BTreeMap<(&'static str, String), u64>,
    /// Number of the model, and what went wrong.
    failures: Vec<(u64, String)>,
}

impl Tally {
    fn count(&mut self, question: &'static str, outcome: &str) {
        *(self.outcomes.entry((question, outcome.to_owned()))).or_default() += 1;
    }

    fn merge(mut self, other: Self) -> Self {
        self.models += other.models;
        for (key, count) in other.outcomes {
            *self.outcomes.entry(key).or_default() += count;
        }
        self.failures.extend(other.failures);
        self
    }

    fn answers(&self) -> u64 {
        let given = self.outcomes.iter().filter(|((_, what), _)| what == ANSWER);
        given.map(|(_, count)| count).sum()
    }
}

/// The outcome of a question that was answered.
const ANSWER: &str = "answer";

/// Runs `fuzz`.
///
/// # Errors
/// If Ctrl-C cannot be heard, the seconds are too many to count, or there is no GPU to ask.
pub fn run(arguments: &FuzzArgs) -> anyhow::Result<Outcome> {
    let interrupt = Interrupt::on_ctrl_c()?;
    let limit = arguments
        .seconds
        .map(Duration::try_from_secs_f64)
        .transpose()?;
    let (asked, block_size, models) = match arguments.backend {
        Backend::Cpu => (Asked::Cpu, BLOCK, MODELS),
        Backend::Gpu => (
            Asked::Gpu(suite::gpu::device()?, Joints::Any),
            GPU_BLOCK,
            GPU_MODELS,
        ),
    };
    if let Asked::Gpu(device, _) = &asked {
        println!("device: {}", device.description());
    }
    let models = arguments.models.unwrap_or(models);
    let blocks = models.div_ceil(block_size);
    let mut progress = Progress::new(usize::try_from(blocks).unwrap_or(usize::MAX));
    let (start, mut tally) = (Instant::now(), Tally::default());
    for block in 0..blocks {
        if interrupt.requested() || limit.is_some_and(|limit| start.elapsed() > limit) {
            break;
        }
        let (from, to) = (block * block_size, ((block + 1) * block_size).min(models));
        let numbers = arguments.first.saturating_add(from)..arguments.first.saturating_add(to);
        tally = tally.merge(ask_all(&asked, arguments.seed, numbers));
        progress.done(&format!(
            "{} models, {} failures",
            tally.models,
            tally.failures.len()
        ));
    }
    progress.finish();
    for ((question, outcome), count) in &tally.outcomes {
        println!("{question:<28} {outcome:<28} {count:>12}");
    }
    let asked = match asked {
        Asked::Cpu => "",
        Asked::Gpu(..) => "--backend gpu ",
    };
    for (number, failure) in tally.failures.iter().take(SHOWN) {
        println!(
            "FAIL  model {number} ({asked}--seed {} --first {number} --models 1): {failure}",
            arguments.seed
        );
    }
    println!(
        "{} models of those tried could be built, {} answers, {} failures",
        tally.models,
        tally.answers(),
        tally.failures.len()
    );
    Ok(if interrupt.requested() {
        Outcome::Interrupted
    } else {
        Outcome::of(tally.failures.is_empty() && tally.answers() > 0)
    })
}

/// Who is asked.
enum Asked {
    Cpu,
    Gpu(Device, Joints),
}

/// Models of which a GPU is asked.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Joints {
    Any,
    /// Of hinges alone, and nothing in them: a processor that plays a GPU takes half a minute to compile for others.
    Hinges,
}

impl Joints {
    fn has(self, model: &Model) -> bool {
        let is_hinge = |body: &Body| matches!(body.joint.kind, JointKind::Revolute { .. });
        self == Self::Any || model.bodies().iter().all(is_hinge)
    }
}

/// Least and most models of the check, and the time after which no more are begun.
const CHECKED: (u64, u64) = (1024, 65_536);
const CHECKED_FOR: Duration = Duration::from_secs(6);

/// As many models as there is time for, as a check of the suite.
///
/// # Errors
/// If no question was answered.
pub fn no_nan() -> suite::Outcome {
    check(&Asked::Cpu, BLOCK, CHECKED, CHECKED_FOR)
}

/// The same of a GPU: so many models, or of a processor that plays one those of them that are hinges alone.
///
/// # Errors
/// If no question was answered.
pub(crate) fn no_nan_on(device: &Device, models: u64, is_software: bool) -> suite::Outcome {
    let joints = if is_software {
        Joints::Hinges
    } else {
        Joints::Any
    };
    let asked = Asked::Gpu(device.clone(), joints);
    check(&asked, GPU_BLOCK, (models, models), Duration::ZERO)
}

fn check(asked: &Asked, block: u64, (least, most): (u64, u64), limit: Duration) -> suite::Outcome {
    let (start, mut tally, mut tried) = (Instant::now(), Tally::default(), 0);
    while tried < least || (tried < most && start.elapsed() < limit) {
        let end = (tried + block).min(most);
        tally = tally.merge(ask_all(asked, 1, tried..end));
        tried = end;
    }
    #[expect(clippy::cast_precision_loss, reason = "a count in a figure")]
    let failures = tally.failures.len() as f64;
    let of = format!("failures of {tried} models and {} answers", tally.answers());
    let what = match tally.failures.first() {
        Some((number, failure)) => format!("{of}, the first of model {number}: {failure}"),
        None if tally.answers() == 0 => anyhow::bail!("no question was answered"),
        None => of,
    };
    Ok(vec![Figure::new(what, failures, 0.0)])
}

/// Asks everything of the models of these numbers, on the threads of the current rayon pool.
fn ask_all(asked: &Asked, seed: u64, numbers: core::ops::Range<u64>) -> Tally {
    let one = |number: u64| {
        let mut tally = Tally::default();
        let answered = catch_unwind(AssertUnwindSafe(|| {
            ask_one(asked, seed, number, &mut tally);
        }));
        if answered.is_err() {
            tally.failures.push((number, "a panic".to_owned()));
        }
        tally
    };
    let tallies: Vec<Tally> = numbers.into_par_iter().map(one).collect();
    tallies.into_iter().fold(Tally::default(), Tally::merge)
}

fn ask_one(asked: &Asked, seed: u64, number: u64, tally: &mut Tally) {
    let case = match wild::Case::new(seed, number) {
        Ok(case) => case,
        Err(error) => {
            tally.count("model", kind(&format!("{error:?}")));
            return;
        }
    };
    tally.models += 1;
    let mut failures = Vec::new();
    let heard = |question, answer| match answer {
        Answer::Numbers => tally.count(question, ANSWER),
        Answer::Refused(error) => tally.count(question, kind(&format!("{error:?}"))),
        Answer::Broken(what) => failures.push((number, format!("{question}: {what}"))),
    };
    match asked {
        Asked::Cpu => ask::everything(&case, heard),
        Asked::Gpu(device, joints) if joints.has(&case.model) => {
            ask::of_gpu(&case, (device, *joints == Joints::Any), heard);
        }
        Asked::Gpu(..) => {}
    }
    tally.failures.extend(failures);
}

/// Name of an error's kind: what its debug form starts with.
fn kind(debug: &str) -> &str {
    let end = debug.find(|c: char| !c.is_alphanumeric());
    &debug[..end.unwrap_or(debug.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_models_give_the_same_counts_on_any_number_of_threads() {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build()
                .unwrap()
                .install(|| ask_all(&Asked::Cpu, 3, 0..200))
        };
        let one = with(1);
        assert_eq!(one, with(3));
        assert!(one.models > 100 && one.answers() > 1000, "{one:?}");
    }

    /// Wild, but not so wild that all is refused, nor so tame that nothing is.
    #[test]
    fn there_are_answers_and_refusals_of_several_kinds() {
        let tally = ask_all(&Asked::Cpu, 7, 0..600);
        let kinds: std::collections::BTreeSet<&str> = tally
            .outcomes
            .keys()
            .map(|(_, kind)| kind.as_str())
            .collect();
        assert!(kinds.len() >= 4, "{kinds:?}");
        let of = |question: &str| {
            let key = (question, ANSWER.to_owned());
            tally
                .outcomes
                .iter()
                .find(|((q, what), _)| (*q, what.clone()) == key)
        };
        for (question, least) in [
            ("aba f64", 100),
            ("machine aba f64", 20),
            ("machine close_loops", 10),
        ] {
            let answers = of(question).map_or(0, |(_, &count)| count);
            assert!(answers > least, "{question}: {answers} answers");
        }
    }

    #[test]
    fn kinds_are_the_names_of_errors() {
        assert_eq!(kind("Overflow { quantity: 1 }"), "Overflow");
        assert_eq!(kind("Model(Empty)"), "Model");
        assert_eq!(kind("Plain"), "Plain");
    }
}
