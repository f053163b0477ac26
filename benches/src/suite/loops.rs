//! Mechanisms with closed loops, far into their motion.

use super::{Figure, Outcome, worst_of};
use crate::scenario::loops::{STEP, mechanisms};
use vertebra::{Model, Precision, Simulation};

/// The largest violation of each mechanism's loops over their sizes in 1e5 steps of 1 ms (1e4 of the larger ones, for the time's
/// sake).
///
/// # Errors
/// If a step fails.
pub fn violations() -> Outcome {
    largest(|model| match model.bodies().len() {
        ..=8 => 100_000,
        _ => 10_000,
    })
}

/// The same in 1e5 steps of each mechanism, which takes minutes.
///
/// # Errors
/// If a step fails.
pub fn violations_of_long_runs() -> Outcome {
    largest(|_| 100_000)
}

/// The largest violations with the tree in f64 and in f32: at most 1e-8 in both, since loops are in f64 whatever the tree is in.
fn largest(steps: impl Fn(&Model) -> usize) -> Outcome {
    let mut figures = Vec::new();
    for precision in [Precision::F64, Precision::F32] {
        for (model, start) in mechanisms()? {
            let mut simulation = Simulation::new(model.clone())?.with_precision(precision)?;
            simulation.set_state(start)?;
            let mut violation = 0.0_f64;
            let steps = steps(&model);
            for _ in 0..steps {
                simulation.step(STEP)?;
                let found = simulation.loop_violation()?;
                violation = worst_of(violation, found.map_or(f64::NAN, |found| found.position));
            }
            figures.push(Figure::new(
                format!("{}, tree in {precision}, {steps} steps", model.name()),
                violation,
                1e-8,
            ));
        }
    }
    Ok(figures)
}
