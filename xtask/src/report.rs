//! `cargo xtask report`: every table and picture of stored data again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::binary::{self, Build};
use crate::workspace;

/// Files from which a folder's tables and pictures are made.
const DATA: [&str; 3] = ["results.json", "accuracy.json", "motion.json"];

/// Where data are stored: results, and the errors that the suite compares with.
const ROOTS: [&str; 2] = ["docs/results", "benches/accuracy"];

/// What the runs of CPUs and GPUs say together is written here.
const TOGETHER: &str = "docs/results/together";

/// Draws them. What is measured by another command (`bench --report`, `accuracy`, `motion`) stays as it
/// is.
pub(crate) fn run() -> Result<ExitCode> {
    let sh = &workspace::shell()?;
    let program = binary::build(sh, Build::Release)?;
    let mut runs = Vec::new();
    for root in ROOTS {
        let folders = folders(Path::new(root), sh)?;
        ensure!(!folders.is_empty(), "there are no data below {root}");
        for folder in folders {
            cmd!(sh, "{program} report {folder}").run()?;
            if folder.join(DATA[0]).is_file() {
                runs.push(folder);
            }
        }
    }
    cmd!(sh, "{program} report {runs...} --out {TOGETHER}").run()?;
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
