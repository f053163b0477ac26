//! Tolerances met or refused by name, and errors watched.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

use glam::DVec3;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};
use vertebra_assembly::generate::{self, Masses, RandomTree, Rod};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{Joint, MassProperties, Model, ModelDescription, Random, State};
use vertebra_dynamics::{
    Algorithm, Error, Forces, Monitor, Precision, Simulation, Solver, SolverOptions, Workspace,
    Wrench, aba, forward_error, refine, rnea,
};
use vertebra_spatial::Pose;

fn inputs(model: &Model, seed: u64) -> (State, Forces) {
    let mut forces = Forces::none(model);
    let mut random = Random::new(seed);
    for body in model.bodies() {
        for force in &mut forces.joint[body.dof_range()] {
            *force = random.symmetric() * body.mass.mass;
        }
    }
    (State::random(model, seed), forces)
}

/// What is no relative error that f64 can hold.
const NO_TOLERANCES: [f64; 8] = [
    0.0,
    1e-17,
    -1.0,
    1.0,
    2.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

fn options(tolerance: f64, algorithm: Algorithm) -> SolverOptions {
    SolverOptions {
        algorithm: Some(algorithm),
        parallel: false,
        ..SolverOptions::to_tolerance(tolerance)
    }
}

/// The true error, against the reference.
fn error(model: &Model, state: &State, forces: &Forces, qdd: &[f64]) -> f64 {
    let mut reference = Workspace::new(model, Precision::Reference);
    aba(model, state, forces, &mut reference).unwrap();
    forward_error(qdd, &reference).unwrap()
}

/// Hard masses, chains and trees, all joints: whatever is asked for is had, whoever computes.
#[test]
fn tolerances_are_met() {
    let patterns = [
        Masses::Equal,
        Masses::HeavyLast(1e8),
        Masses::Alternating(1e6),
        Masses::Decades(8.0),
        Masses::EveryEighth(1e-16),
        Masses::HeavyTips(1e4),
    ];
    let uneven = patterns.into_iter().flat_map(|masses| {
        [1, 4].map(|reach| generate::uneven_tree(200, reach, &Rod::default(), &masses, 3).unwrap())
    });
    let mixed = (0..4).map(|seed| {
        let shape = RandomTree {
            reach: 3,
            floating: seed % 2 == 0,
            ..RandomTree::mixed(100)
        };
        generate::random_tree(&shape, seed).unwrap()
    });
    for model in uneven.chain(mixed) {
        let (state, forces) = inputs(&model, 5);
        for algorithm in [Algorithm::Aba, Algorithm::Dca] {
            for tolerance in [1e-2, 1e-3, 1e-5, 1e-8, 1e-10, 1e-12, 1e-15] {
                let mut solver = Solver::new(&model, &options(tolerance, algorithm)).unwrap();
                let qdd = solver.forward_dynamics(&model, &state, &forces).unwrap();
                let found = error(&model, &state, &forces, qdd);
                let achieved = solver.achieved().unwrap();
                let label = format!("{tolerance:e} by {achieved}: {found:e}");
                assert!(found <= tolerance, "{label}");
                assert!(
                    achieved.error <= tolerance && achieved.sweeps > 0,
                    "{label}"
                );
            }
        }
    }
}

/// Rods so thin that their moment about themselves is lost beside the others in world axes, which no
/// residual shows: what turns about them is known to 2e-9 in f64, whatever corrections say.
#[test]
fn what_rounding_hides_is_counted() {
    let rod = MassProperties::rod(1.0, 1.0, 1e-4);
    let tip = Pose::from_translation(DVec3::Z);
    let mut description = ModelDescription::new("spinning rods");
    for index in 0..100_usize {
        let axis = [DVec3::new(0.6, 0.0, 0.8), DVec3::Z][index % 2];
        let name = |index: usize| format!("rod-{index}");
        let parent = index.checked_sub(1).map(name);
        let joint = Joint::revolute(axis).at(tip);
        description = description.body(name(index), parent.as_deref(), joint, rod);
    }
    let model = description.build().unwrap();
    for seed in 0..3 {
        let (state, forces) = inputs(&model, seed);
        for algorithm in [Algorithm::Aba, Algorithm::Dca] {
            let mut solver = Solver::new(&model, &options(1e-10, algorithm)).unwrap();
            let qdd = solver.forward_dynamics(&model, &state, &forces).unwrap();
            let found = error(&model, &state, &forces, qdd);
            assert!(found <= 1e-10, "{}: {found:e}", solver.achieved().unwrap());
        }
    }
}

/// Cheap where that will do, precise where it has to be.
#[test]
fn the_method_follows_the_tolerance() {
    let model = generate::random_chain(200, &Rod::default(), 1).unwrap();
    let (state, forces) = inputs(&model, 1);
    let precision = |tolerance| {
        let mut solver = Solver::new(&model, &options(tolerance, Algorithm::Aba)).unwrap();
        solver.forward_dynamics(&model, &state, &forces).unwrap();
        solver.achieved().unwrap().precision
    };
    assert_eq!(precision(1e-2), Precision::F32);
    assert_eq!(precision(1e-9), Precision::F64);
    assert_eq!(precision(1e-15), Precision::Reference);

    // A heavy tip leaves f32 nothing to correct: it is not tried.
    let heavy = Masses::HeavyLast(1e8);
    let model = generate::uneven_tree(200, 1, &Rod::default(), &heavy, 1).unwrap();
    let (state, forces) = inputs(&model, 1);
    let mut solver = Solver::new(&model, &options(1e-2, Algorithm::Aba)).unwrap();
    assert_eq!(solver.choice().precision, Precision::F64);
    solver.forward_dynamics(&model, &state, &forces).unwrap();
    assert_eq!(solver.achieved().unwrap().precision, Precision::F64);
}

/// Lengths over six decades, masses in proportion or equal: where f32 has lost the digits of some joint, corrections
/// leave that alone, and their changes are small beside errors of up to all there is. It must not be taken for right.
#[test]
fn what_corrections_cannot_move_is_not_given() {
    for (seed, equal) in (0..40).flat_map(|seed| [(seed, false), (seed, true)]) {
        let mut random = Random::new(seed);
        let mut description = ModelDescription::new("lengths");
        let (name, mut reach) = (|index: usize| format!("rod-{index}"), 0.0);
        for index in 0..60_usize {
            let length = 10_f64.powf(3.0 * random.symmetric());
            let mass = if equal { 1.0 } else { length };
            let parent = index.checked_sub(1).map(name);
            let tip = Pose::from_translation(DVec3::Z * reach);
            let joint = Joint::revolute(random.direction()).at(tip);
            let rod = MassProperties::rod(mass, length, 0.05 * length);
            description = description.body(name(index), parent.as_deref(), joint, rod);
            reach = length;
        }
        let model = description.build().unwrap();
        let (state, forces) = inputs(&model, seed);
        for algorithm in [Algorithm::Aba, Algorithm::Dca] {
            for tolerance in [1e-2, 1e-3, 1e-4] {
                let mut solver = Solver::new(&model, &options(tolerance, algorithm)).unwrap();
                let qdd = solver.forward_dynamics(&model, &state, &forces).unwrap();
                let found = error(&model, &state, &forces, qdd);
                let achieved = solver.achieved().unwrap();
                assert!(found <= tolerance, "seed {seed}: {achieved}: {found:e}");
            }
        }
    }
}

/// Once what asked for precision has gone, so has the precision.
#[test]
fn the_method_comes_back_down() {
    let model = generate::random_chain(30, &Rod::default(), 1).unwrap();
    let (easy, forces) = inputs(&model, 1);
    // Squares of such rates overflow in f32.
    let mut fast = easy.clone();
    fast.qd[3] = 1e25;
    let mut solver = Solver::new(&model, &options(1e-2, Algorithm::Aba)).unwrap();
    let mut precision = |state: &State| {
        solver.forward_dynamics(&model, state, &forces).unwrap();
        solver.achieved().unwrap().precision
    };
    assert_eq!(precision(&easy), Precision::F32);
    assert_eq!(precision(&fast), Precision::F64);
    let dear = (0..1000)
        .take_while(|_| precision(&easy) == Precision::F64)
        .count();
    assert!(dear > 10 && dear < 100, "{dear}");
    // Tried in vain, the cheaper method costs no solution.
    assert_eq!(precision(&fast), Precision::F64);
    for _ in 0..200 {
        assert_eq!(precision(&fast), Precision::F64);
    }
}

/// What is impossible is refused by name, and there is nothing to be read then.
#[test]
fn refusals() {
    let model = generate::random_chain(20, &Rod::default(), 1).unwrap();
    for tolerance in NO_TOLERANCES {
        let refused = Solver::new(&model, &options(tolerance, Algorithm::Aba));
        assert!(matches!(refused, Err(Error::ToleranceRange { .. })));
    }
    let mut solver = Solver::new(&model, &options(1e-9, Algorithm::Dca)).unwrap();
    assert!(solver.achieved().is_none());
    let (mut state, forces) = inputs(&model, 1);
    solver.forward_dynamics(&model, &state, &forces).unwrap();
    state.qd[3] = 1e200;
    let refused = solver.forward_dynamics(&model, &state, &forces);
    assert!(
        matches!(refused, Err(Error::Overflow { .. })),
        "{refused:?}"
    );
    assert!(solver.achieved().is_none());
    state.qd[3] = f64::NAN;
    let refused = solver.forward_dynamics(&model, &state, &forces);
    assert!(matches!(refused, Err(Error::Model(_))), "{refused:?}");
    state.qd[3] = 1.0;
    solver.forward_dynamics(&model, &state, &forces).unwrap();
    assert!(solver.achieved().is_some());
}

/// Masses over more decades than 106 bits have: no method has a digit left, and none pretends to.
#[test]
fn what_no_method_has_is_refused() {
    let mut missed = 0;
    for decades in 26..40 {
        let masses = Masses::HeavyLast(10_f64.powi(decades));
        let model = generate::uneven_tree(60, 1, &Rod::default(), &masses, 1).unwrap();
        let (state, forces) = inputs(&model, 1);
        let mut solver = Solver::new(&model, &options(1e-12, Algorithm::Aba)).unwrap();
        match solver.forward_dynamics(&model, &state, &forces) {
            Err(Error::ToleranceMissed { error, .. }) => {
                missed += 1;
                assert!(error > 1e-12 && solver.achieved().is_none());
            }
            other => {
                let named = matches!(other, Ok(_) | Err(Error::SingularJoint { .. }));
                assert!(named, "1e{decades}: {other:?}");
            }
        }
    }
    assert!(missed > 0);
}

/// The error that a check finds is the error there is, and checks change nothing.
#[test]
fn errors_are_watched() {
    let model = generate::random_chain(40, &Rod::default(), 2).unwrap();
    let run = |monitor: Option<Monitor>| {
        let mut simulation = Simulation::new(model.clone()).unwrap();
        simulation = simulation.with_precision(Precision::F32).unwrap();
        if let Some(monitor) = monitor {
            simulation = simulation.with_monitor(monitor).unwrap();
        }
        simulation.set_state(State::random(&model, 3)).unwrap();
        for _ in 0..25 {
            simulation.step(1e-4).unwrap();
        }
        simulation
    };
    let mut plain = run(None);
    let mut watched = run(Some(Monitor::every(10, 1e-8)));
    assert_eq!(plain.state().unwrap(), watched.state().unwrap());
    assert!(plain.monitor().is_none());
    let monitor = watched.monitor().unwrap();
    assert_eq!((monitor.checks(), monitor.exceeded()), (3, 3));
    let found = monitor.worst().unwrap().found;
    assert!(found.change > 1e-8 && found.change < 1e-3, "{found:?}");
    let exact = run(Some(Monitor::every(1, 1e-3)));
    let monitor = exact.monitor().unwrap();
    assert_eq!((monitor.checks(), monitor.exceeded()), (25, 0));
}

/// Of what a solver was asked for another precision changes nothing else; a tolerance decides it, and tells.
#[test]
fn what_was_asked_for_is_kept_or_refused() {
    let model = generate::random_chain(20, &Rod::default(), 1).unwrap();
    let single = |options: SolverOptions| {
        let simulation = Simulation::new(model.clone()).unwrap();
        let simulation = simulation.with_solver(&options).unwrap();
        simulation.with_precision(Precision::F32)
    };
    let decided = |what: Result<(), Error>| match what {
        Err(Error::DecidedByTolerance { tolerance, .. }) => assert_eq!(tolerance, 1e-9),
        other => panic!("{other:?}"),
    };
    decided(single(SolverOptions::to_tolerance(1e-9)).map(drop));
    for options in [
        SolverOptions {
            tree: Some(Precision::F32),
            ..SolverOptions::to_tolerance(1e-9)
        },
        SolverOptions {
            sweeps: 1,
            ..SolverOptions::to_tolerance(1e-9)
        },
    ] {
        decided(Solver::new(&model, &options).map(drop));
    }
    let tree = SolverOptions {
        algorithm: Some(Algorithm::Dca),
        schedule: Some(ScheduleOptions::with_window(4)),
        sweeps: 2,
        ..SolverOptions::default()
    };
    let mut kept = single(tree).unwrap();
    let asked = SolverOptions {
        precision: Precision::F32,
        ..tree
    };
    let mut solver = Solver::new(&model, &asked).unwrap();
    kept.set_state(State::random(&model, 2)).unwrap();
    let (state, forces) = (State::random(&model, 2), Forces::none(&model));
    let qdd = solver.forward_dynamics(&model, &state, &forces).unwrap();
    assert_eq!(kept.accelerations().unwrap(), qdd);
}

/// More corrections than are made are refused, and the message says how many are.
#[test]
fn corrections_have_a_bound() {
    let model = generate::random_chain(20, &Rod::default(), 1).unwrap();
    for algorithm in [None, Some(Algorithm::Aba), Some(Algorithm::Dca)] {
        let asked = |sweeps| {
            let options = SolverOptions {
                algorithm,
                sweeps,
                ..SolverOptions::default()
            };
            Solver::new(&model, &options)
        };
        asked(3).unwrap();
        for many in [4, usize::MAX] {
            let refused = asked(many).unwrap_err();
            assert!(matches!(refused, Error::Sweeps { sweeps, .. } if sweeps == many));
            assert!(
                refused.to_string().contains("ask for 3 at most"),
                "{refused}"
            );
        }
    }
}

/// Corrections that a solver is asked for are those of [`refine`], and its check sees what they leave.
#[test]
fn solvers_correct_as_often_as_asked() {
    let masses = Masses::HeavyLast(1e8);
    let model = generate::uneven_tree(200, 1, &Rod::default(), &masses, 1).unwrap();
    let (state, forces) = inputs(&model, 1);
    let solver = |sweeps| {
        let options = SolverOptions {
            algorithm: Some(Algorithm::Aba),
            sweeps,
            ..SolverOptions::default()
        };
        Solver::new(&model, &options).unwrap()
    };
    let mut workspace = Workspace::new(&model, Precision::F64);
    let plain = aba(&model, &state, &forces, &mut workspace).unwrap();
    let found = solver(0)
        .forward_dynamics(&model, &state, &forces)
        .unwrap()
        .to_vec();
    assert_eq!(found, plain);
    let refined = refine(&forces, &mut workspace).unwrap();
    assert_eq!(solver(0).check(&model, &state, &forces).unwrap(), refined);
    let corrected = workspace.joint_accelerations().unwrap();
    let found = solver(1)
        .forward_dynamics(&model, &state, &forces)
        .unwrap()
        .to_vec();
    assert_eq!(found, corrected);
    // What a correction leaves is as much smaller as what it changed.
    let left = solver(1).check(&model, &state, &forces).unwrap();
    assert!(
        left.change <= 1e-3 * refined.change,
        "{left:?} of {refined:?}"
    );
}

/// What no check can ask for is refused, as it is of a solver.
#[test]
fn a_monitor_has_a_tolerance() {
    let model = generate::random_chain(8, &Rod::default(), 2).unwrap();
    for tolerance in NO_TOLERANCES {
        let simulation = Simulation::new(model.clone()).unwrap();
        let refused = simulation.with_monitor(Monitor::every(1, tolerance));
        assert!(matches!(refused, Err(Error::ToleranceRange { .. })));
    }
}

/// A check that found too much is told at once, and may end the run before its step.
#[test]
fn a_monitor_ends_a_run() {
    let model = generate::random_chain(40, &Rod::default(), 2).unwrap();
    let told = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&told);
    let monitor = Monitor::every(4, 1e-8).on_exceeded(move |check| {
        kept.lock().unwrap().push(*check);
        if check.step < 8 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    let simulation = Simulation::new(model.clone()).unwrap();
    let mut simulation = simulation.with_precision(Precision::F32).unwrap();
    simulation.set_state(State::random(&model, 3)).unwrap();
    let mut simulation = simulation.with_monitor(monitor).unwrap();
    let error = simulation.steps(1e-4, 20).unwrap_err();
    let Error::Step {
        step: 8,
        count: 20,
        source,
    } = &error
    else {
        panic!("{error:?}");
    };
    let Error::Inexact {
        time,
        error: found,
        tolerance,
    } = **source
    else {
        panic!("{error:?}");
    };
    let told = told.lock().unwrap().clone();
    let steps: Vec<u64> = told.iter().map(|check| check.step).collect();
    assert_eq!(steps, [0, 4, 8]);
    assert_eq!((told[2].time, told[2].found.change), (time, found));
    assert_eq!((tolerance, simulation.time()), (1e-8, time));
    assert!((time - 8e-4).abs() < 1e-15 && found > tolerance);
    // What is asked for next is checked again: with more precision it goes on.
    assert!(matches!(simulation.step(1e-4), Err(Error::Inexact { .. })));
    let mut simulation = simulation.with_precision(Precision::F64).unwrap();
    simulation.steps(1e-4, 20).unwrap();
    let monitor = simulation.monitor().unwrap();
    assert_eq!((monitor.checks(), monitor.exceeded()), (9, 4));
}

/// A chain of rods along z in its neutral position, hinged about y and x in turn.
fn straight(count: usize, gravity: DVec3) -> Model {
    let rod = MassProperties::rod(1.0, 1.0, 0.05);
    let mut description = ModelDescription::new("straight").gravity(gravity);
    for index in 0..count {
        let name = |index: usize| format!("rod-{index}");
        let parent = index.checked_sub(1).map(name);
        let joint = Joint::revolute([DVec3::Y, DVec3::X][index % 2]);
        let joint = joint.at(Pose::from_translation(DVec3::Z));
        description = description.body(name(index), parent.as_deref(), joint, rod);
    }
    description.build().unwrap()
}

/// Sets joint forces that hold a model where it is.
fn hold(model: &Model, state: &State, forces: &mut Forces) {
    let mut workspace = Workspace::new(model, Precision::F64);
    let none = vec![0.0; model.dof_count()];
    let holding = rnea(model, state, &none, forces, &mut workspace).unwrap();
    forces.joint = holding.to_vec();
}

/// Where loads balance there is no acceleration to be exact about, and no need of more than f64: a chain
/// that hangs, a tree that is held, a body that turns steadily, a push that is withstood.
#[test]
fn balanced_loads_are_what_errors_are_measured_by() {
    let hanging = straight(30, DVec3::NEG_Z * 9.81);
    let mut upside_down = State::neutral(&hanging);
    // An angle of which f64 has no exact sine.
    upside_down.q[0] = core::f64::consts::PI;
    let shape = RandomTree {
        reach: 3,
        ..RandomTree::mixed(40)
    };
    let tree = generate::random_tree(&shape, 3).unwrap();
    let mut still = State::random(&tree, 4);
    still.qd.fill(0.0);
    let mut holding = Forces::none(&tree);
    hold(&tree, &still, &mut holding);
    let wheel = ModelDescription::new("satellite").gravity(DVec3::ZERO);
    let cylinder = MassProperties::rod(3.0, 0.4, 0.2);
    let wheel = wheel
        .body("wheel", None, Joint::free(), cylinder)
        .build()
        .unwrap();
    let mut turning = State::random(&wheel, 5);
    turning.qd = vec![0.0, 0.0, 40.0, 0.0, 0.0, 0.0];
    let arm = straight(6, DVec3::ZERO);
    let mut bent = State::random(&arm, 6);
    bent.qd.fill(0.0);
    let mut pushed = Forces::none(&arm);
    pushed.push(
        arm.last_body(),
        Wrench::at_center(DVec3::new(30.0, -20.0, 10.0)),
    );
    hold(&arm, &bent, &mut pushed);

    for (model, state, forces) in [
        (&hanging, &upside_down, &Forces::none(&hanging)),
        (&tree, &still, &holding),
        (&wheel, &turning, &Forces::none(&wheel)),
        (&arm, &bent, &pushed),
    ] {
        for algorithm in [Algorithm::Aba, Algorithm::Dca] {
            let mut solver = Solver::new(model, &options(1e-10, algorithm)).unwrap();
            let qdd = solver.forward_dynamics(model, state, forces).unwrap();
            let largest = qdd.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let found = error(model, state, forces, qdd);
            let achieved = solver.achieved().unwrap();
            let label = format!("{achieved}: {found:e}, largest {largest:e}");
            // Rounding alone moves anything; beside itself it would be an error of 1.
            assert!(largest <= 1e-9, "{label}");
            assert!(
                found <= 1e-10 && achieved.precision == Precision::F64,
                "{label}"
            );
        }
    }
}

/// Of a figure that only falls all terms of the equations but weights cancel: what is left of them is no reason to refuse.
#[test]
fn falling_bodies_meet_a_tolerance() {
    let off = Pose::from_translation(DVec3::new(0.2, -0.1, 0.3));
    let rod = MassProperties::rod(1.0, 1.0, 0.05).placed(&off);
    let figure = ModelDescription::new("figure")
        .body("trunk", None, Joint::free(), rod)
        .body("arm", Some("trunk"), Joint::revolute(DVec3::X), rod)
        .build()
        .unwrap();
    let kite = ModelDescription::new("kite")
        .body("frame", None, Joint::free(), MassProperties::MASSLESS)
        .body("rod", Some("frame"), Joint::fixed(), rod)
        .build()
        .unwrap();
    for model in [figure, kite] {
        for seed in 0..16 {
            let mut state = State::random(&model, seed);
            state.qd.fill(0.0);
            let forces = Forces::none(&model);
            for algorithm in [Algorithm::Aba, Algorithm::Dca] {
                for tolerance in [1e-2, 1e-6, 1e-9, 1e-12] {
                    let options = SolverOptions {
                        algorithm: Some(algorithm),
                        ..SolverOptions::to_tolerance(tolerance)
                    };
                    let mut solver = Solver::new(&model, &options).unwrap();
                    let found = solver.forward_dynamics(&model, &state, &forces);
                    // Falling is -g of the frame, whatever it looks like.
                    let fall = found.unwrap()[3..6]
                        .iter()
                        .map(|a| a * a)
                        .sum::<f64>()
                        .sqrt();
                    assert!(
                        (fall / 9.81 - 1.0).abs() <= tolerance,
                        "seed {seed}: {fall}"
                    );
                }
            }
        }
    }
}
