//! Mechanisms with closed loops, far into their motion.

use super::{Figure, Outcome};
use crate::scenario::loops::{STEP, mechanisms};
use vertebra::{Precision, Simulation};

/// Steps taken.
const STEPS: usize = 100_000;

/// Bodies above which a tenth of the steps are taken, for the time's sake.
const LARGE: usize = 8;

/// Violation of each mechanism's loops over their sizes after 1e5 steps of 1 ms (1e4 of the larger ones): at most 1e-8 in
/// f64, 1e-4 in f32.
///
/// # Errors
/// If a step fails.
pub fn violations() -> Outcome {
    let mut figures = Vec::new();
    for (precision, bound) in [(Precision::F64, 1e-8), (Precision::F32, 1e-4)] {
        for (model, start) in mechanisms()? {
            let mut simulation = Simulation::new(model.clone())?.with_precision(precision)?;
            simulation.set_state(start)?;
            let shorter = if model.bodies().len() > LARGE { 10 } else { 1 };
            for _ in 0..STEPS / shorter {
                simulation.step(STEP)?;
            }
            let violation = simulation
                .loop_violation()?
                .map_or(f64::NAN, |found| found.position);
            figures.push(Figure::new(
                format!("{} {precision}", model.name()),
                violation,
                bound,
            ));
        }
    }
    Ok(figures)
}
