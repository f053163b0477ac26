//! Benchmarks of `vertebra`: every number comes with the error of the result it was measured on.
//!
//! A scenario is measured by [`measure::sample`], becomes a [`row::Row`] with its error figures, and
//! [`results`] writes the rows of a run as JSON, CSV, a Markdown report and plots. [`compare`] judges
//! one run against another.

#![expect(
    clippy::print_stdout,
    reason = "a command-line program talks on stdout"
)]

pub mod accuracy;
pub mod cli;
pub mod compare;
mod crossover;
pub mod csv;
pub mod export;
pub mod frames;
pub mod fuzz;
pub mod interrupt;
pub mod measure;
pub mod motion;
pub mod peers;
pub mod plot;
pub mod progress;
pub mod replay;
pub mod report;
pub mod results;
pub mod row;
pub mod run;
pub mod scenario;
pub mod selftest;
pub mod suite;
pub mod table;
