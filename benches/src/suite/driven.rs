//! Models in whose joints everything acts that can, driven by motors.

use vertebra::{
    JointKind, Model, Motor, Random, Simulation, SphericalMotor, State, Work, mechanism,
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
