//! Mechanisms with closed loops: far into their motion, and with all that can act in joints.

use super::driven::{self, moved, works};
use super::{Figure, Outcome, relative_error, worst_of};
use crate::scenario::loops::{STEP, mechanisms};
use vertebra::{Algorithm, Elements, Forces, Model, Precision, Simulation, Solver, SolverOptions};

/// Steps taken of a mechanism: 1e5, or a tenth of larger ones for the time's sake.
pub(super) fn steps_of(model: &Model) -> usize {
    if model.bodies().len() > 8 {
        10_000
    } else {
        100_000
    }
}

/// The largest violation of each mechanism's loops over their sizes in 1e5 steps of 1 ms (1e4 of the larger ones), with the
/// tree in f64 and in f32: at most 1e-8 in both, since loops are in f64 whatever the tree is in.
///
/// # Errors
/// If a step fails.
pub fn violations() -> Outcome {
    let mut figures = Vec::new();
    for precision in [Precision::F64, Precision::F32] {
        for (model, start) in mechanisms()? {
            let mut simulation = Simulation::new(model.clone())?.with_precision(precision)?;
            simulation.set_state(start)?;
            let mut violation = 0.0_f64;
            for _ in 0..steps_of(&model) {
                simulation.step(STEP)?;
                let found = simulation.loop_violation()?;
                violation = worst_of(violation, found.map_or(f64::NAN, |found| found.position));
            }
            figures.push(Figure::new(
                format!("{}, tree in {precision}", model.name()),
                violation,
                1e-8,
            ));
        }
    }
    Ok(figures)
}

/// The ways to solve for loops on a processor, with what each may lose of accelerations.
fn ways() -> Vec<(SolverOptions, f64)> {
    let way = |algorithm, precision, tree| SolverOptions {
        algorithm: Some(algorithm),
        precision,
        tree,
        ..SolverOptions::default()
    };
    let (single, double) = (Precision::F32, Precision::F64);
    let tolerance = 1e-9;
    vec![
        (way(Algorithm::Aba, double, None), 1e-8),
        (way(Algorithm::Aba, single, None), 1e-2),
        (way(Algorithm::Dca, double, None), 1e-8),
        (way(Algorithm::Dca, double, Some(single)), 1e-2),
        (way(Algorithm::Dca, single, None), 1e-2),
        (SolverOptions::to_tolerance(tolerance), tolerance),
    ]
}

/// Random mechanisms of all joints, closures, elements and motors, by every way there is: accelerations under all that elements
/// do in a step, and steps with motors that change on the way, against the recursion in the reference precision; loops that stay
/// closed; and work that accounts for the energy as there.
///
/// # Errors
/// If a solution or a step fails.
pub fn loaded() -> Outcome {
    let mut figures = Vec::new();
    let reference = SolverOptions {
        algorithm: Some(Algorithm::Aba),
        precision: Precision::Reference,
        ..SolverOptions::default()
    };
    for (index, (model, state)) in driven::mechanisms(18)?.into_iter().enumerate() {
        let mut elements = Elements::new(&model);
        let forces = elements.load(&state, &Forces::none(&model), driven::STEP)?;
        let mut exact = Solver::new(&model, &reference)?;
        let exact = exact.forward_dynamics(&model, &state, forces)?.to_vec();
        let simulation =
            |options: &SolverOptions| Simulation::new(model.clone())?.with_solver(options);
        let (expected, work, off) = moved(&mut simulation(&reference)?, &state)?;
        let scale = works(&work).into_iter().map(f64::abs).fold(1.0, worst_of);
        for (options, lost) in ways() {
            let mut solver = Solver::new(&model, &options)?;
            let way = solver.choice().to_string();
            let name = |what| format!("loaded loops {index}, {what}, {way}");
            let found = solver.forward_dynamics(&model, &state, forces)?;
            let error = relative_error(found, &exact);
            figures.push(Figure::new(name("accelerations"), error, lost));
            let mut simulation = simulation(&options)?;
            let (state, done, gone) = moved(&mut simulation, &state)?;
            // In f32 joints take other sides of their laws; in f64 hard stops are met to the root of rounding.
            if lost < 1e-2 {
                let rates = relative_error(&state.qd, &expected.qd);
                figures.push(Figure::new(name("rates"), rates, 1e-5));
                let error = relative_error(&works(&done), &works(&work));
                figures.push(Figure::new(name("work"), error, 1e-5));
            }
            let rounding = 32.0 * f64::from(f32::EPSILON).sqrt() * scale;
            let balance = Figure::new(name("energy"), gone.abs(), 4.0 * off.abs() + rounding);
            figures.push(balance);
            let open = simulation.loop_violation()?;
            let open = open.map_or(f64::NAN, |open| open.position);
            figures.push(Figure::new(name("violation"), worst_of(open, 0.0), 1e-8));
        }
    }
    Ok(figures)
}
