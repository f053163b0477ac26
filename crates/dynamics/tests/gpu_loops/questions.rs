//! What the processor answers.

use crate::remote::{PRECISIONS, device};
use crate::{largest, off, options};
use vertebra_assembly::mechanism;
use vertebra_dynamics::gpu::Options;
use vertebra_dynamics::{Monitor, Simulation, SolverOptions};

/// Tolerances of mechanisms are met by the device, or by the processor where it cannot be so exact.
#[test]
fn tolerances_are_met() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::jansen_leg().unwrap();
    let run = |simulation: Simulation, tolerance| {
        let tolerance = SolverOptions::to_tolerance(tolerance);
        let mut simulation = simulation.with_solver(&tolerance).unwrap();
        simulation.set_state(state.clone()).unwrap();
        simulation.steps(1e-3, 3).unwrap();
        simulation
    };
    for (tolerance, is_met) in [(1e-9, true), (1e-14, false)] {
        let remote = Simulation::on_gpu(&device, model.clone(), &Options::default()).unwrap();
        let mut remote = run(remote, tolerance);
        let mut host = run(Simulation::new(model.clone()).unwrap(), 1e-14);
        assert_eq!(remote.choice().on_gpu, is_met, "{}", remote.choice());
        if is_met {
            assert!(remote.achieved().unwrap().error <= tolerance);
            host.set_state(remote.state().unwrap().clone()).unwrap();
            let (exact, found) = (host.accelerations(), remote.accelerations());
            let (exact, found) = (exact.unwrap(), found.unwrap());
            assert!(off(&found, &exact) <= tolerance * largest(&exact));
        } else {
            assert_eq!(host.state().unwrap(), remote.state().unwrap());
        }
    }
}

/// Checks of accelerations that keep loops find errors as large as they are, and change nothing.
#[test]
fn mechanisms_are_watched() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::jansen_leg().unwrap();
    for (precisions, largest) in [(PRECISIONS[1], 1e-3), (PRECISIONS[2], 1e-10)] {
        let run = |tolerance: f64| {
            let simulation = Simulation::on_gpu(&device, model.clone(), &options(precisions));
            let monitor = Monitor::every(2, tolerance);
            let mut simulation = simulation.unwrap().with_monitor(monitor).unwrap();
            simulation.set_state(state.clone()).unwrap();
            simulation.steps(1e-3, 4).unwrap();
            simulation
        };
        let (mut watched, mut strict) = (run(largest), run(f64::EPSILON));
        let monitor = watched.monitor().unwrap();
        let worst = monitor.worst();
        assert_eq!((monitor.checks(), monitor.exceeded()), (2, 0), "{worst:?}");
        assert_eq!(strict.monitor().unwrap().exceeded(), 2, "{worst:?}");
        assert_eq!(watched.state().unwrap(), strict.state().unwrap());
    }
}

/// Questions about one state are answered by the processor; loops open by hand are closed.
#[test]
fn questions_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::jansen_leg().unwrap();
    let mut far = state;
    for (k, q) in far.q.iter_mut().enumerate().skip(1) {
        *q += 0.1 * (k as f64).sin();
    }
    let mut host = Simulation::new(model.clone()).unwrap();
    let mut remote = Simulation::on_gpu(&device, model, &options(PRECISIONS[2])).unwrap();
    for simulation in [&mut host, &mut remote] {
        simulation.set_state(far.clone()).unwrap();
        assert!(simulation.loop_violation().unwrap().unwrap().position > 0.01);
        simulation.close_loops().unwrap();
    }
    assert_eq!(host.state().unwrap(), remote.state().unwrap());
    assert_eq!(host.loop_forces().unwrap(), remote.loop_forces().unwrap());
    let qdd = host
        .solve()
        .unwrap()
        .joint_accelerations()
        .unwrap()
        .to_vec();
    assert_eq!(qdd, remote.solve().unwrap().joint_accelerations().unwrap());
    remote.steps(1e-3, 3).unwrap();
    assert!(remote.loop_violation().unwrap().unwrap().position <= 1e-9);
}
