//! Every solver on loops: divide and conquer, to a tolerance, in batches.

use super::{off, simulation};
use core::f64::consts::PI;
use glam::{DQuat, DVec3};
use vertebra_assembly::{Closure, Model, State, generate, mechanism};
use vertebra_dynamics::{
    Algorithm, Batch, DcaOptions, DcaWorkspace, Error, Forces, Integrator, Precision, Simulation,
    Solver, SolverOptions, Workspace, Wrench, aba, aba_batch, crba_forward_dynamics, dca,
    forward_kinematics, rnea,
};
use vertebra_spatial::Pose;

/// Accelerations of one state by a solver with options.
fn accelerations(model: &Model, state: &State, options: &SolverOptions) -> (Vec<f64>, Solver) {
    let mut solver = Solver::new(model, options).unwrap();
    let forces = Forces::none(model);
    let qdd = solver.forward_dynamics(model, state, &forces).unwrap();
    (qdd.to_vec(), solver)
}

/// Mechanisms in motion, and a long chain whose end is held.
fn moving() -> Vec<(Model, State)> {
    let mut all = vec![
        mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap(),
        mechanism::bennett().unwrap(),
        mechanism::jansen_leg().unwrap(),
        mechanism::stewart_platform().unwrap(),
        mechanism::chain_mail(3, 4).unwrap(),
    ];
    for (model, state) in &mut all {
        let mut simulation = simulation(model, state, Integrator::RungeKutta4);
        for (k, qd) in state.qd.iter_mut().enumerate() {
            *qd = (1.0 + k as f64).sin();
        }
        simulation.set_state(state.clone()).unwrap();
        simulation.close_loops().unwrap();
        simulation.steps(1e-3, 20).unwrap();
        state.clone_from(simulation.state().unwrap());
    }
    all.push(held(
        &generate::random_chain(150, &generate::Rod::default(), 3).unwrap(),
    ));
    all.push(held(&generate::random_mechanism(40, false, 6).unwrap()));
    all
}

/// A model in a random state in which its last body is welded to where it is.
fn held(open: &Model) -> (Model, State) {
    let state = State::random(open, 4);
    let mut workspace = Workspace::new(open, Precision::F64);
    forward_kinematics(open, &state, &mut workspace).unwrap();
    let at = workspace.pose(open.last_body()).unwrap();
    let last = open.bodies().last().unwrap().name.clone();
    let weld = ([Some(last.as_str()), None], [Pose::IDENTITY, at]);
    let model = (open.describe())
        .close("hook", weld.0, weld.1, Closure::Weld)
        .build()
        .unwrap();
    (model, state)
}

#[test]
fn divide_and_conquer_keeps_loops() {
    for (model, state) in moving() {
        let exact = SolverOptions {
            precision: Precision::Reference,
            ..SolverOptions::default()
        };
        let (right, _) = accelerations(&model, &state, &exact);
        for (precision, tree, bound) in [
            (Precision::Reference, Precision::Reference, 1e-9),
            (Precision::F64, Precision::F64, 1e-8),
            (Precision::F64, Precision::F32, 1e-2),
            (Precision::F32, Precision::F32, 1e-2),
        ] {
            let options = SolverOptions {
                algorithm: Some(Algorithm::Dca),
                precision,
                tree: Some(tree),
                ..SolverOptions::default()
            };
            let (found, solver) = accelerations(&model, &state, &options);
            assert_eq!(solver.choice().algorithm, Algorithm::Dca);
            let off = off(&found, &right);
            assert!(off <= bound, "{} {precision} {tree}: {off:e}", model.name());
        }
    }
}

#[test]
fn loops_are_solved_to_a_tolerance() {
    for (model, state) in moving() {
        let (right, _) = accelerations(
            &model,
            &state,
            &SolverOptions {
                precision: Precision::Reference,
                ..SolverOptions::default()
            },
        );
        for algorithm in [Algorithm::Aba, Algorithm::Dca] {
            for tolerance in [1e-3, 1e-6, 1e-9] {
                let options = SolverOptions {
                    algorithm: Some(algorithm),
                    ..SolverOptions::to_tolerance(tolerance)
                };
                let (found, solver) = accelerations(&model, &state, &options);
                let achieved = solver.achieved().unwrap();
                let off = off(&found, &right);
                assert!(achieved.error <= tolerance);
                assert!(achieved.residual <= tolerance, "{achieved}");
                assert!(off <= tolerance, "{} {achieved}: {off:e}", model.name());
            }
        }
    }
}

