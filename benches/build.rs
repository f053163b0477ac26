//! Tells the program which commit it is built from, so that each row of results names it: that of the environment's
//! `VERTEBRA_COMMIT`, or of the repository where there is one.

use std::env;
use std::process::Command;

/// Sources that make a build differ from its commit until they are committed.
const SOURCES: [&str; 5] = [
    "build.rs",
    "src",
    "../crates",
    "../shaders",
    "../Cargo.lock",
];

fn main() {
    println!("cargo::rerun-if-env-changed=VERTEBRA_COMMIT");
    // Only builds to measure with are compiled anew for a commit.
    let is_measured = env::var("PROFILE").is_ok_and(|profile| profile == "release");
    if !is_measured || env::var("VERTEBRA_COMMIT").is_ok() {
        println!("cargo::rerun-if-changed=build.rs");
        return;
    }
    let history = git(&["rev-parse", "--git-path", "logs/HEAD"]);
    for path in SOURCES.into_iter().chain(history.as_deref()) {
        println!("cargo::rerun-if-changed={path}");
    }
    let name = git(&[
        "describe",
        "--always",
        "--dirty",
        "--abbrev=12",
        "--exclude",
        "*",
    ]);
    let date = git(&["log", "-1", "--format=%cs"]);
    if let (Some(name), Some(date)) = (name, date) {
        println!("cargo::rustc-env=VERTEBRA_COMMIT={name} of {date}");
    }
}

/// What git answers; `None` without git or outside a repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let answer = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !answer.is_empty()).then_some(answer)
}
