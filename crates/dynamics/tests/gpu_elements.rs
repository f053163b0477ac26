//! What acts in joints on a GPU, against the CPU: inertia of freedoms' own, springs, dampers, friction, stops,
//! motors, on joints of every kind.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

mod driven;
mod remote;

use driven::{assert_alike, chain, largest, moved, moved_by};
use glam::{DQuat, DVec3};
use remote::{PRECISIONS, device};
use vertebra_assembly::generate::{self, Rod};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{
    BallRange, Joint, MassProperties, Model, ModelDescription, Random, State, Stop,
};
use vertebra_dynamics::gpu::{Batch, BatchOptions, Options};
use vertebra_dynamics::{
    Algorithm, DcaOptions, DcaWorkspace, Elements, Error, Forces, Integrator, Monitor, Motor,
    Precision, Simulation, SolverOptions, Work, Workspace, aba, dca, forward_error, gpu,
};
use vertebra_gpu::Device;

fn options((chunks, tree): (Precision, Precision), window: usize, sweeps: usize) -> Options {
    Options {
        chunks: Some(chunks),
        tree: Some(tree),
        schedule: Some(ScheduleOptions::with_window(window)),
        sweeps,
        ..Options::default()
    }
}

/// Joint forces, and inertia of many freedoms' own over some decades.
fn held(model: &Model, seed: u64) -> Forces {
    let mut forces = Forces::none(model);
    let mut random = Random::new(seed);
    forces.joint.fill_with(|| random.symmetric());
    forces.joint_inertia = (0..model.dof_count())
        .map(|_| match random.below(3) {
            0 => 0.0,
            decade => 10_f64.powf(2.0 * random.symmetric() - decade as f64),
        })
        .collect();
    forces
}

/// What the model's elements make of these in a long step: stops of spherical joints bind their three freedoms.
fn bound(model: &Model, seed: u64) -> Forces {
    let mut elements = Elements::new(model);
    let state = State::random(model, seed);
    elements
        .load(&state, &held(model, seed), 1e-2)
        .unwrap()
        .clone()
}

/// Accelerations of freedoms with inertia of their own have the digits that they have on the CPU.
fn compare_held(device: &Device, model: &Model, forces: &Forces, options: &Options, what: &str) {
    let seed = 1;
    let state = State::random(model, seed);
    let mut reference = Workspace::new(model, Precision::Reference);
    aba(model, &state, forces, &mut reference).unwrap();
    let mut simulation = gpu::Simulation::on(device, &model.bare(), options).unwrap();
    simulation.set_state(&state).unwrap();
    simulation.set_forces(forces).unwrap();
    let found = forward_error(&simulation.accelerations().unwrap(), &reference).unwrap();
    let (chunks, tree) = simulation.precisions();
    let twin = DcaOptions {
        chunks,
        tree: if options.sweeps > 0 { chunks } else { tree },
        schedule: options.schedule,
        parallel: false,
    };
    let mut workspace = DcaWorkspace::new(model, &twin).unwrap();
    let twin = dca(model, &state, forces, &mut workspace).unwrap();
    let cpu = forward_error(twin, &reference).unwrap();
    let rounding = if options.sweeps > 0 {
        chunks.epsilon()
    } else {
        tree.epsilon()
    };
    let bound = 16.0 * cpu + 256.0 * rounding;
    assert!(
        found <= bound,
        "{what}, {chunks} {tree}: {found:e} on the GPU, {cpu:e} on the CPU"
    );
}

#[test]
fn inertia_of_freedoms_own() {
    let Some(device) = device() else { return };
    for (precisions, seed) in PRECISIONS.into_iter().zip(1..) {
        for (count, window) in [(5, 4), (40, 4)] {
            let what = format!("chain of {count}");
            let model = chain(count, seed);
            let forces = held(&model, seed);
            let options = options(precisions, window, 0);
            compare_held(&device, &model, &forces, &options, &what);
        }
    }
}

/// Chunks that end with leaves, whose joints' own inertia is a compliance of a join; of spherical joints one along axes
/// of its own.
#[test]
fn inertia_of_freedoms_own_at_heavy_ends() {
    let Some(device) = device() else { return };
    let mut description = chain(21, 3).describe();
    for index in [3, 7, 10, 15, 20] {
        let mass = &mut description.bodies[index].mass;
        mass.mass *= 1e4;
        mass.inertia *= 1e4;
    }
    let model = description.build().unwrap();
    let forces = bound(&model, 1);
    let options = options(PRECISIONS[2], 4, 0);
    compare_held(&device, &model, &forces, &options, "heavy ends");
}

