//! Stages that are run one after another, and the summary of them.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use xshell::Cmd;

/// What a stage that did not fail came to.
pub(crate) enum Outcome {
    /// It ran and found nothing wrong.
    Passed,
    /// It could not be run here, for this reason.
    Skipped(String),
}

/// Which stages to run.
#[derive(clap::Args)]
pub(crate) struct Selection {
    /// Run only this stage, by the name in the summary; may be given several times
    #[arg(long, value_name = "STAGE")]
    only: Vec<String>,
    /// Go on after a failed stage
    #[arg(long)]
    keep_going: bool,
}

/// How one stage ended.
enum End {
    Passed,
    Skipped(String),
    Failed(String),
    /// An earlier one failed.
    NotRun,
}

/// The stages so far.
pub(crate) struct Stages<'a> {
    /// The command the stages belong to, for the hint how to run one again.
    command: &'static str,
    selection: &'a Selection,
    ends: Vec<(&'static str, Duration, End)>,
    /// Names of the stages that were not asked for.
    others: Vec<&'static str>,
}

impl<'a> Stages<'a> {
    /// No stages yet of `cargo xtask <command>`.
    pub(crate) fn new(command: &'static str, selection: &'a Selection) -> Self {
        Self {
            command,
            selection,
            ends: Vec::new(),
            others: Vec::new(),
        }
    }

    /// Runs a stage, unless one before it failed or it was not asked for.
    pub(crate) fn run(&mut self, name: &'static str, stage: impl FnOnce() -> Result<Outcome>) {
        if !self.selection.only.is_empty() && !self.selection.only.iter().any(|only| only == name) {
            self.others.push(name);
            return;
        }
        if self.failed() > 0 && !self.selection.keep_going {
            self.ends.push((name, Duration::ZERO, End::NotRun));
            return;
        }
        println!("\n=== {name} ===");
        let start = Instant::now();
        let end = match stage() {
            Ok(Outcome::Passed) => End::Passed,
            Ok(Outcome::Skipped(reason)) => {
                println!("skipped: {reason}");
                End::Skipped(reason)
            }
            Err(error) => {
                println!("failed: {error:#}");
                End::Failed(format!("{error:#}"))
            }
        };
        self.ends.push((name, start.elapsed(), end));
    }

    /// Prints the summary, whose last line is `N passed, N failed`, and gives the exit status.
    pub(crate) fn finish(self) -> Result<ExitCode> {
        for only in &self.selection.only {
            if !self.ends.iter().any(|(name, ..)| name == only) {
                bail!(
                    "there is no stage `{only}`; the stages are: {}",
                    self.others.join(", ")
                );
            }
        }
        println!("\n=== summary ===\n{}", self.summary());
        Ok(if self.failed() == 0 {
            ExitCode::SUCCESS
        } else {
            ExitCode::FAILURE
        })
    }

    fn failed(&self) -> usize {
        self.ends
            .iter()
            .filter(|(.., end)| matches!(end, End::Failed(_)))
            .count()
    }

    fn summary(&self) -> String {
        let mut text = String::new();
        let width = self
            .ends
            .iter()
            .map(|(name, ..)| name.len())
            .max()
            .unwrap_or(0);
        for (name, time, end) in &self.ends {
            let (word, detail) = match end {
                End::Passed => ("passed", String::new()),
                End::Skipped(reason) => ("skipped", reason.clone()),
                End::Failed(error) => (
                    "FAILED",
                    format!(
                        "{error}\n    run it again: cargo xtask {} --only {name}",
                        self.command
                    ),
                ),
                End::NotRun => (
                    "not run",
                    "an earlier stage failed; --keep-going runs it all the same".to_owned(),
                ),
            };
            let line = format!(
                "{word:<8} {name:<width$} {:>7.1} s  {detail}",
                time.as_secs_f64()
            );
            text.push_str(line.trim_end());
            text.push('\n');
        }
        let passed = self
            .ends
            .iter()
            .filter(|(.., end)| matches!(end, End::Passed))
            .count();
        text.push_str(&format!("{passed} passed, {} failed", self.failed()));
        text
    }
}

/// Runs a command as a stage.
pub(crate) fn command(command: &Cmd<'_>) -> Result<Outcome> {
    command.run()?;
    Ok(Outcome::Passed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    fn selection(only: &[&str], keep_going: bool) -> Selection {
        Selection {
            only: only.iter().map(|name| (*name).to_owned()).collect(),
            keep_going,
        }
    }

    /// Runs four stages, the second skipped and the third failing.
    fn stages(selection: &Selection) -> Stages<'_> {
        let mut stages = Stages::new("test", selection);
        stages.run("first", || Ok(Outcome::Passed));
        stages.run("second", || Ok(Outcome::Skipped("no tool".to_owned())));
        stages.run("third", || Err(anyhow!("broken")));
        stages.run("fourth", || Ok(Outcome::Passed));
        stages
    }

    #[test]
    fn the_first_failure_ends_the_run_and_the_last_line_counts() {
        let all = selection(&[], false);
        let summary = stages(&all).summary();
        assert_eq!(summary.lines().last(), Some("1 passed, 1 failed"));
        assert!(
            summary.contains("skipped  second") && summary.contains("no tool"),
            "{summary}"
        );
        assert!(
            summary.contains("run it again: cargo xtask test --only third"),
            "{summary}"
        );
        assert!(summary.contains("not run  fourth"), "{summary}");
    }

    #[test]
    fn keep_going_and_only_choose_stages() {
        let on = selection(&[], true);
        assert_eq!(
            stages(&on).summary().lines().last(),
            Some("2 passed, 1 failed")
        );
        let some = selection(&["fourth"], false);
        assert_eq!(
            stages(&some).summary().lines().last(),
            Some("1 passed, 0 failed")
        );
        let wrong = selection(&["fith"], false);
        let error = stages(&wrong).finish().unwrap_err().to_string();
        assert!(
            error.contains("fith") && error.contains("first, second, third, fourth"),
            "{error}"
        );
    }
}
