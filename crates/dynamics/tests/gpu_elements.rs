//! What acts in joints on a GPU, against the CPU: inertia of freedoms' own, springs, dampers, friction, stops,
//! motors, on joints of every kind.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

use std::sync::OnceLock;
use vertebra_assembly::generate::{self, Masses, RandomTree, Rod};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{BodyId, Model, Random, State};
use vertebra_dynamics::gpu::Options;
use vertebra_dynamics::{
    DcaOptions, DcaWorkspace, Forces, Motor, Precision, Simulation, Work,
    Workspace, aba, dca, forward_error, gpu,
};
use vertebra_gpu::{Device, tests_are_left_out};

/// Chunks and joins: the three choices there are.
const PRECISIONS: [(Precision, Precision); 3] = [
    (Precision::F32, Precision::F32),
    (Precision::F64, Precision::F32),
    (Precision::F64, Precision::F64),
];

/// One for all tests, so that pipelines are compiled once.
fn device() -> Option<Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    let open = || (!tests_are_left_out()).then(|| Device::auto().unwrap());
    DEVICE.get_or_init(open).clone()
}

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

/// Accelerations of freedoms with inertia of their own have the digits that they have on the CPU.
fn compare_held(device: &Device, model: &Model, seed: u64, options: &Options, what: &str) {
    let (state, forces) = (State::random(model, seed), held(model, seed));
    let mut reference = Workspace::new(model, Precision::Reference);
    aba(model, &state, &forces, &mut reference).unwrap();
    let mut simulation = gpu::Simulation::on(device, &model.bare(), options).unwrap();
    simulation.set_state(&state).unwrap();
    simulation.set_forces(&forces).unwrap();
    let found = forward_error(&simulation.accelerations().unwrap(), &reference).unwrap();
    let (chunks, tree) = simulation.precisions();
    let twin = DcaOptions {
        chunks,
        tree: if options.sweeps > 0 { chunks } else { tree },
        schedule: options.schedule,
        parallel: false,
    };
    let mut workspace = DcaWorkspace::new(model, &twin).unwrap();
    let twin = dca(model, &state, &forces, &mut workspace).unwrap();
    let cpu = forward_error(twin, &reference).unwrap();
    let rounding = if options.sweeps > 0 {
        chunks.epsilon()
    } else {
        tree.epsilon()
    };
    let bound = 16.0 * cpu + 256.0 * rounding;
    assert!(
        found <= bound,
        "{what}, seed {seed}, {chunks} {tree}: {found:e} on the GPU, {cpu:e} on the CPU"
    );
}

#[test]
fn inertia_of_freedoms_own() {
    let Some(device) = device() else { return };
    // Trees need kernels of their own, which take a software driver long to compile: of each precision once.
    for (precisions, seed, count, window) in [
        (PRECISIONS[0], 1, 5, 4),
        (PRECISIONS[1], 2, 60, 2),
        (PRECISIONS[2], 3, 80, 8),
    ] {
        let model = generate::random_mechanism(count, true, seed).unwrap();
        let what = format!("mechanism of {count}");
        compare_held(&device, &model, seed, &options(precisions, window, 0), &what);
    }
    let shape = RandomTree {
        floating: true,
        ..RandomTree::mixed(40)
    };
    let model = generate::random_tree(&shape, 4).unwrap();
    compare_held(&device, &model, 4, &options(PRECISIONS[2], 4, 0), "floating tree");
}

/// Chunks that end with leaves, whose joints' own inertia is a compliance of a join.
#[test]
fn inertia_of_freedoms_own_at_heavy_ends() {
    let Some(device) = device() else { return };
    let model = generate::uneven_tree(60, 1, &Rod::default(), &Masses::HeavyTips(1e8), 5).unwrap();
    compare_held(&device, &model, 7, &options(PRECISIONS[2], 8, 0), "heavy tips");
}

/// And corrections gain the digits that joins lack.
#[test]
fn inertia_of_freedoms_own_corrected() {
    let Some(device) = device() else { return };
    let model = generate::random_mechanism(60, true, 1).unwrap();
    compare_held(&device, &model, 1, &options(PRECISIONS[1], 4, 2), "corrected mechanism");
}

/// A motor of each kind on bodies with one freedom.
fn drive(simulation: &mut Simulation, model: &Model, seed: u64) {
    let mut random = Random::new(seed);
    let driven: Vec<BodyId> = (model.body_ids().zip(model.bodies()))
        .filter(|(_, body)| body.dof_range().len() == 1)
        .map(|(id, _)| id)
        .collect();
    for motor in [
        Motor::torque(0.3),
        Motor::velocity(1.0, 2.0),
        Motor::position(0.4, 50.0, 1.0),
        Motor::position(-0.4, 500.0, 1.0).limited(0.5),
    ] {
        let body = driven[random.below(driven.len())];
        simulation.set_motor(body, motor).unwrap();
    }
}

/// The state and the work after some steps, with motors that change on the way.
fn moved(mut simulation: Simulation, state: &State, h: f64, count: usize) -> (State, Work) {
    let model = simulation.model().clone();
    simulation.set_state(state.clone()).unwrap();
    drive(&mut simulation, &model, 1);
    simulation.steps(h, count).unwrap();
    drive(&mut simulation, &model, 2);
    simulation.steps(h, count).unwrap();
    let work = simulation.work().unwrap();
    (simulation.state().unwrap().clone(), work)
}

fn largest(v: &[f64]) -> f64 {
    v.iter().fold(1.0_f64, |m, x| m.max(x.abs()))
}

fn assert_alike(found: &(State, Work), expected: &(State, Work), bound: f64, what: &str) {
    for (found, expected) in [
        (&found.0.q, &expected.0.q),
        (&found.0.qd, &expected.0.qd),
    ] {
        let scale = largest(expected);
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() <= bound * scale, "{what}: {a} and {b}");
        }
    }
    let works = |work: &Work| {
        [
            work.motors,
            work.springs,
            work.dampers,
            work.friction,
            work.stops,
        ]
    };
    let (found, expected) = (works(&found.1), works(&expected.1));
    let scale = largest(&expected);
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= bound * scale, "work, {what}: {a} and {b}");
    }
}

/// Steps of mechanisms with every kind of joint and element are the CPU's: laws end on the same parts.
#[test]
fn steps_of_mechanisms() {
    let Some(device) = device() else { return };
    for (seed, count) in [(1, 6), (2, 40)] {
        let model = generate::random_mechanism(count, true, seed).unwrap();
        let mut state = State::neutral(&model);
        state.qd.copy_from_slice(&State::random(&model, seed).qd);
        let expected = moved(Simulation::new(model.clone()).unwrap(), &state, 1e-3, 20);
        for work in [expected.1.motors, expected.1.friction, expected.1.stops] {
            assert!(work != 0.0, "{:?}", expected.1);
        }
        let options = options((Precision::F64, Precision::F64), 4, 0);
        let gpu = Simulation::on_gpu(&device, model.clone(), &options).unwrap();
        let found = moved(gpu, &state, 1e-3, 20);
        assert_alike(&found, &expected, 1e-7, &format!("mechanism of {count}"));
    }
}
