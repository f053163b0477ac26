//! The benchmark program `vertebra-bench`: built in release mode and run in place of this process,
//! or built as the tests are.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result};
use serde_json::Value;
use xshell::{Shell, cmd};

use crate::workspace;

/// Arguments handed on as they are, `--help` among them.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// Builds the program and runs one of its commands in the caller's working directory, with its exit
/// status.
pub(crate) fn run(command: &str, arguments: &Arguments) -> Result<ExitCode> {
    let program = build(&workspace::shell()?, Build::Release)?;
    replace(
        Command::new(program)
            .arg(command)
            .args(&arguments.arguments)
            .env(workspace::QUIET.0, workspace::QUIET.1),
    )
}

/// How the program is built.
#[derive(Clone, Copy)]
pub(crate) enum Build {
    /// To measure with.
    Release,
    /// With the tests' profile and features: after them there is nothing left to compile.
    Tested,
}

/// Builds the program and returns its path.
pub(crate) fn build(sh: &Shell, how: Build) -> Result<PathBuf> {
    let options: &[&str] = match how {
        Build::Release => &["--release", "--package", "vertebra-bench", "--bins"],
        // Without the tests what they depend on would have fewer features, and be compiled again.
        Build::Tested => &["--workspace", "--all-features", "--bins", "--tests"],
    };
    let build = cmd!(
        sh,
        "cargo build {options...} --message-format json-render-diagnostics"
    );
    let messages = build.read()?;
    executable(&messages, "vertebra-bench")
        .context("cargo built vertebra-bench but did not say where it lies")
}

/// The path of a program in the messages of `cargo build`.
pub(crate) fn executable(messages: &str, name: &str) -> Option<PathBuf> {
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .find_map(|message| {
            // The tests of a program are one of its name too.
            let is_asked = message["target"]["name"] == name && message["profile"]["test"] != true;
            is_asked.then_some(())?;
            message["executable"].as_str().map(PathBuf::from)
        })
}

/// Becomes the command, so that Ctrl-C reaches it alone and nothing stands between it and the
/// caller.
#[cfg(unix)]
fn replace(command: &mut Command) -> Result<ExitCode> {
    use std::os::unix::process::CommandExt;
    Err(command.exec()).with_context(|| format!("cannot run {}", command.get_program().display()))
}

/// Runs the command and returns its exit status.
#[cfg(not(unix))]
fn replace(command: &mut Command) -> Result<ExitCode> {
    let status = command
        .status()
        .with_context(|| format!("cannot run {}", command.get_program().display()))?;
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_is_found_among_the_messages() {
        let messages = r#"{"reason":"compiler-artifact","target":{"name":"vertebra"},"executable":null}
not a message
{"reason":"compiler-artifact","target":{"name":"vertebra-bench"},"profile":{"test":true},"executable":"/target/release/deps/vertebra_bench-0"}
{"reason":"compiler-artifact","target":{"name":"vertebra-bench"},"profile":{"test":false},"executable":"/target/release/vertebra-bench"}
{"reason":"build-finished","success":true}"#;
        assert_eq!(
            executable(messages, "vertebra-bench"),
            Some(PathBuf::from("/target/release/vertebra-bench"))
        );
        assert_eq!(
            executable(
                r#"{"reason":"build-finished","success":true}"#,
                "vertebra-bench"
            ),
            None
        );
    }
}
