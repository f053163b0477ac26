//! A quick benchmark run from end to end, and a look at everything it wrote.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use super::results;
use crate::binary::{self, Build};
use crate::stages::Outcome;
use crate::workspace::Workspace;

/// Runs the benchmark with `--quick` into a fresh folder and checks the files.
pub(super) fn run(sh: &Shell, workspace: &Workspace) -> Result<Outcome> {
    let program = binary::build(sh, Build::Tested)?;
    let out = workspace.target_directory()?.join("ci-bench");
    // What an earlier run left must not pass for this one's.
    sh.remove_path(&out)?;
    cmd!(sh, "{program} bench --quick --out {out}").run()?;

    let rows = results::check(&read(&out.join("results.json"))?)?;
    let csv = read(&out.join("results.csv"))?;
    ensure!(
        csv.lines().count() > rows,
        "results.csv has fewer lines than results.json has rows"
    );
    ensure!(
        !read(&out.join("report.md"))?.is_empty(),
        "report.md is empty"
    );
    let plots = check_plots(&out.join("plots"))?;
    println!("{rows} rows and {plots} plots are in order");
    Ok(Outcome::Passed)
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// Checks that there are plots, each whole and in both formats, and counts them.
fn check_plots(folder: &Path) -> Result<usize> {
    let mut plots = 0;
    for entry in
        fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?
    {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "svg") {
            ensure!(
                read(&path)?.trim_end().ends_with("</svg>"),
                "{} is not whole",
                path.display()
            );
            let png = path.with_extension("png");
            let bytes = fs::read(&png).with_context(|| format!("cannot read {}", png.display()))?;
            let whole =
                bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes.ends_with(b"IEND\xaeB`\x82");
            ensure!(whole, "{} is not whole", png.display());
            plots += 1;
        }
    }
    ensure!(plots > 0, "there is no plot in {}", folder.display());
    Ok(plots)
}
