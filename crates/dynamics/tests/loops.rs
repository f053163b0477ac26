//! Mechanisms with closed loops in motion: planar and spatial, overconstrained, singular, many loops at once.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use core::f64::consts::PI;
use glam::{DQuat, DVec3};
use vertebra_assembly::{
    Closure, Joint, JointKind, MassProperties, Mimic, Model, ModelDescription, State, generate,
    mechanism,
};
use vertebra_dynamics::{
    Algorithm, Batch, DcaOptions, DcaWorkspace, Error, Forces, Integrator, Precision, Simulation,
    Solver, SolverOptions, Workspace, Wrench, aba, aba_batch, crba_forward_dynamics, dca,
    forward_kinematics, rnea,
};
use vertebra_spatial::Pose;

fn simulation(model: &Model, state: &State, integrator: Integrator) -> Simulation {
    let mut simulation = Simulation::new(model.clone())
        .unwrap()
        .with_integrator(integrator);
    simulation.set_state(state.clone()).unwrap();
    simulation
}

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

/// Dampers and rotors in the joints of a linkage: it comes to rest, closed. All elements: `loop_elements.rs`.
#[test]
fn elements_act_in_closed_loops() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let mut description = model.describe();
    for body in &mut description.bodies {
        body.joint.damping = 0.5;
        body.joint.armature = 0.01;
    }
    let model = description.build().unwrap();
    let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
    let start = simulation.mechanics().unwrap().potential_energy;
    for _ in 0..8000 {
        simulation.step(1e-3).unwrap();
    }
    let found = simulation.loop_violation().unwrap().unwrap();
    assert!(found.position <= 1e-12, "{found:?}");
    let end = simulation.mechanics().unwrap();
    let lost = start - end.potential_energy;
    assert!(
        lost > 0.1 && end.kinetic_energy <= 1e-6 * lost,
        "{lost}, {end:?}"
    );
    let dampers = simulation.work().unwrap().dampers;
    assert!((dampers + lost).abs() <= 0.02 * lost, "{dampers} of {lost}");
}

/// A rolls on B: two hinges coupled move as one with the inertia of both, the follower's times the ratio squared.
#[test]
fn coupled_joints_move_as_one() {
    let wheel = MassProperties::rod(2.0, 0.1, 0.3);
    let description = ModelDescription::new("gears")
        .gravity(DVec3::ZERO)
        .body("driver", None, Joint::revolute(DVec3::Z), wheel)
        .body("driven", None, Joint::revolute(DVec3::Z), wheel);
    let ratio = -2.5;
    let coupled = description
        .clone()
        .couple("mesh", "driven", "driver", ratio, 0.3)
        .build()
        .unwrap();
    let mut mimicking = description;
    mimicking.bodies[1].joint.mimic = Some(Mimic {
        body: "driver".to_owned(),
        multiplier: ratio,
        offset: 0.3,
    });
    let mimicking = mimicking.build().unwrap();
    assert!(mimicking.not_simulated().is_empty());
    for model in [coupled, mimicking] {
        let mut simulation = Simulation::new(model.clone()).unwrap();
        simulation.close_loops().unwrap();
        let q = simulation.state().unwrap().q.clone();
        assert!((q[1] - ratio * q[0] - 0.3).abs() <= 1e-14, "{q:?}");
        simulation.forces_mut().joint[0] = 1.5;
        let inertia = wheel.about(DVec3::ZERO).z_axis.z;
        let expected = 1.5 / (inertia * (1.0 + ratio * ratio));
        let qdd = simulation
            .solve()
            .unwrap()
            .joint_accelerations()
            .unwrap()
            .to_vec();
        assert!((qdd[0] - expected).abs() <= 1e-12 * expected);
        assert!((qdd[1] - ratio * expected).abs() <= 1e-12 * expected);
        let forces = simulation.loop_forces().unwrap();
        assert!((forces.couplings[0] - inertia * ratio * expected).abs() <= 1e-9);
        for _ in 0..100 {
            simulation.step(0.01).unwrap();
        }
        assert!(simulation.loop_violation().unwrap().unwrap().position <= 1e-13);
    }
}

#[test]
fn what_cannot_be_closed_is_refused_by_name() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    // The coupler is too short to reach.
    let mut description = model.describe();
    description.loops[0].placements[0] = Pose::from_translation(DVec3::NEG_Z * 5.0);
    let mut simulation = Simulation::new(description.build().unwrap()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let error = simulation.close_loops().unwrap_err();
    assert!(matches!(error, Error::LoopNotClosed { .. }), "{error}");
    assert_eq!(simulation.state().unwrap(), &state);
    assert!(simulation.step(1e-3).is_err());
    assert_eq!(simulation.state().unwrap(), &state);
}

