//! Mechanisms with closed loops in motion: planar and spatial, overconstrained, singular, many loops at once.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

mod closures;
mod joints;
mod motion;
mod solvers;

use vertebra_assembly::{Model, State};
use vertebra_dynamics::{Integrator, Simulation};

fn simulation(model: &Model, state: &State, integrator: Integrator) -> Simulation {
    let mut simulation = Simulation::new(model.clone())
        .unwrap()
        .with_integrator(integrator);
    simulation.set_state(state.clone()).unwrap();
    simulation
}

/// The largest difference over the largest value.
fn off(found: &[f64], right: &[f64]) -> f64 {
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |m, x| m.max(x.abs()));
    largest(&mut found.iter().zip(right).map(|(a, b)| a - b)) / largest(&mut right.iter().copied())
}
