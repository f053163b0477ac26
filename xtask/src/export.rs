//! `cargo xtask export`

use std::process::ExitCode;

use anyhow::Result;

use crate::binary;

/// Write a scenario to files.
pub(crate) fn run(arguments: &binary::Arguments) -> Result<ExitCode> {
    binary::run("export", arguments)
}