#[test]
fn loops_close_from_afar() {
    let (model, state) = mechanism::jansen_leg().unwrap();
    let mut simulation = Simulation::new(model).unwrap();
    let mut far = state;
    for (k, q) in far.q.iter_mut().enumerate().skip(1) {
        *q += 0.2 * (k as f64).sin();
    }
    simulation.set_state(far).unwrap();
    assert!(simulation.loop_violation().unwrap().unwrap().position > 0.05);
    simulation.close_loops().unwrap();
    assert!(simulation.loop_violation().unwrap().unwrap().position <= 1e-12);
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

/// Accelerations of one state by a solver with options.
fn accelerations(model: &Model, state: &State, options: &SolverOptions) -> (Vec<f64>, Solver) {
    let mut solver = Solver::new(model, options).unwrap();
    let forces = Forces::none(model);
    let qdd = solver.forward_dynamics(model, state, &forces).unwrap();
    (qdd.to_vec(), solver)
}

fn off(found: &[f64], right: &[f64]) -> f64 {
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |m, x| m.max(x.abs()));
    largest(&mut found.iter().zip(right).map(|(a, b)| a - b)) / largest(&mut right.iter().copied())
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

/// Rates that overflow are seen, not dropped.
#[test]
fn rates_that_overflow_are_infinite() {
    let (model, mut state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    state.qd = vec![f64::MAX, f64::MAX, f64::MAX];
    let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
    let found = simulation.loop_violation().unwrap().unwrap();
    assert!(found.position <= 1e-12, "{found:?}");
    assert_eq!(found.rate, f64::INFINITY, "{found:?}");
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

/// A step does not throw bodies across the room.
#[test]
fn steps_from_open_loops_are_refused() {
    let (model, state) = mechanism::jansen_leg().unwrap();
    for integrator in [
        Integrator::SemiImplicitEuler,
        Integrator::RungeKutta4,
        Integrator::ImplicitMidpoint,
    ] {
        let mut open = state.clone();
        open.q[1] += 0.1;
        let mut simulation = simulation(&model, &open, integrator);
        let error = simulation.step(1e-3).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, Error::LoopOpen { .. }), "{text}");
        assert!(
            text.contains("`top`") && text.contains("close_loops"),
            "{text}"
        );
        assert_eq!(simulation.state().unwrap(), &open);
        simulation.close_loops().unwrap();
        simulation.step(1e-3).unwrap();
        // As closed as a file's digits make it.
        let mut rounded = state.clone();
        rounded
            .q
            .iter_mut()
            .for_each(|q| *q = (*q * 1e3).round() / 1e3);
        simulation.set_state(rounded).unwrap();
        simulation.step(1e-3).unwrap();
    }
}

/// Where a loop's two frames are, found from the bodies' poses.
fn frames(simulation: &mut Simulation, index: usize) -> [Pose; 2] {
    let closed = simulation.model().loops()[index].clone();
    [0, 1].map(|k| {
        let body = match closed.bodies[k] {
            Some(body) => simulation.pose(body).unwrap(),
            None => Pose::IDENTITY,
        };
        body * closed.placements[k]
    })
}

/// What the table of closures says, measured on poses.
#[test]
fn closures_keep_what_they_say() {
    let (axis, second) = (DVec3::new(0.3, -1.0, 0.4), DVec3::new(1.0, 0.2, -0.3));
    let closures = [
        Closure::Weld,
        Closure::Ball,
        Closure::Revolute { axis },
        Closure::Prismatic { axis },
        Closure::Screw { axis, pitch: 0.2 },
        Closure::Cylindrical { axis },
        Closure::Universal {
            first: axis,
            second,
        },
        Closure::Planar { normal: axis },
        Closure::Distance { length: 0.7 },
    ];
    for (closure, seed) in closures.into_iter().zip(5..) {
        let rod = generate::Rod::default();
        let open = generate::random_chain(8, &rod, seed).unwrap();
        let state = State::random(&open, seed);
        let mut workspace = Workspace::new(&open, Precision::F64);
        forward_kinematics(&open, &state, &mut workspace).unwrap();
        let near = workspace.pose(open.last_body()).unwrap();
        let last = open.bodies()[7].name.clone();
        let at = [
            Pose::from_translation(DVec3::Z * 0.4),
            Pose::new(
                near.rotation * DQuat::from_scaled_axis(DVec3::new(0.1, 0.2, -0.1)),
                near.translation + DVec3::new(0.1, -0.1, 0.05),
            ),
        ];
        let model = (open.describe())
            .close("loop", [Some(&last), None], at, closure)
            .build()
            .unwrap();
        let mut simulation = Simulation::new(model.clone()).unwrap();
        simulation.set_state(state).unwrap();
        simulation.close_loops().unwrap();
        let [a, b] = frames(&mut simulation, 0);
        let apart = b.translation - a.translation;
        let turned = (a.rotation.inverse() * b.rotation).normalize();
        let (axis, second) = (axis.normalize(), second.normalize());
        let (z, w) = (a.rotation * axis, b.rotation * axis);
        let together = apart.length();
        let across = z.cross(apart).length();
        let aligned = z.cross(w).length();
        // Half turns about an axis across are another way to assemble.
        let unturned = (0..3).map(|k| {
            let unit = DVec3::AXES[k];
            (turned * unit).cross(unit).length()
        });
        let unturned = unturned.fold(0.0_f64, f64::max);
        let off = match closure {
            Closure::Weld => together.max(unturned),
            Closure::Ball => together,
            Closure::Revolute { .. } => together.max(aligned),
            Closure::Prismatic { .. } => across.max(unturned),
            Closure::Cylindrical { .. } => across.max(aligned),
            Closure::Universal { .. } => together.max(z.dot(b.rotation * second).abs()),
            Closure::Planar { .. } => aligned.max(z.dot(apart).abs()),
            Closure::Distance { length } => (together - length).abs(),
            Closure::Screw { pitch, .. } => {
                let angle = 2.0 * turned.xyz().dot(axis).atan2(turned.w);
                let turns = (z.dot(apart) - pitch * angle) / (core::f64::consts::TAU * pitch);
                across.max(aligned).max((turns - turns.round()).abs())
            }
        };
        assert!(off <= 1e-11, "{closure:?}: {off:e}");
    }
}

/// A violation is the gap over the longest link, whatever unit the model works in.
#[test]
fn violations_are_over_the_longest_link() {
    let of_ground = [1.7, 0.5, 1.5, 1.2];
    let of_coupler = [1.0, 0.5, 1.6, 1.4];
    for (lengths, scale, longest) in [
        (of_ground, 1.0, 1.7),
        (of_ground, 1e-6, 1.7e-6),
        (of_coupler, 1e5, 1.6e5),
    ] {
        let [ground, crank, coupler, rocker] = lengths.map(|length| length * scale);
        let (model, mut state) = mechanism::four_bar(ground, crank, coupler, rocker, 0.4).unwrap();
        state.q[1] += 0.01;
        state.qd[1] = 0.3;
        let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
        let open = simulation.loop_violation().unwrap().unwrap();
        let mut later = state.clone();
        later.q[1] += 0.3 * 1e-6;
        simulation.set_state(later).unwrap();
        let opening = simulation.loop_violation().unwrap().unwrap().position - open.position;
        assert!(
            (opening.abs() / 1e-6 - open.rate).abs() <= 1e-3 * open.rate,
            "{scale}: {open:?}"
        );
        simulation.set_state(state).unwrap();
        let [a, b] = frames(&mut simulation, 0);
        let gap = a.rotation.inverse() * (b.translation - a.translation);
        let expected = gap.abs().max_element() / longest;
        let found = simulation.loop_violation().unwrap().unwrap().position;
        // The frames' axes across the hinge's are the library's own choice.
        assert!(
            found <= 1.4143 * expected && expected <= 1.4143 * found,
            "{scale}: {found:e} or {expected:e}"
        );
    }
}

/// A rack on a pinion: they move together, and the force between them is that of their inertias.
#[test]
fn a_rack_follows_its_pinion() {
    let (radius, wheel) = (0.004, MassProperties::rod(0.02, 0.001, 0.003));
    let model = ModelDescription::new("rack and pinion")
        .gravity(DVec3::ZERO)
        .body("pinion", None, Joint::revolute(DVec3::Z), wheel)
        .body("rack", None, Joint::prismatic(DVec3::X), wheel)
        .couple("mesh", "rack", "pinion", radius, 0.0)
        .build()
        .unwrap();
    let inertia = wheel.about(DVec3::ZERO).z_axis.z;
    let mut simulation = Simulation::new(model).unwrap();
    simulation.forces_mut().joint[0] = 1e-3;
    let expected = 1e-3 / (inertia + wheel.mass * radius * radius);
    let qdd = simulation.solve().unwrap().joint_accelerations().unwrap();
    assert!((qdd[0] - expected).abs() <= 1e-12 * expected, "{qdd:?}");
    assert!((qdd[1] - radius * expected).abs() <= 1e-12 * radius * expected);
    let force = simulation.loop_forces().unwrap().couplings[0];
    let right = wheel.mass * radius * expected;
    assert!((force - right).abs() <= 1e-9 * right, "{force} or {right}");
}

/// Gravity of one's own acts in `solve` as in steps.
#[test]
fn own_gravity_acts_on_closed_loops() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let mut forces = Forces::none(&model);
    for root in ["crank", "rocker"] {
        let root = model.find(root).unwrap();
        forces.set_gravity(&model, root, [0.3, 1.0, -1.62]).unwrap();
    }
    let mut solver = Solver::new(&model, &SolverOptions::default()).unwrap();
    let right = solver.forward_dynamics(&model, &state, &forces).unwrap();
    let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
    *simulation.forces_mut() = forces;
    let found = simulation.solve().unwrap().joint_accelerations().unwrap();
    assert!(off(found, right) <= 1e-9, "{found:?} or {right:?}");
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
