//! The fuzz targets compile, though nothing runs them: that takes a nightly compiler.

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::stages::{Outcome, command};
use crate::workspace::Workspace;

/// Checks them as the workspace of their own that they are. Their runtime is C++: a machine without
/// a compiler for that fails.
pub(super) fn check(sh: &Shell, workspace: &Workspace) -> Result<Outcome> {
    let target = workspace.target_directory()?.join("fuzz");
    command(&cmd!(
        sh,
        "cargo check --manifest-path fuzz/Cargo.toml --target-dir {target}"
    ))
}
