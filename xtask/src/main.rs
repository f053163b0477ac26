//! Developer commands, run as `cargo xtask <command>`.
//!
//! What `cargo xtask ci` runs is what the checks of the project are: there is no second list of
//! them. It links none of the project's crates, so that it starts in seconds.
#![expect(clippy::print_stdout, reason = "a command-line program")]

mod bench;
mod binary;
mod ci;
mod export;
mod peers;
mod report;
mod selftest;
mod stages;
mod test;
mod vulkan;
mod workspace;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Developer commands of vertebra.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Build the benchmark in release mode and measure; takes the arguments of `vertebra-bench
    /// bench`
    #[command(disable_help_flag = true)]
    Bench(binary::Arguments),
    /// Write a scenario to files; takes the arguments of `vertebra-bench export`
    #[command(disable_help_flag = true)]
    Export(binary::Arguments),
    /// Check the shared test suite on this machine; takes the arguments of `vertebra-bench
    /// selftest`
    #[command(disable_help_flag = true)]
    Selftest(binary::Arguments),
    /// Install other programs and measure them beside ours on the same inputs
    ///
    /// Debian packages that are missing are installed by `apt-get update` and `apt-get install`, which
    /// change the system: as root, or through `sudo -n` where sudo asks for no password. Python
    /// packages go into an environment of their own under target/peers, by pip. With --no-install
    /// neither is run.
    Peers(peers::Arguments),
    /// Draw every table and picture under docs/results again, from the data stored there
    Report,
    /// Formatting, lints, documentation and tests
    Test(test::Arguments),
    /// Everything that must pass before a change is merged
    Ci(ci::Arguments),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Selftest(arguments) => selftest::run(&arguments),
        Command::Peers(arguments) => peers::run(&arguments),
        Command::Report => report::run(),
        Command::Test(arguments) => test::run(&arguments),
        Command::Ci(arguments) => ci::run(&arguments),
    };
    outcome.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}
