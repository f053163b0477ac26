//! The libraries without their default features, and on a target without threads or files.

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::stages::{Outcome, command};
use crate::workspace::{self, Workspace};

/// The target that browsers run.
const WASM: &str = "wasm32-unknown-unknown";

/// Checks each library by itself: a feature that another crate turns on would hide what it lacks.
pub(super) fn check_without_defaults(sh: &Shell, workspace: &Workspace) -> Result<Outcome> {
    let lint = workspace::require_component(sh, "clippy", "clippy").is_ok();
    for package in workspace.libraries() {
        if lint {
            cmd!(
                sh,
                "cargo clippy --package {package} --no-default-features -- --deny warnings"
            )
            .run()?;
        } else {
            cmd!(sh, "cargo check --package {package} --no-default-features").run()?;
        }
    }
    Ok(Outcome::Passed)
}

/// Checks the facade, and the GPU by itself, for WebAssembly.
pub(super) fn check_wasm(sh: &Shell) -> Result<Outcome> {
    match workspace::require_target(sh, WASM) {
        Ok(()) => command(&cmd!(
            sh,
            "cargo check --package vertebra --package vertebra-shaders --no-default-features --target {WASM}"
        )),
        Err(reason) => Ok(Outcome::Skipped(reason)),
    }
}
