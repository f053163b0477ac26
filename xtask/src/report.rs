//! `cargo xtask report`: every table and picture under docs/results again, from the data stored there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::binary::{self, Build};
use crate::workspace;

/// Files from which a folder's tables and pictures are made.
const DATA: [&str; 3] = ["results.json", "accuracy.json", "motion.json"];

/// Draws them. What is measured by another command (`bench --report`, `accuracy`, `motion`) stays as it
/// is.
pub(crate) fn run() -> Result<ExitCode> {
    let sh = &workspace::shell()?;
    let folders = folders(Path::new("docs/results"), sh)?;
    ensure!(!folders.is_empty(), "there are no data below docs/results");
    let program = binary::build(sh, Build::Release)?;
    for folder in folders {
        cmd!(sh, "{program} report {folder}").run()?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The folders that hold data, `root` and all below.
fn folders(root: &Path, sh: &Shell) -> Result<Vec<PathBuf>> {
    let root = sh.current_dir().join(root);
    let mut found = Vec::new();
    let mut pending = vec![root];
    while let Some(folder) = pending.pop() {
        if DATA.iter().any(|name| folder.join(name).is_file()) {
            found.push(folder.clone());
        }
        let entries =
            fs::read_dir(&folder).with_context(|| format!("cannot list {}", folder.display()))?;
        for entry in entries {
            let path = entry?.path();
            if path.is_dir() {
                pending.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}
