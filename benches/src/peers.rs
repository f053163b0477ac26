//! `peers`: other programs and ours on the same inputs, in one run.
//!
//! Each peer is a process that reads the exported input and is then asked to time its methods
//! ([`process`]). All methods of a problem, ours among them, take turns in short bursts
//! ([`rounds`]), so that whatever else the machine does falls on all of them alike. What each
//! method found is judged by what judges ours.

pub mod collision;
pub mod contender;
pub mod dynamics;
pub mod process;
pub mod report;
pub mod rounds;

use crate::cli::PeersArgs;
use crate::interrupt::Interrupt;
use crate::measure::Timing;
use crate::plot::plots;
use crate::progress::Progress;
use crate::results::{write_atomically, write_plots};
use crate::row::Row;
use crate::run::Outcome;
use anyhow::Context;
use contender::{Answer, Contender, Own};
use process::Process;
use rounds::{Measured, Plan};
use serde::Deserialize;
use std::path::Path;

/// Something to be solved by everyone.
pub trait Problem {
    /// Name of the scenario in the rows.
    fn scenario(&self) -> &str;

    /// Size, and what it counts.
    fn size(&self) -> (u64, &'static str);

    /// Writes the input that the peers read.
    ///
    /// # Errors
    /// If a file cannot be written, or the peers have no word for what is in it.
    fn export(&self, folder: &Path) -> anyhow::Result<()>;

    /// Our methods.
    ///
    /// # Errors
    /// If one cannot be set up.
    fn own(&self) -> anyhow::Result<Own<'_>>;

    /// The row with the error figures of an answer.
    ///
    /// # Errors
    /// If the answer is none to this problem.
    fn judge(&self, answer: &Answer, row: Row) -> anyhow::Result<Row>;
}

/// A peer as `--harnesses` lists it: how to run it, or why it cannot be.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Harness {
    /// Name for people.
    pub name: String,
    /// Program and arguments; the folder of the input comes last. Empty when it is absent.
    #[serde(default)]
    pub command: Vec<String>,
    /// Why it cannot be run.
    #[serde(default)]
    pub absent: Option<String>,
}

/// Runs `peers`. A peer that cannot be run costs no other: it is named at the end.
///
/// # Errors
/// If the list of peers cannot be read, an input cannot be exported, ours fails, or the results
/// cannot be written.
pub fn peers(arguments: &PeersArgs) -> anyhow::Result<Outcome> {
    let harnesses: Vec<Harness> = match &arguments.harnesses {
        Some(path) => {
            let text = std::fs::read_to_string(path)
                .with_context(|| format!("cannot read {}", path.display()))?;
            serde_json::from_str(&text).with_context(|| path.display().to_string())?
        }
        None => Vec::new(),
    };
    let mut missing: Vec<String> = harnesses
        .iter()
        .filter_map(|h| {
            let reason = h.absent.as_ref()?;
            Some(format!("{}: not run: {reason}", h.name))
        })
        .collect();
    let problems = match arguments.what.as_str() {
        collision::NAME => collision::problems()?,
        _ => dynamics::problems(arguments.quick, arguments.seed)?,
    };
    let plan = Plan::new(arguments.quick);
    let interrupt = Interrupt::on_ctrl_c()?;
    let load_before = report::load();
    let input = std::env::temp_dir().join(format!("vertebra-peers-{}", std::process::id()));
    let outcome = measure_all(&problems, &input, &harnesses, &plan, &interrupt);
    // It is made anew for every problem and may not exist at all.
    drop(std::fs::remove_dir_all(&input));
    let (measured, failed) = outcome?;
    missing.extend(failed);
    let report = report::Report {
        what: &arguments.what,
        plan,
        measured: &measured,
        missing: &missing,
        loads: [load_before, report::load()],
    };
    println!("{}", report.terminal());
    for (ending, text) in report.files()? {
        let path = arguments
            .out
            .join(format!("peers-{}.{ending}", arguments.what));
        write_atomically(&path, text.as_bytes())?;
        println!("wrote {}", path.display());
    }
    let rows: Vec<Row> = measured.iter().map(|judged| judged.row.clone()).collect();
    let folder = arguments.out.join(format!("peers-{}", arguments.what));
    for path in write_plots(&folder, &plots(&rows))? {
        println!("wrote {}", path.display());
    }
    Ok(if interrupt.requested() {
        Outcome::Interrupted
    } else {
        Outcome::Success
    })
}

