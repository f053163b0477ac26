//! Every example of the facade runs to its end; those that need a GPU, where one is expected.

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::stages::Outcome;
use crate::vulkan;
use crate::workspace::Workspace;

/// Runs them one after another.
pub(super) fn run(sh: &Shell, workspace: &Workspace) -> Result<Outcome> {
    let examples = workspace.examples("vertebra");
    if examples.is_empty() {
        return Ok(Outcome::Skipped("the facade has no examples".to_owned()));
    }
    let has_gpu = vulkan::is_expected(sh);
    for (example, features) in examples {
        if features.contains(&"gpu") && !has_gpu {
            println!("{example} is left out: there is no driver of a GPU");
            continue;
        }
        cmd!(
            sh,
            "cargo run --package vertebra --all-features --example {example}"
        )
        .run()?;
    }
    Ok(Outcome::Passed)
}