/// Where loads balance there is next to no acceleration, and errors are measured by the loads instead: a parallelogram that
/// hangs, and a linkage whose joints are held while its pin is pulled apart.
#[test]
fn linkages_at_rest_meet_a_tolerance() {
    let (standing, mut hanging) = mechanism::four_bar(1.0, 0.5, 1.0, 0.5, 0.0).unwrap();
    let plane = DQuat::from_scaled_axis(DVec3::new(0.7, -0.4, 1.1));
    let parallelogram = (standing.describe())
        .gravity(plane * DVec3::new(0.0, 0.0, -9.81))
        .build()
        .unwrap();
    for (q, by) in hanging.q.iter_mut().zip([PI, -PI, PI]) {
        *q += by;
    }
    let (linkage, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let mut forces = Forces::none(&linkage);
    let mut workspace = Workspace::of_tree(&linkage, Precision::F64);
    let held = rnea(&linkage, &state, &[0.0; 3], &forces, &mut workspace).unwrap();
    forces.joint = held.to_vec();
    let pull = DVec3::new(3.0, 40.0, -25.0);
    let pin = linkage.loops()[0].clone();
    for (body, length, pull) in [(pin.bodies[0], 0.9, pull), (pin.bodies[1], 0.7, -pull)] {
        let body = body.unwrap();
        forces.push(body, Wrench::at_point(pull, DVec3::Z * length));
    }
    for (model, state, forces) in [
        (&parallelogram, &hanging, &Forces::none(&parallelogram)),
        (&linkage, &state, &forces),
    ] {
        for algorithm in [Algorithm::Aba, Algorithm::Dca] {
            for tolerance in [1e-3, 1e-6, 1e-9] {
                let options = SolverOptions {
                    algorithm: Some(algorithm),
                    ..SolverOptions::to_tolerance(tolerance)
                };
                let mut solver = Solver::new(model, &options).unwrap();
                let qdd = solver.forward_dynamics(model, state, forces).unwrap();
                let largest = qdd.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                // Ten times gravity over a tenth of a metre.
                assert!(largest <= 1e3 * tolerance, "{tolerance:e}: {qdd:?}");
                assert!(solver.achieved().unwrap().error <= tolerance);
            }
        }
    }
}

/// Steps by every method stay closed.
#[test]
fn every_solver_takes_steps() {
    let options = |algorithm, precision, tree, tolerance| SolverOptions {
        algorithm: Some(algorithm),
        precision,
        tree,
        tolerance,
        ..SolverOptions::default()
    };
    for (model, state) in [
        mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap(),
        mechanism::bennett().unwrap(),
        mechanism::jansen_leg().unwrap(),
    ] {
        for options in [
            options(Algorithm::Dca, Precision::F64, None, None),
            options(Algorithm::Dca, Precision::F64, Some(Precision::F32), None),
            options(Algorithm::Dca, Precision::F32, None, None),
            options(Algorithm::Aba, Precision::F64, None, Some(1e-9)),
            options(Algorithm::Dca, Precision::F64, None, Some(1e-6)),
        ] {
            let mut simulation = Simulation::new(model.clone())
                .unwrap()
                .with_solver(&options)
                .unwrap();
            simulation.set_state(state.clone()).unwrap();
            for _ in 0..1000 {
                simulation.step(1e-3).unwrap();
            }
            let found = simulation.loop_violation().unwrap().unwrap();
            assert!(
                found.position <= 1e-8,
                "{} {options:?}: {found:?}",
                model.name()
            );
        }
    }
}

/// What computes trees says so of a model with loops, unless it is told to.
#[test]
fn loops_are_not_left_open_silently() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let forces = Forces::none(&model);
    let options = DcaOptions::default();
    let mut workspace = Workspace::new(&model, Precision::F64);
    let mut divided = DcaWorkspace::new(&model, &options).unwrap();
    let refusals = [
        aba(&model, &state, &forces, &mut workspace).unwrap_err(),
        dca(&model, &state, &forces, &mut divided).unwrap_err(),
        crba_forward_dynamics(&model, &state, &forces, &mut workspace).unwrap_err(),
    ];
    for error in refusals {
        assert!(matches!(error, Error::LoopsUnavailable { .. }), "{error}");
        assert!(error.to_string().contains("`pin`"), "{error}");
    }
    let mut workspace = Workspace::of_tree(&model, Precision::F64);
    let mut divided = DcaWorkspace::of_tree(&model, &options).unwrap();
    let tree = aba(&model, &state, &forces, &mut workspace)
        .unwrap()
        .to_vec();
    let same = dca(&model, &state, &forces, &mut divided).unwrap();
    assert!(off(same, &tree) <= 1e-12);
    // The tree falls freely, the linkage does not.
    let (held, _) = accelerations(&model, &state, &SolverOptions::default());
    assert!(off(&held, &tree) > 0.1);
}

/// A batch solves items of a model with loops as each alone, on any number of threads; what fails fails alone.
#[test]
fn batches_keep_loops_closed() {
    let (model, state) = mechanism::jansen_leg().unwrap();
    let mut states = vec![state; 9];
    for (item, state) in states.iter_mut().enumerate() {
        state.qd.iter_mut().for_each(|rate| *rate *= item as f64);
    }
    states[4].q[1] = f64::NAN;
    let mut forces = vec![Forces::none(&model); states.len()];
    forces[2].joint[0] = 3.0;
    for precision in [Precision::F32, Precision::F64] {
        let options = SolverOptions {
            algorithm: Some(Algorithm::Aba),
            precision,
            ..SolverOptions::default()
        };
        let mut solver = Solver::new(&model, &options).unwrap();
        for threads in [1, 0] {
            let mut batch = Batch::with_threads(&model, precision, threads);
            let failed = aba_batch(&model, &states, &forces, &mut batch).unwrap_err();
            assert!(
                matches!(
                    failed,
                    Error::Item {
                        item: 4,
                        failed: 1,
                        ..
                    }
                ),
                "{failed}"
            );
            for item in (0..states.len()).filter(|&item| item != 4) {
                let alone = solver.forward_dynamics(&model, &states[item], &forces[item]);
                assert_eq!(batch.joint_accelerations(item).unwrap(), alone.unwrap());
            }
        }
    }
}

/// Loops are computed in f64, whatever the tree is in: that is said, not passed over.
#[test]
fn tolerances_beyond_the_loops_are_missed() {
    let (model, state) = held(&generate::random_chain(150, &generate::Rod::default(), 3).unwrap());
    let mut solver = Solver::new(&model, &SolverOptions::to_tolerance(3e-16)).unwrap();
    let solved = solver.forward_dynamics(&model, &state, &Forces::none(&model));
    assert!(
        matches!(solved, Err(Error::ToleranceMissed { .. })),
        "{solved:?}"
    );
}
