//! `cargo xtask ci`: everything that must pass before a change is merged.
//!
//! It needs a compiler and nothing else: what a machine lacks is added by rustup or named in the
//! summary.

mod compiler;
mod examples;
mod features;
mod fuzz;
mod results;
mod smoke;

use std::process::ExitCode;

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::binary::{self, Build};
use crate::stages::{Outcome, Selection, Stages, command};
use crate::workspace::{self, Workspace};
use crate::{test, vulkan};

/// Arguments of the command.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    selection: Selection,
}

/// Runs the stages and prints their summary.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let sh = &workspace::shell()?;
    let workspace = &Workspace::load(sh)?;
    let mut stages = Stages::new("ci", &arguments.selection);
    stages.run("compiler", || compiler::check(sh, workspace));
    test::add_stages(&mut stages, sh, &[]);
    stages.run("features", || {
        features::check_without_defaults(sh, workspace)
    });
    stages.run("wasm", || features::check_wasm(sh));
    stages.run("fuzz", || fuzz::check(sh, workspace));
    stages.run("deny", || {
        if workspace::has_subcommand(sh, "deny") {
            command(&cmd!(sh, "cargo deny --workspace check"))
        } else {
            Ok(Outcome::Skipped(
                "not available here: cargo install --locked cargo-deny".to_owned(),
            ))
        }
    });
    stages.run("bench", || smoke::run(sh, workspace));
    stages.run("selftest", || selftest(sh, &["--only", "gold"]));
    stages.run("selftest-gpu", || match vulkan::provide(sh)? {
        Outcome::Skipped(reason) if !vulkan::is_expected(sh) => Ok(Outcome::Skipped(reason)),
        _ => selftest(
            sh,
            &["--backend", "gpu", "--only", "gold", "--only", "shapes"],
        ),
    });
    stages.run("examples", || examples::run(sh, workspace));
    stages.finish()
}

/// The checks of the standalone program are the tests' own, which have all run by then: a few show that
/// it finds its data and the device.
fn selftest(sh: &Shell, arguments: &[&str]) -> Result<Outcome> {
    let program = binary::build(sh, Build::Tested)?;
    command(&cmd!(sh, "{program} selftest {arguments...}"))
}
