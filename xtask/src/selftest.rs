//! `cargo xtask selftest`

use std::process::ExitCode;

use anyhow::Result;

use crate::binary;

/// Check the shared test suite on this machine.
pub(crate) fn run(arguments: &binary::Arguments) -> Result<ExitCode> {
    binary::run("selftest", arguments)
}
