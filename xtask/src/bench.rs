//! `cargo xtask bench`

use std::process::ExitCode;

use anyhow::Result;

use crate::binary;

/// Measure.
pub(crate) fn run(arguments: &binary::Arguments) -> Result<ExitCode> {
    binary::run("bench", arguments)
}
