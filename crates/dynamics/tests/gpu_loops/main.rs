//! Closed loops and coupled joints on a GPU against the CPU.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

#[path = "../driven/mod.rs"]
mod driven;
#[path = "../remote/mod.rs"]
mod remote;

mod batches;
mod elements;
mod mechanisms;
mod motion;
mod questions;
mod refused;

use vertebra_dynamics::Precision;
use vertebra_dynamics::gpu::Options;

fn options((chunks, tree): (Precision, Precision)) -> Options {
    Options {
        chunks: Some(chunks),
        tree: Some(tree),
        ..Options::default()
    }
}

/// Loops spread what is rounded by their compliances; in f32 mu is larger, and so is what redundant loops lose.
fn bound((chunks, tree): (Precision, Precision)) -> f64 {
    let spread = if chunks == Precision::F32 { 1e5 } else { 1e4 };
    spread * tree.epsilon()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
}

/// The largest difference; NaN is the largest.
fn off(found: &[f64], exact: &[f64]) -> f64 {
    let differences = found.iter().zip(exact).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, |most, off| if off <= most { most } else { off })
}