/// And corrections gain the digits that joins lack.
#[test]
fn inertia_of_freedoms_own_corrected() {
    let Some(device) = device() else { return };
    let options = options(PRECISIONS[1], 4, 2);
    let model = chain(40, 1);
    let forces = bound(&model, 1);
    compare_held(&device, &model, &forces, &options, "corrected chain");
}

/// Steps are the CPU's, on which laws end on the same parts.
#[test]
fn steps_with_all_elements() {
    let Some(device) = device() else { return };
    let model = chain(24, 3);
    let mut state = State::neutral(&model);
    state.qd.copy_from_slice(&State::random(&model, 3).qd);
    let expected = moved(Simulation::new(model.clone()).unwrap(), &state, 1e-3, 20);
    let work = expected.1;
    for work in [
        work.motors,
        work.springs,
        work.dampers,
        work.friction,
        work.stops,
    ] {
        assert!(work != 0.0, "{:?}", expected.1);
    }
    // Stops are met to the square root of what solutions are known to.
    for (precisions, bound) in [(PRECISIONS[1], 1e-2), (PRECISIONS[2], 1e-7)] {
        let options = options(precisions, 4, 0);
        let gpu = Simulation::on_gpu(&device, model.clone(), &options).unwrap();
        let found = moved(gpu, &state, 1e-3, 20);
        assert_alike(&found, &expected, bound, &format!("{precisions:?}"));
    }
}

/// Across a hard stop that holds it, a ball keeps the small inertia of its own that it has, all in f32 too.
#[test]
fn a_held_ball_keeps_its_own_inertia() {
    let Some(device) = device() else { return };
    let limit = 0.01;
    let mass = MassProperties::sphere(1.0, 0.3);
    let own = 3e-4 * mass.inertia.x_axis.x;
    let pushed = |own: f64| {
        let joint = Joint::spherical()
            .with_ball_range(BallRange::cone(DVec3::Z, limit))
            .with_armature(own);
        let model = ModelDescription::new("held")
            .gravity(DVec3::ZERO)
            .body("ball", None, joint, mass)
            .build()
            .unwrap();
        let mut state = State::neutral(&model);
        state.q = DQuat::from_rotation_x(limit).to_array().to_vec();
        (model, state)
    };
    let spun = |mut simulation: Simulation, state: State| {
        simulation.set_state(state).unwrap();
        simulation
            .forces_mut()
            .joint
            .copy_from_slice(&[1.0, 0.0, 0.2]);
        simulation.steps(1e-3, 20).unwrap();
        simulation.state().unwrap().qd[2]
    };
    let [(model, state), (bare, _)] = [own, 0.0].map(pushed);
    let expected = spun(Simulation::new(model.clone()).unwrap(), state.clone());
    let without = spun(Simulation::new(bare).unwrap(), state.clone());
    let options = options(PRECISIONS[0], 4, 0);
    let gpu = Simulation::on_gpu(&device, model, &options).unwrap();
    let found = spun(gpu, state);
    let (off, effect) = ((found - expected).abs(), (without - expected).abs());
    assert!(
        off <= 0.3 * effect,
        "{found} and {expected}, {without} without"
    );
}

/// And with an integrator that takes them as forces; a step with those that jump is refused, and one back.
#[test]
fn steps_of_runge_kutta() {
    let Some(device) = device() else { return };
    let mut description = chain(12, 4).describe();
    for body in &mut description.bodies {
        body.joint.friction = 0.0;
        if body.joint.limits.is_some() {
            body.joint.stop = Stop::Soft {
                stiffness: 100.0,
                damping: 0.2,
            };
        }
    }
    let model = description.build().unwrap();
    let mut state = State::neutral(&model);
    state.qd.copy_from_slice(&State::random(&model, 5).qd);
    let cpu = Simulation::new(model.clone()).unwrap();
    let cpu = cpu.with_integrator(Integrator::RungeKutta4);
    let expected = moved(cpu, &state, 1e-3, 20);
    let options = Options {
        integrator: Integrator::RungeKutta4,
        ..options(PRECISIONS[2], 4, 0)
    };
    let gpu = Simulation::on_gpu(&device, model, &options).unwrap();
    let found = moved(gpu, &state, 1e-3, 20);
    assert_alike(&found, &expected, 1e-10, "Runge-Kutta");

    let rough = Simulation::on_gpu(&device, chain(12, 4), &options);
    let refused = rough.unwrap().step(1e-3);
    assert!(
        matches!(refused, Err(Error::RoughElement { .. })),
        "{refused:?}"
    );
    let mut back = Simulation::on_gpu(&device, chain(12, 4), &Options::default()).unwrap();
    let refused = back.step(-1e-3);
    assert!(
        matches!(refused, Err(Error::StepBack { .. })),
        "{refused:?}"
    );
}

