//! What the processor answers.

use crate::options;
use crate::remote::{PRECISIONS, device};
use vertebra_assembly::mechanism;
use vertebra_dynamics::gpu::Options;
use vertebra_dynamics::{Simulation, SolverOptions};

/// Tolerances of mechanisms are met by the processor.
#[test]
fn tolerances_are_the_processors() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::jansen_leg().unwrap();
    for tolerance in [1e-6, 1e-14] {
        let tolerance = SolverOptions::to_tolerance(tolerance);
        let host = Simulation::new(model.clone()).unwrap();
        let remote = Simulation::on_gpu(&device, model.clone(), &Options::default()).unwrap();
        let [mut host, mut remote] = [host, remote].map(|simulation| {
            let mut simulation = simulation.with_solver(&tolerance).unwrap();
            simulation.set_state(state.clone()).unwrap();
            simulation.steps(1e-3, 3).unwrap();
            simulation
        });
        assert!(!remote.choice().on_gpu, "{}", remote.choice());
        assert_eq!(host.state().unwrap(), remote.state().unwrap());
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
