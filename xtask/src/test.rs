//! `cargo xtask test`: formatting, lints, documentation and tests.

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::stages::{Outcome, Selection, Stages, command};
use crate::{vulkan, workspace};

/// Arguments of the command.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    selection: Selection,
    /// Names of tests to run, and other arguments for the test runner
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "FILTER"
    )]
    filter: Vec<OsString>,
}

/// Runs the stages and prints their summary.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let sh = workspace::shell()?;
    let mut stages = Stages::new("test", &arguments.selection);
    add_stages(&mut stages, &sh, &arguments.filter);
    stages.finish()
}

/// The stages of `cargo xtask test`, with which `cargo xtask ci` begins too.
pub(crate) fn add_stages(stages: &mut Stages<'_>, sh: &Shell, filter: &[OsString]) {
    stages.run("fmt", || {
        match workspace::require_component(sh, "rustfmt", "fmt") {
            Ok(()) => command(&cmd!(sh, "cargo fmt --all --check")),
            Err(reason) => Ok(Outcome::Skipped(reason)),
        }
    });
    stages.run("clippy", || {
        match workspace::require_component(sh, "clippy", "clippy") {
            Ok(()) => command(&cmd!(
                sh,
                "cargo clippy --workspace --all-targets --all-features -- --deny warnings"
            )),
            Err(reason) => Ok(Outcome::Skipped(reason)),
        }
    });
    stages.run("doc", || {
        let doc = cmd!(sh, "cargo doc --workspace --all-features --no-deps");
        command(&doc.env("RUSTDOCFLAGS", "--deny warnings"))
    });
    stages.run("vulkan", || vulkan::provide(sh));
    stages.run("tests", || {
        let tests = if workspace::has_subcommand(sh, "nextest") {
            cmd!(
                sh,
                "cargo nextest run --workspace --all-features --no-fail-fast {filter...}"
            )
        } else {
            let targets = ["--lib", "--bins", "--tests", "--examples"];
            cmd!(
                sh,
                "cargo test --workspace --all-features {targets...} --no-fail-fast {filter...}"
            )
        };
        command(&vulkan::expecting(sh, tests))
    });
    stages.run("doctests", || {
        let tests = cmd!(
            sh,
            "cargo test --workspace --all-features --doc --no-fail-fast {filter...}"
        );
        command(&vulkan::expecting(sh, tests))
    });
}
