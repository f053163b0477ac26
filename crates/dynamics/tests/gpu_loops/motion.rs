//! Accelerations and steps are the processor's.

use crate::remote::{PRECISIONS, device};
use crate::{bound, largest, mechanisms, off, options};
use vertebra_assembly::{Model, State};
use vertebra_dynamics::gpu::Options;
use vertebra_dynamics::{Forces, Integrator, Precision, Simulation, Solver, SolverOptions};

/// Accelerations, as good as those of the tree.
fn compare_accelerations(model: &Model, state: &State, simulation: &mut Simulation, bound: f64) {
    let mut forces = Forces::none(model);
    for (k, force) in forces.joint.iter_mut().enumerate() {
        *force = (k as f64).sin();
    }
    let mut solver = Solver::new(model, &SolverOptions::default()).unwrap();
    let exact = solver.forward_dynamics(model, state, &forces).unwrap();
    *simulation.forces_mut() = forces;
    let found = simulation.accelerations().unwrap();
    *simulation.forces_mut() = Forces::none(model);
    let off = off(&found, exact) / largest(exact);
    assert!(off <= bound, "{}: {off:e} of {bound:e}", model.name());
}

/// Accelerations are the CPU's, and steps, which stay closed.
#[test]
fn mechanisms_move_as_on_the_cpu() {
    let Some(device) = device() else { return };
    for precisions in PRECISIONS {
        let left = match precisions.0 {
            Precision::F32 => 1e-4,
            _ => 1e-9,
        };
        for (index, (model, state)) in mechanisms::all().into_iter().enumerate() {
            // Kernels take their time to compile, for each precision and integrator.
            let is_third = index % 3 == 0;
            if precisions.1 != Precision::F64 && !is_third {
                continue;
            }
            for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
                let is_higher = integrator == Integrator::RungeKutta4;
                if is_higher && !(is_third && precisions.1 == Precision::F64) {
                    continue;
                }
                let mut host = Simulation::new(model.clone())
                    .unwrap()
                    .with_integrator(integrator);
                let options = Options {
                    integrator,
                    ..options(precisions)
                };
                let mut remote = Simulation::on_gpu(&device, model.clone(), &options).unwrap();
                let bound = bound(precisions);
                for simulation in [&mut host, &mut remote] {
                    simulation.set_state(state.clone()).unwrap();
                }
                if integrator == Integrator::SemiImplicitEuler {
                    compare_accelerations(&model, &state, &mut remote, bound);
                }
                for simulation in [&mut host, &mut remote] {
                    simulation.steps(1e-3, 20).unwrap();
                }
                let [done, expected] = [&mut remote, &mut host].map(|s| s.work().unwrap().loops);
                let energy = host.mechanics().unwrap();
                let energy = energy.kinetic_energy + energy.potential_energy.abs();
                assert!(
                    (done - expected).abs() <= bound * energy,
                    "{} {precisions:?} {integrator:?}: work {done:e}, {expected:e}",
                    model.name()
                );
                let violation = remote.loop_violation().unwrap().unwrap();
                assert!(violation.position <= left, "{precisions:?}: {violation:?}");
                let (a, b) = (host.state().unwrap(), remote.state().unwrap());
                let speed = largest(&a.qd).max(1.0);
                let (q, qd) = (off(&a.q, &b.q), off(&a.qd, &b.qd) / speed);
                assert!(
                    q <= bound * speed && qd <= bound,
                    "{} {precisions:?} {integrator:?}: q {q:e}, qd {qd:e}",
                    model.name()
                );
            }
        }
    }
}