/// Batches with elements go by divide and conquer, each item with motors of its own.
#[test]
fn batches() {
    let Some(device) = device() else { return };
    let model = chain(8, 3);
    let items = 3;
    let options = BatchOptions {
        precision: Precision::F64,
        ..BatchOptions::default()
    };
    let mut batch = Batch::new(&device, &model, items, &options).unwrap();
    assert_eq!(batch.choice().algorithm, Algorithm::Dca);
    let states: Vec<_> = (0..items as u64)
        .map(|seed| State {
            qd: State::random(&model, seed).qd,
            ..State::neutral(&model)
        })
        .collect();
    let forces: Vec<_> = (0..items as u64).map(|seed| held(&model, seed)).collect();
    batch.set_states(&states).unwrap();
    batch.set_forces(&forces).unwrap();
    let body = model.find("body-7").unwrap();
    for item in 1..items {
        let motor = Motor::velocity(item as f64, 2.0).limited(0.3);
        batch.set_motor(item, body, motor).unwrap();
    }
    batch.steps(1e-3, 10).unwrap();
    for (item, found) in batch.states().unwrap().iter().enumerate() {
        let mut alone = Simulation::new(model.clone()).unwrap();
        alone.set_state(states[item].clone()).unwrap();
        *alone.forces_mut() = forces[item].clone();
        if item > 0 {
            let motor = Motor::velocity(item as f64, 2.0).limited(0.3);
            alone.set_motor(body, motor).unwrap();
        }
        alone.steps(1e-3, 10).unwrap();
        let expected = alone.state().unwrap();
        let scale = expected.qd.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for (a, b) in found.qd.iter().zip(&expected.qd) {
            assert!((a - b).abs() <= 1e-7 * scale, "item {item}: {a} and {b}");
        }
    }
    assert!(matches!(
        batch.set_motor(items, body, Motor::OFF),
        Err(Error::ItemCount { .. })
    ));
    let lanes = BatchOptions {
        lanes: Some(2),
        ..options
    };
    let refused = Batch::new(&device, &model, items, &lanes).err().unwrap();
    assert!(
        matches!(refused, Error::JointUnavailable { .. }),
        "{refused}"
    );
    let mut bare = Batch::new(&device, &chain(8, 3).bare(), items, &options).unwrap();
    bare.set_motor(0, body, Motor::torque(1.0)).unwrap();
    let why = batch.choice().to_string();
    assert!(why.contains("alone computes screws"), "{why}");
    assert!(Batch::new(&device, &model, 0, &options).unwrap().is_empty());
    let plain = generate::random_chain(8, &Rod::default(), 3).unwrap();
    let mut plain_batch = Batch::new(&device, &plain, items, &lanes).unwrap();
    let own: Vec<_> = (0..items as u64).map(|seed| held(&plain, seed)).collect();
    let refused = plain_batch.set_forces(&own).unwrap_err();
    assert!(
        matches!(&refused, Error::Item { source, .. }
            if matches!(**source, Error::JointInertiaUnavailable { .. })),
        "{refused}"
    );
}

/// Steps are checked as they are taken, implicit in what acts and on the parts its laws are on; that changes nothing.
#[test]
fn steps_with_elements_are_watched() {
    let Some(device) = device() else { return };
    let model = chain(24, 3);
    let mut state = State::neutral(&model);
    state.qd.copy_from_slice(&State::random(&model, 3).qd);
    for precisions in &PRECISIONS[1..] {
        // Stops are as firm as the square root of what solutions are known to, and so is what rounds them.
        let largest = precisions.1.epsilon().sqrt();
        let run = |monitor: Option<Monitor>| {
            let options = options(*precisions, 4, 0);
            let mut simulation = Simulation::on_gpu(&device, model.clone(), &options).unwrap();
            if let Some(monitor) = monitor {
                simulation = simulation.with_monitor(monitor).unwrap();
            }
            let moved = moved_by(&mut simulation, &state, 1e-3, 20);
            (simulation, moved)
        };
        let (_, plain) = run(None);
        let (watched, found) = run(Some(Monitor::every(1, largest)));
        assert_eq!(plain, found);
        let monitor = watched.monitor().unwrap();
        let worst = monitor.worst();
        assert_eq!((monitor.checks(), monitor.exceeded()), (40, 0), "{worst:?}");
        let (strict, _) = run(Some(Monitor::every(1, f64::EPSILON)));
        assert_eq!(strict.monitor().unwrap().exceeded(), 40);
    }
}

