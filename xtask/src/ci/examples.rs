//! Every example of the facade runs to its end.

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::stages::Outcome;
use crate::workspace::Workspace;

/// Runs them one after another.
pub(super) fn run(sh: &Shell, workspace: &Workspace) -> Result<Outcome> {
    let examples = workspace.examples("vertebra");
    if examples.is_empty() {
        return Ok(Outcome::Skipped("the facade has no examples".to_owned()));
    }
    for example in examples {
        cmd!(
            sh,
            "cargo run --package vertebra --all-features --example {example}"
        )
        .run()?;
    }
    Ok(Outcome::Passed)
}