/// A judged measurement, and what it may be compared with.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The measurement.
    pub row: Row,
    /// Methods of one stage answer the same question from the same starting point.
    pub stage: String,
    /// Whether the method is ours.
    pub own: bool,
}

/// Measures everyone on every problem; what could not be measured, a line each.
fn measure_all(
    problems: &[Box<dyn Problem>],
    folder: &Path,
    harnesses: &[Harness],
    plan: &Plan,
    interrupt: &Interrupt,
) -> anyhow::Result<(Vec<Judged>, Vec<String>)> {
    let (mut measured, mut missing) = (Vec::new(), Vec::new());
    let mut progress = Progress::new(problems.len());
    for problem in problems {
        if interrupt.requested() {
            break;
        }
        let (size, unit) = problem.size();
        let label = format!("{}, {size} {unit}", problem.scenario());
        progress.begin(&label);
        let (judged, failed) = measure(problem.as_ref(), folder, harnesses, plan, interrupt)?;
        progress.done(&format!("{label}: {} methods", judged.len()));
        measured.extend(judged);
        missing.extend(failed);
    }
    progress.finish();
    Ok((measured, missing))
}

/// Measures everyone on one problem; what could not be measured, a line each.
fn measure(
    problem: &dyn Problem,
    folder: &Path,
    harnesses: &[Harness],
    plan: &Plan,
    interrupt: &Interrupt,
) -> anyhow::Result<(Vec<Judged>, Vec<String>)> {
    problem.export(folder)?;
    let mut failed = Vec::new();
    let mut contenders: Vec<Box<dyn Contender + '_>> = vec![Box::new(problem.own()?)];
    for harness in harnesses.iter().filter(|h| h.absent.is_none()) {
        match Process::start(&harness.command, folder) {
            Ok(process) => contenders.push(Box::new(process)),
            Err(error) => failed.push(complaint(problem, &harness.name, &error)),
        }
    }
    let (measured, errors) = rounds::measure(&mut contenders, plan, interrupt);
    let mut judged = Vec::new();
    for Measured {
        contender,
        method,
        samples,
        answer,
    } in measured
    {
        let Some(timing) = Timing::from_samples(samples) else {
            continue;
        };
        let (size, unit) = problem.size();
        let peer = contenders[contender].name();
        let row = Row::new(
            problem.scenario(),
            &method.name,
            &method.precision,
            size,
            unit,
            &timing,
        );
        let row = Row {
            note: format!("{peer}; {}", method.note),
            ..row
        };
        let row = problem.judge(&answer, row).and_then(|row| {
            row.validate()?;
            Ok(row)
        });
        match row {
            Ok(row) => judged.push(Judged {
                row,
                stage: method.stage,
                own: contender == 0,
            }),
            Err(error) if contender == 0 => return Err(error),
            Err(error) => failed.push(complaint(problem, peer, &error)),
        }
    }
    for (contender, error) in errors {
        // Whoever Ctrl-C ended did not fail.
        if interrupt.requested() {
            continue;
        }
        if contender == 0 {
            return Err(error);
        }
        failed.push(complaint(problem, contenders[contender].name(), &error));
    }
    Ok((judged, failed))
}

fn complaint(problem: &dyn Problem, peer: &str, error: &anyhow::Error) -> String {
    let (size, unit) = problem.size();
    format!(
        "{peer}: not measured on {} ({size} {unit}): {error:#}",
        problem.scenario()
    )
}
