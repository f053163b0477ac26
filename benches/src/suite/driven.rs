//! Models in whose joints everything acts that can, driven by motors: trees and mechanisms with closed loops.

use super::{Figure, Outcome, relative_error, worst_of};
use vertebra::{
    Algorithm, Elements, Forces, JointKind, Model, Motor, Precision, Random, Simulation, Solver,
    SolverOptions, SphericalMotor, State, Work, generate, mechanism,
};

/// Random mechanisms of all joints, closures and elements, their loops closed.
///
/// # Errors
/// If one cannot be built or closed.
pub(super) fn mechanisms(count: u64) -> anyhow::Result<Vec<(Model, State)>> {
    let random = (0..count).map(|seed| closed(mechanism::random(9, true, seed)?));
    random.collect()
}

/// The model, and its state with the loops closed.
pub(super) fn closed((model, state): (Model, State)) -> anyhow::Result<(Model, State)> {
    let mut simulation = Simulation::new(model.clone())?;
    simulation.set_state(state)?;
    simulation.close_loops()?;
    let state = simulation.state()?.clone();
    Ok((model, state))
}

/// A step \[s\], and how many between which motors change.
pub(super) const STEP: f64 = 1e-3;
const STEPS: usize = 10;

/// Steps with motors that change on the way: the state and the work at their end, and the energy that is not accounted for.
pub(super) fn moved(
    simulation: &mut Simulation,
    state: &State,
) -> anyhow::Result<(State, Work, f64)> {
    let model = simulation.model().clone();
    simulation.set_state(state.clone())?;
    let driven: Vec<_> = (model.body_ids().zip(model.bodies()))
        .filter(|(_, body)| body.dof_range().len() == 1)
        .map(|(id, _)| id)
        .collect();
    let of_balls = model.body_ids().zip(model.bodies());
    let balls: Vec<_> = of_balls
        .filter(|(_, body)| body.joint.kind == JointKind::Spherical)
        .map(|(id, _)| id)
        .collect();
    let held = |simulation: &mut Simulation| -> anyhow::Result<f64> {
        let sums = simulation.mechanics()?;
        Ok(sums.kinetic_energy + sums.potential_energy + simulation.stored()?.rotors)
    };
    let start = held(simulation)?;
    let mut random = Random::new(3);
    for _ in 0..4 {
        for motor in [
            Motor::torque(0.3),
            Motor::velocity(1.0, 2.0),
            Motor::position(0.4, 50.0, 1.0),
            Motor::position(-0.4, 500.0, 1.0).limited(0.5),
        ] {
            simulation.set_motor(driven[random.below(driven.len())], motor)?;
        }
        for motor in [
            SphericalMotor::velocity(random.direction(), 0.5),
            SphericalMotor::orientation(random.rotation(), 5.0, 0.5).limited(0.5),
        ] {
            if !balls.is_empty() {
                simulation.set_spherical_motor(balls[random.below(balls.len())], motor)?;
            }
        }
        simulation.steps(STEP, STEPS)?;
    }
    let work = simulation.work()?;
    let off = held(simulation)? - start - work.total();
    Ok((simulation.state()?.clone(), work, off))
}

/// Work by what did it, loops left out.
pub(super) const fn works(work: &Work) -> [f64; 5] {
    [
        work.motors,
        work.springs,
        work.dampers,
        work.friction,
        work.stops,
    ]
}

/// The ways to solve on a processor, with what each may lose of accelerations where there are loops.
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

/// Random trees and mechanisms of all joints, closures, elements and motors, by every way there is: accelerations under all that elements
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
    let mut subjects = mechanisms(18)?;
    for (count, seed) in [3, 40, 300].into_iter().zip(1..) {
        let model = generate::random_mechanism(count, true, seed)?;
        let mut state = State::neutral(&model);
        state.qd.copy_from_slice(&State::random(&model, 4).qd);
        subjects.push((model, state));
    }
    for (index, (model, state)) in subjects.into_iter().enumerate() {
        let mut elements = Elements::new(&model);
        let forces = elements.load(&state, &Forces::none(&model), STEP)?;
        let mut exact = Solver::new(&model, &reference)?;
        let exact = exact.forward_dynamics(&model, &state, forces)?.to_vec();
        let simulation =
            |options: &SolverOptions| Simulation::new(model.clone())?.with_solver(options);
        let (expected, work, off) = moved(&mut simulation(&reference)?, &state)?;
        let mut still = simulation(&reference)?;
        still.set_state(state.clone())?;
        let moving = still.mechanics()?.kinetic_energy;
        let scale = works(&work)
            .into_iter()
            .map(f64::abs)
            .fold(moving, worst_of);
        for (options, lost) in ways() {
            let mut solver = Solver::new(&model, &options)?;
            let (way, tree) = (solver.choice().to_string(), solver.choice().tree);
            let name = |what| format!("{} {index}, {what}, {way}", model.name());
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
            let rounding = 32.0 * tree.epsilon().sqrt() * scale;
            let balance = Figure::new(name("energy"), gone.abs(), 4.0 * off.abs() + rounding);
            figures.push(balance);
            if let Some(open) = simulation.loop_violation()? {
                figures.push(Figure::new(name("violation"), open.position, 1e-8));
            }
        }
    }
    Ok(figures)
}
