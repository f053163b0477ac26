//! The standalone benchmark binary: it needs neither cargo nor the sources.

#![expect(
    clippy::print_stdout,
    reason = "a command-line program talks on stdout"
)]

use anyhow::Context;
use clap::Parser;
use std::process::ExitCode;
use vertebra_bench::cli::{Cli, Command, CompareArgs, ReportArgs};
use vertebra_bench::run::Outcome;
use vertebra_bench::{
    accuracy, compare, export, fuzz, interrupt, motion, peers, replay, results, run, selftest,
};

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Bench(arguments) => run::bench(&arguments),
        Command::Accuracy(arguments) => accuracy::run(&arguments),
        Command::Motion(arguments) => motion::run(&arguments),
        Command::Fuzz(arguments) => fuzz::run(&arguments),
        Command::Compare(arguments) => judge(&arguments).map(Outcome::of),
        Command::Report(arguments) => report(&arguments).map(|()| Outcome::Success),
        Command::Selftest {
            figures,
            full,
            backend,
            only,
        } => selftest::selftest(backend, figures, full, &only).map(Outcome::of),
        Command::Replay { file, dump, rows } => {
            replay::replay(&file, dump.as_deref(), rows).map(Outcome::of)
        }
        Command::Export(arguments) => export::export(&arguments).map(|()| Outcome::Success),
        Command::Peers(arguments) => peers::peers(&arguments),
    };
    match outcome {
        Ok(Outcome::Success) => ExitCode::SUCCESS,
        Ok(Outcome::Failure) => ExitCode::FAILURE,
        Ok(Outcome::Interrupted) => ExitCode::from(interrupt::EXIT_STATUS),
        Err(error) => {
            eprintln!("error: {}", run::whole(&error));
            ExitCode::FAILURE
        }
    }
}

fn judge(arguments: &CompareArgs) -> anyhow::Result<bool> {
    let old = results::read_results(&arguments.old)?;
    let new = results::read_results(&arguments.new)?;
    let verdicts = compare::compare(&old, &new);
    println!("{}", compare::to_table(&verdicts));
    compare::refuse_strangers(&verdicts)?;
    let worse = verdicts.iter().any(compare::Verdict::is_regression);
    Ok(!(arguments.fail_on_regression && worse))
}

fn report(arguments: &ReportArgs) -> anyhow::Result<()> {
    let [data] = &arguments.results[..] else {
        return together(arguments);
    };
    let folder = if data.is_dir() {
        data
    } else {
        data.parent().unwrap_or(data)
    };
    let out = arguments.out.as_deref().unwrap_or(folder);
    let mut written = Vec::new();
    if data.is_dir() {
        written.extend(accuracy::write_again(folder, out)?);
        written.extend(motion::write_again(folder, out)?);
    }
    let has_rows = data.is_file() || folder.join(results::RESULTS_JSON).exists();
    anyhow::ensure!(
        has_rows || !written.is_empty(),
        "{}: there is no results.json, accuracy.json or motion.json; name a folder that `bench`, `accuracy` or `motion` \
         has written",
        data.display()
    );
    if has_rows {
        let rows = results::read_results(data)?;
        written.extend(results::write_results(out, &rows)?);
    }
    for path in written {
        println!("wrote {}", path.display());
    }
    Ok(())
}

/// What several runs have in common.
fn together(arguments: &ReportArgs) -> anyhow::Result<()> {
    for data in &arguments.results {
        anyhow::ensure!(
            data.is_file() || data.join(results::RESULTS_JSON).exists(),
            "{}: there is no results.json, which several runs are put together from; name folders that `bench` has written, or folders of \
             `accuracy` and `motion` one at a time",
            data.display()
        );
    }
    let runs = arguments
        .results
        .iter()
        .map(|path| results::read_results(path));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    let out = arguments.out.as_deref();
    let out = out.context("--out: name a folder for what the runs have in common")?;
    for path in results::write_together(out, &runs)? {
        println!("wrote {}", path.display());
    }
    Ok(())
}
