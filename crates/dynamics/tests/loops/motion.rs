//! Mechanisms swing: they stay closed, and keep what energy their steps' order keeps.

use super::simulation;
use vertebra_assembly::{JointKind, Model, State, mechanism};
use vertebra_dynamics::{Integrator, Precision, Simulation};

/// Steps under gravity: stays closed, and with Runge-Kutta steps keeps its energy.
fn swing(model: &Model, state: &State, h: f64, steps: usize) {
    for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
        let mut simulation = simulation(model, state, integrator);
        let start = simulation.loop_violation().unwrap().unwrap();
        assert!(start.position <= 1e-6, "{}: {start:?}", model.name());
        simulation.close_loops().unwrap();
        let before = simulation.mechanics().unwrap();
        let mut largest = before.kinetic_energy;
        let before = before.kinetic_energy + before.potential_energy;
        for _ in 0..steps {
            simulation.step(h).unwrap();
            largest = largest.max(simulation.mechanics().unwrap().kinetic_energy);
        }
        let found = simulation.loop_violation().unwrap().unwrap();
        let speed = simulation
            .state()
            .unwrap()
            .qd
            .iter()
            .fold(1.0_f64, |m, x| m.max(x.abs()));
        assert!(found.position <= 1e-10, "{}: {found:?}", model.name());
        assert!(found.rate <= 1e-7 * speed, "{}: {found:?}", model.name());
        assert!(
            largest > 1e-4 * model.gravity().length(),
            "{} does not move",
            model.name()
        );
        let after = simulation.mechanics().unwrap();
        let drift = (after.kinetic_energy + after.potential_energy - before).abs() / largest;
        let bound = match integrator {
            Integrator::RungeKutta4 => 1e-5,
            _ => 0.1,
        };
        assert!(
            drift <= bound,
            "{}, {integrator:?}: energy drifts by {drift:e}",
            model.name()
        );
    }
}

#[test]
fn four_bars_and_five_bars() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    swing(&model, &state, 1e-3, 1500);
    let (model, state) = mechanism::five_bar().unwrap();
    swing(&model, &state, 1e-3, 1000);
}

#[test]
fn overconstrained_linkages_move() {
    let (model, state) = mechanism::bennett().unwrap();
    swing(&model, &state, 1e-3, 1000);
    let (model, state) = mechanism::bricard().unwrap();
    swing(&model, &state, 1e-3, 500);
}

#[test]
fn a_leg_of_a_strandbeest() {
    let (model, state) = mechanism::jansen_leg().unwrap();
    swing(&model, &state, 5e-4, 800);
}

/// From a bulge. Flat, the patch is singular: it has rates there that are forbidden nearby.
#[test]
fn chain_mail_hangs_together() {
    let (model, mut state) = mechanism::chain_mail(3, 4).unwrap();
    for ring in 0..12 {
        state.q[7 * ring + 1] = 0.03 * (1.0 + ring as f64).sin();
    }
    state.qd.fill(0.0);
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state).unwrap();
    simulation.close_loops().unwrap();
    let state = simulation.state().unwrap().clone();
    swing(&model, &state, 1e-3, 200);
}

/// Legs that push as springs do carry the platform.
#[test]
fn a_stewart_platform_rests_on_its_legs() {
    let (model, state) = mechanism::stewart_platform().unwrap();
    let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
    assert!(simulation.loop_violation().unwrap().unwrap().position <= 1e-12);
    let legs: Vec<(usize, usize)> = (model.bodies().iter())
        .filter(|body| matches!(body.joint.kind, JointKind::Prismatic { .. }))
        .map(|body| (body.position_start, body.dof_start))
        .collect();
    for _ in 0..1500 {
        for &(q, dof) in &legs {
            let push = -4e3 * simulation.state().unwrap().q[q]
                - 200.0 * simulation.state().unwrap().qd[dof];
            simulation.forces_mut().joint[dof] = push;
        }
        simulation.step(1e-3).unwrap();
    }
    let found = simulation.loop_violation().unwrap().unwrap();
    assert!(found.position <= 1e-10, "{found:?}");
    let height = simulation.state().unwrap().q[2];
    assert!((-0.05..0.0).contains(&height), "{height}");
    // The legs' joints carry the platform's weight, and half the legs' at most beside.
    let forces = simulation.loop_forces().unwrap();
    let lift: f64 = forces.loops.iter().map(|wrench| wrench.force.z).sum();
    assert!((lift - 5.0 * 9.81).abs() <= 0.2, "{lift}");
}

