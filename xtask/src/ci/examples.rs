//! Every example of the facade runs to its end; those that need a GPU, where one is expected. Scenes write what they did.

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::binary;
use crate::stages::Outcome;
use crate::vulkan;
use crate::workspace::Workspace;

/// Runs them one after another.
pub(super) fn run(sh: &Shell, workspace: &Workspace) -> Result<Outcome> {
    let examples = workspace.examples("vertebra");
    if examples.is_empty() {
        return Ok(Outcome::Skipped("the facade has no examples".to_owned()));
    }
    // With the tests' features and profile, so that they are there already; asking for one package
    // alone would compile what it needs again.
    let messages = cmd!(
        sh,
        "cargo build --workspace --all-features --examples --message-format json-render-diagnostics"
    )
    .read()?;
    let folder = sh.create_temp_dir()?;
    let has_gpu = vulkan::is_expected(sh);
    for (example, features) in examples {
        if features.contains(&"gpu") && !has_gpu {
            println!("{example} is left out: there is no driver of a GPU");
            continue;
        }
        let program = binary::executable(&messages, example)
            .with_context(|| format!("cargo did not say where the example {example} lies"))?;
        // Scenes are those that need the crate of files.
        let is_scene = features
            .iter()
            .any(|&feature| feature == "files" || feature == "pdb");
        let files: Vec<_> = (["glb", "json"].iter().filter(|_| is_scene))
            .map(|ending| folder.path().join(format!("{example}.{ending}")))
            .collect();
        let paths = &files;
        cmd!(sh, "{program} {paths...}").run()?;
        for file in &files {
            ensure!(
                sh.path_exists(file),
                "{example} wrote no {}",
                file.display()
            );
            sh.remove_path(file)?;
        }
    }
    Ok(Outcome::Passed)
}