/// A tolerance is met by the device, of steps and of accelerations.
#[test]
fn a_tolerance_is_met_with_elements() {
    let Some(device) = device() else { return };
    let (model, tolerance) = (chain(24, 3), 1e-7);
    let mut state = State::neutral(&model);
    state.qd.copy_from_slice(&State::random(&model, 3).qd);
    let run = |simulation: Simulation, tolerance| {
        let tolerance = SolverOptions::to_tolerance(tolerance);
        let mut simulation = simulation.with_solver(&tolerance).unwrap();
        let state = moved_by(&mut simulation, &state, 1e-4, 40).0;
        let qdd = simulation.accelerations().unwrap();
        (simulation, state, qdd)
    };
    let options = options(PRECISIONS[2], 4, 0);
    let gpu = Simulation::on_gpu(&device, model.clone(), &options).unwrap();
    let (remote, reached, found) = run(gpu, tolerance);
    assert!(remote.choice().on_gpu, "{}", remote.choice());
    assert!(remote.achieved().unwrap().error <= tolerance);
    let host = Simulation::new(model.clone()).unwrap();
    let mut host = host
        .with_solver(&SolverOptions::to_tolerance(1e-12))
        .unwrap();
    moved_by(&mut host, &state, 1e-4, 40);
    host.set_state(reached).unwrap();
    let exact = host.accelerations().unwrap();
    let scale = largest(&exact);
    for (a, b) in found.iter().zip(&exact) {
        assert!((a - b).abs() <= tolerance * scale, "{a} and {b}");
    }
}

/// A simulation that leaves the device for a tolerance takes along what was done there.
#[test]
fn work_is_taken_to_the_processor() {
    let Some(device) = device() else { return };
    let model = chain(8, 4);
    for (tolerance, is_met) in [(1e-9, true), (1e-14, false)] {
        let options = options(PRECISIONS[2], 4, 0);
        let mut simulation = Simulation::on_gpu(&device, model.clone(), &options).unwrap();
        simulation.steps(1e-3, 3).unwrap();
        let mut there = Simulation::new(model.clone()).unwrap();
        there.steps(1e-3, 3).unwrap();
        let expected = *there.elements().unwrap().work();
        let tolerance = SolverOptions::to_tolerance(tolerance);
        let mut simulation = simulation.with_solver(&tolerance).unwrap();
        assert_eq!(
            simulation.choice().on_gpu,
            is_met,
            "{}",
            simulation.choice()
        );
        let found = simulation.work().unwrap();
        let (a, b) = (found.springs, expected.springs);
        assert!(b != 0.0 && (a - b).abs() <= 1e-6 * b.abs(), "{a} and {b}");
        simulation.step(1e-3).unwrap();
        assert!(simulation.work().unwrap() != found);
    }
}

/// A model without elements is given a motor on the way, and what is asked of one state is the CPU's answer.
#[test]
fn a_motor_on_the_way() {
    let Some(device) = device() else { return };
    let model = generate::random_chain(9, &Rod::default(), 2).unwrap();
    let body = model.last_body();
    let options = options(PRECISIONS[2], 4, 0);
    let run = |mut simulation: Simulation| {
        simulation.set_state(State::random(&model, 6)).unwrap();
        simulation.steps(1e-3, 5).unwrap();
        assert_eq!(simulation.work().unwrap(), Work::default());
        simulation
            .set_motor(body, Motor::velocity(3.0, 2.0).limited(1.0))
            .unwrap();
        simulation.steps(1e-3, 5).unwrap();
        let first = simulation.work().unwrap().motors;
        let state = simulation.state().unwrap().clone();
        simulation.set_state(state).unwrap();
        simulation.set_motor(body, Motor::torque(-0.5)).unwrap();
        simulation.steps(1e-3, 5).unwrap();
        let work = simulation.work().unwrap();
        assert!(first != 0.0 && work.motors != first);
        let solved = simulation
            .solve()
            .unwrap()
            .joint_accelerations()
            .unwrap()
            .to_vec();
        let mut state = simulation.state().unwrap().clone();
        state.q.extend(solved);
        (state, work)
    };
    let expected = run(Simulation::new(model.clone()).unwrap());
    let found = run(Simulation::on_gpu(&device, model.clone(), &options).unwrap());
    assert_alike(&found, &expected, 1e-9, "a motor on the way");
}