/// A parallelogram folds flat twice a turn, where it may also become an antiparallelogram.
#[test]
fn change_points_are_passed() {
    let (model, mut state) = mechanism::four_bar(1.0, 0.4, 1.0, 0.4, 1.0).unwrap();
    state.qd = vec![3.0, -3.0, 3.0];
    for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
        let mut simulation = simulation(&model, &state, integrator);
        for _ in 0..4000 {
            simulation.step(1e-3).unwrap();
            let found = simulation.loop_violation().unwrap().unwrap();
            assert!(found.position <= 1e-8, "{found:?}");
        }
    }
}

#[test]
fn loops_stay_closed_in_f32_too() {
    for (model, state) in [
        mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap(),
        mechanism::bennett().unwrap(),
        mechanism::jansen_leg().unwrap(),
    ] {
        let mut simulation = Simulation::new(model)
            .unwrap()
            .with_precision(Precision::F32)
            .unwrap();
        simulation.set_state(state).unwrap();
        for _ in 0..300 {
            simulation.step(1e-3).unwrap();
        }
        let found = simulation.loop_violation().unwrap().unwrap();
        assert!(found.position <= 1e-8 && found.rate <= 1e-4, "{found:?}");
    }
}

/// What Runge-Kutta steps lose with half the step is a sixteenth.
#[test]
fn steps_keep_their_order() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let end = |integrator, steps: u32| {
        let mut simulation = simulation(&model, &state, integrator);
        for _ in 0..steps {
            simulation.step(0.2 / f64::from(steps)).unwrap();
        }
        simulation.state().unwrap().q.clone()
    };
    let exact = end(Integrator::RungeKutta4, 640);
    let error = |integrator, steps| {
        let found = end(integrator, steps);
        found
            .iter()
            .zip(&exact)
            .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
    };
    for (integrator, order) in [
        (Integrator::SemiImplicitEuler, 1.0),
        (Integrator::RungeKutta4, 4.0),
    ] {
        let slope = (error(integrator, 20) / error(integrator, 80)).log2() / 2.0;
        assert!((slope - order).abs() < 0.4, "{integrator:?}: order {slope}");
    }
}

/// Ten thousands of steps of first order: no more kinetic energy than there can be, nothing opens.
#[test]
fn energy_does_not_grow_without_end() {
    for (model, state) in [
        mechanism::jansen_leg().unwrap(),
        mechanism::five_bar().unwrap(),
        mechanism::bricard().unwrap(),
    ] {
        for (precision, steps) in [(Precision::F64, 20_000), (Precision::F32, 5_000)] {
            let mut simulation = Simulation::new(model.clone())
                .unwrap()
                .with_precision(precision)
                .unwrap();
            simulation.set_state(state.clone()).unwrap();
            let start = simulation.mechanics().unwrap().potential_energy;
            let (mut kinetic, mut lowest) = (0.0_f64, start);
            for _ in 0..steps {
                simulation.step(1e-3).unwrap();
                let now = simulation.mechanics().unwrap();
                kinetic = kinetic.max(now.kinetic_energy);
                lowest = lowest.min(now.potential_energy);
            }
            let found = simulation.loop_violation().unwrap().unwrap();
            assert!(found.position <= 1e-8, "{}: {found:?}", model.name());
            assert!(
                kinetic > 0.5 * (start - lowest) && kinetic < 1.05 * (start - lowest),
                "{}: {kinetic} of {}",
                model.name(),
                start - lowest
            );
        }
    }
}

/// A flat patch pushed out of its plane: the first step takes out what is forbidden next to it, however short, and from
/// then on energy is kept.
#[test]
fn flat_mail_is_left() {
    let (model, mut state) = mechanism::chain_mail(3, 4).unwrap();
    for (ring, qd) in state.qd.chunks_mut(6).enumerate() {
        qd[4] = 0.1 * (1.0 + ring as f64).sin();
    }
    for h in [1e-3, 1e-4] {
        let mut simulation = simulation(&model, &state, Integrator::RungeKutta4);
        simulation.close_loops().unwrap();
        let energy = |simulation: &mut Simulation| {
            let now = simulation.mechanics().unwrap();
            (
                now.kinetic_energy + now.potential_energy,
                now.kinetic_energy,
            )
        };
        let (start, kinetic) = energy(&mut simulation);
        simulation.step(h).unwrap();
        let (first, _) = energy(&mut simulation);
        assert!(
            (first - start).abs() <= 0.05 * kinetic,
            "{h}: {}",
            (first - start) / kinetic
        );
        simulation.steps(h, 50).unwrap();
        let (later, _) = energy(&mut simulation);
        assert!(
            (later - first).abs() <= 1e-4 * kinetic,
            "{h}: {}",
            (later - first) / kinetic
        );
        let found = simulation.loop_violation().unwrap().unwrap();
        assert!(found.position <= 1e-9, "{h}: {found:?}");
    }
}
