//! Divide and conquer on a GPU against the CPU: accelerations, steps, poses, faults.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

mod remote;

use glam::{DMat3, DVec3};
use remote::{PRECISIONS, device};
use vertebra_assembly::generate::{self, Masses, RandomTree, Rod};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{Joint, MassProperties, Model, ModelDescription, Random, State};
use vertebra_dynamics::gpu::{Options, Simulation};
use vertebra_dynamics::{
    DcaOptions, DcaWorkspace, Error, Forces, Integrator, Precision, Workspace, Wrench, aba, dca,
    forward_error,
};
use vertebra_gpu::Device;
use vertebra_spatial::Pose;

fn inputs(model: &Model, seed: u64) -> (State, Forces) {
    let mut forces = Forces::none(model);
    let mut random = Random::new(seed);
    forces.joint.fill_with(|| random.symmetric());
    let bodies: Vec<_> = model.body_ids().collect();
    for at in 0..4 {
        let wrench = Wrench::at_point(random.direction() * 5.0, random.direction())
            .with_torque(random.direction());
        let wrench = if at % 2 == 0 {
            wrench
        } else {
            wrench.in_body_axes()
        };
        forces.push(bodies[random.below(bodies.len())], wrench);
    }
    (State::random(model, seed), forces)
}

fn options(chunks: Precision, tree: Precision, window: usize) -> Options {
    Options {
        chunks: Some(chunks),
        tree: Some(tree),
        schedule: Some(ScheduleOptions::with_window(window)),
        ..Options::default()
    }
}

/// Forward errors against the reference: of the GPU, and of its twin on the CPU.
fn errors(device: &Device, model: &Model, seed: u64, options: &Options) -> [f64; 2] {
    let (state, forces) = inputs(model, seed);
    let mut reference = Workspace::new(model, Precision::Reference);
    aba(model, &state, &forces, &mut reference).unwrap();
    let mut simulation = Simulation::on(device, model, options).unwrap();
    simulation.set_state(&state).unwrap();
    simulation.set_forces(&forces).unwrap();
    let qdd = simulation.accelerations().unwrap();
    let (chunks, tree) = simulation.precisions();
    let twin = DcaOptions {
        chunks,
        tree,
        schedule: options.schedule,
        parallel: false,
    };
    let mut workspace = DcaWorkspace::new(model, &twin).unwrap();
    let twin = dca(model, &state, &forces, &mut workspace).unwrap();
    [
        forward_error(&qdd, &reference).unwrap(),
        forward_error(twin, &reference).unwrap(),
    ]
}

/// The same digits as on the CPU, up to a constant.
fn compare(device: &Device, model: &Model, seed: u64, options: &Options, what: &str) {
    let [gpu, cpu] = errors(device, model, seed, options);
    let (chunks, tree) = (options.chunks.unwrap(), options.tree.unwrap());
    // Of one seed the error of either may be small by chance.
    let bound = 16.0 * cpu + 256.0 * tree.epsilon().max(chunks.epsilon());
    assert!(
        gpu <= bound,
        "{what}, seed {seed}, {chunks} {tree}: {gpu:e} on the GPU, {cpu:e} on the CPU"
    );
}

#[test]
fn chains() {
    let Some(device) = device() else { return };
    for (chunks, tree) in PRECISIONS {
        for count in [1, 2, 3, 9, 33, 150, 700] {
            let model = generate::random_chain(count, &Rod::default(), count as u64).unwrap();
            let what = format!("chain of {count}");
            compare(&device, &model, 3, &options(chunks, tree, 8), &what);
        }
    }
}

/// Joints of all kinds, fixed and floating bases, forests, branches, chunks short and long.
#[test]
fn trees() {
    let Some(device) = device() else { return };
    let mut seed = 0;
    for (chunks, tree) in PRECISIONS {
        for count in [1, 5, 60, 300] {
            for (reach, window, articulations) in [(1, 8, 1), (3, 2, 2), (8, 8, 5), (count, 4, 1)] {
                seed += 1;
                let shape = RandomTree {
                    count,
                    reach,
                    articulations,
                    floating: seed % 2 == 0,
                    mixed: true,
                };
                let model = generate::random_tree(&shape, seed).unwrap();
                let what = format!("{shape:?} window {window}");
                compare(&device, &model, seed, &options(chunks, tree, window), &what);
            }
        }
    }
}

/// Heavy tips are leaves of their own; light links lie between.
#[test]
fn uneven_masses() {
    let Some(device) = device() else { return };
    for (masses, reach) in [
        (Masses::HeavyTips(1e8), 1),
        (Masses::Alternating(1e4), 1),
        (Masses::EveryEighth(1e-12), 1),
        (Masses::Decades(4.0), 1),
        (Masses::Decades(4.0), 4),
    ] {
        let model = generate::uneven_tree(200, reach, &Rod::default(), &masses, 5).unwrap();
        // Trees need kernels of their own, which take a software driver long to compile.
        let choices = if reach == 1 {
            &PRECISIONS[..]
        } else {
            &PRECISIONS[1..2]
        };
        for &(chunks, tree) in choices {
            let what = format!("{masses:?} reach {reach}");
            compare(&device, &model, 7, &options(chunks, tree, 8), &what);
        }
    }
}

/// Forward errors after no, one and two corrections; of the CPU with joins in f64 too, in the same chunks.
fn refined_errors(device: &Device, model: &Model, seed: u64, options: &Options) -> [f64; 4] {
    let (state, forces) = inputs(model, seed);
    let mut reference = Workspace::new(model, Precision::Reference);
    aba(model, &state, &forces, &mut reference).unwrap();
    let error = |sweeps| {
        let options = Options { sweeps, ..*options };
        let mut simulation = Simulation::on(device, model, &options).unwrap();
        simulation.set_state(&state).unwrap();
        simulation.set_forces(&forces).unwrap();
        let first = simulation.accelerations().unwrap();
        // Nothing of one solution is left in the next.
        assert_eq!(first, simulation.accelerations().unwrap());
        forward_error(&first, &reference).unwrap()
    };
    let twin = DcaOptions {
        schedule: options.schedule,
        parallel: false,
        ..DcaOptions::default()
    };
    let mut workspace = DcaWorkspace::new(model, &twin).unwrap();
    let twin = dca(model, &state, &forces, &mut workspace).unwrap();
    [
        error(0),
        error(1),
        error(2),
        forward_error(twin, &reference).unwrap(),
    ]
}

/// Each correction gains the digits that the joins have, up to those of the chunks.
fn compare_refined(device: &Device, model: &Model, seed: u64, window: usize, what: &str) {
    let options = options(Precision::F64, Precision::F32, window);
    let [none, one, two, cpu] = refined_errors(device, model, seed, &options);
    let n = model.bodies().len() as f64;
    let rounding = 16.0 * cpu + 64.0 * n.sqrt() * f64::EPSILON;
    let gained = 1e3 * f64::from(f32::EPSILON);
    assert!(one <= gained * none + rounding, "{what}: {none:e} {one:e}");
    assert!(two <= gained * one + rounding, "{what}: {one:e} {two:e}");
}

#[test]
fn corrected_chains() {
    let Some(device) = device() else { return };
    for count in [1, 9, 33, 700] {
        let model = generate::random_chain(count, &Rod::default(), count as u64).unwrap();
        compare_refined(&device, &model, 3, 4, &format!("chain of {count}"));
    }
    for masses in [
        Masses::HeavyTips(1e8),
        Masses::Alternating(1e4),
        Masses::EveryEighth(1e-12),
        Masses::Decades(8.0),
    ] {
        let model = generate::uneven_tree(200, 1, &Rod::default(), &masses, 5).unwrap();
        compare_refined(&device, &model, 7, 8, &format!("{masses:?}"));
    }
}

/// What masses cost inside chunks is corrected too, and what joins have rounded of it: no digit of theirs is left to
/// be seen beyond rounding, though f64 alone loses up to eight.
#[test]
fn corrected_masses() {
    let Some(device) = device() else { return };
    let rod = Rod::default();
    for (masses, reach) in [
        (Masses::HeavyTips(1e8), 1),
        (Masses::EveryEighth(1e4), 1),
        (Masses::Decades(8.0), 1),
    ] {
        let model = generate::uneven_tree(100, reach, &rod, &masses, 5).unwrap();
        // In chunks of four joints no heavy end is a leaf.
        let options = options(Precision::F64, Precision::F32, 4);
        let [_, _, two, _] = refined_errors(&device, &model, 7, &options);
        let bound = 64.0 * 10.0 * f64::EPSILON;
        assert!(two <= bound, "{masses:?}: {two:e}");
    }
}

#[test]
fn corrected_trees() {
    let Some(device) = device() else { return };
    let mut seed = 0;
    for count in [60, 300] {
        for (reach, window, articulations) in [(3, 2, 2), (8, 4, 5), (count, 4, 1)] {
            seed += 1;
            let shape = RandomTree {
                count,
                reach,
                articulations,
                floating: seed % 2 == 0,
                mixed: true,
            };
            let model = generate::random_tree(&shape, seed).unwrap();
            let what = format!("{shape:?} window {window}");
            compare_refined(&device, &model, seed, window, &what);
        }
    }
    let masses = Masses::Decades(4.0);
    let model = generate::uneven_tree(200, 4, &Rod::default(), &masses, 5).unwrap();
    compare_refined(&device, &model, 7, 4, "uneven tree");
}

/// Steps take corrected accelerations, and what cannot be corrected is refused.
#[test]
fn corrected_steps() {
    let Some(device) = device() else { return };
    let tree = generate::random_tree(&RandomTree::mixed(40), 3).unwrap();
    // Kernels of trees take a software driver long to compile.
    let chain = generate::random_chain(40, &Rod::default(), 3).unwrap();
    for (integrator, model) in [
        (Integrator::SemiImplicitEuler, &tree),
        (Integrator::RungeKutta4, &chain),
    ] {
        let (state, forces) = inputs(model, 4);
        let mut cpu = vertebra_dynamics::Simulation::new(model.clone())
            .unwrap()
            .with_integrator(integrator);
        cpu.set_state(state.clone()).unwrap();
        *cpu.forces_mut() = forces.clone();
        let options = Options {
            integrator,
            sweeps: 2,
            ..options(Precision::F64, Precision::F32, 2)
        };
        let mut gpu = Simulation::on(&device, model, &options).unwrap();
        gpu.set_state(&state).unwrap();
        gpu.set_forces(&forces).unwrap();
        gpu.steps(1e-4, 3).unwrap();
        for _ in 0..3 {
            cpu.step(1e-4).unwrap();
        }
        let found = gpu.state().unwrap().qd;
        let expected = &cpu.state().unwrap().qd;
        let largest = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for (a, b) in found.iter().zip(expected) {
            let error = (a - b).abs() / largest;
            assert!(error <= 1e-11, "{integrator:?}: {error:e}");
        }
    }
    for (chunks, sweeps) in [(Precision::F32, 1), (Precision::F64, 4)] {
        let options = Options {
            sweeps,
            ..options(chunks, Precision::F32, 4)
        };
        let refused = Simulation::on(&device, &chain, &options);
        assert!(matches!(refused, Err(Error::Sweeps { .. })), "{refused:?}");
    }
}

/// Steps of either integrator are the CPU's, and poses are those of the state.
#[test]
fn steps_and_poses() {
    let Some(device) = device() else { return };
    let shape = RandomTree {
        count: 40,
        reach: 4,
        articulations: 2,
        floating: true,
        mixed: true,
    };
    let model = generate::random_tree(&shape, 11).unwrap();
    let (state, forces) = inputs(&model, 12);
    let (euler, runge_kutta) = (Integrator::SemiImplicitEuler, Integrator::RungeKutta4);
    for (integrator, tree, bound) in [
        (euler, Precision::F32, 1e-5),
        (runge_kutta, Precision::F64, 1e-10),
    ] {
        let chunks = Precision::F64;
        let options = Options {
            integrator,
            ..options(chunks, tree, 4)
        };
        let mut gpu = Simulation::on(&device, &model, &options).unwrap();
        gpu.set_state(&state).unwrap();
        gpu.set_forces(&forces).unwrap();
        let mut cpu = vertebra_dynamics::Simulation::new(model.clone())
            .unwrap()
            .with_integrator(integrator);
        cpu.set_state(state.clone()).unwrap();
        *cpu.forces_mut() = forces.clone();
        gpu.steps(1e-3, 18).unwrap();
        for _ in 0..18 {
            cpu.step(1e-3).unwrap();
        }
        let moved = gpu.state().unwrap();
        let expected = cpu.state().unwrap().clone();
        assert_eq!(moved.time.to_bits(), expected.time.to_bits());
        let largest = |v: &[f64]| v.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for (found, expected) in [(&moved.q, &expected.q), (&moved.qd, &expected.qd)] {
            let scale = largest(expected);
            for (a, b) in found.iter().zip(expected) {
                let error = (a - b).abs() / scale;
                assert!(error <= bound, "{integrator:?} {chunks}: {error:e}");
            }
        }
        let poses = gpu.poses().unwrap();
        for (body, pose) in model.body_ids().zip(&poses) {
            let expected = cpu.pose(body).unwrap();
            let apart = pose.translation - expected.translation;
            let scale = 1.0 + expected.translation.length();
            assert!(apart.length() <= 10.0 * bound * scale, "{apart}");
            let angle = 1.0 - pose.rotation.dot(expected.rotation).abs();
            assert!(angle <= 10.0 * bound, "{angle:e}");
        }
    }
}

/// One run like another, and steps in one call like steps in several.
#[test]
fn the_same_bits() {
    let Some(device) = device() else { return };
    let model = generate::random_tree(&RandomTree::mixed(80), 3).unwrap();
    let (state, forces) = inputs(&model, 4);
    let run = |calls: &[usize]| {
        let mut simulation = Simulation::on(&device, &model, &Options::default()).unwrap();
        simulation.set_state(&state).unwrap();
        simulation.set_forces(&forces).unwrap();
        for &count in calls {
            simulation.steps(1e-3, count).unwrap();
        }
        simulation.state().unwrap()
    };
    assert_eq!(run(&[20]), run(&[20]));
    assert_eq!(run(&[20]).q, run(&[3, 16, 1]).q);
}

/// Energy of a chain without damping stays as it does on the CPU.
#[test]
fn energy() {
    let Some(device) = device() else { return };
    let model = generate::random_chain(24, &Rod::default(), 1).unwrap();
    let mut state = State::random(&model, 2);
    state.qd.fill(0.0);
    let mut cpu = vertebra_dynamics::Simulation::new(model.clone()).unwrap();
    cpu.set_state(state.clone()).unwrap();
    let before = cpu.mechanics().unwrap();
    let (h, count) = (1e-5, 1000);
    for _ in 0..count {
        cpu.step(h).unwrap();
    }
    let total = |m: &vertebra_dynamics::Mechanics| m.kinetic_energy + m.potential_energy;
    let on_cpu = (total(&cpu.mechanics().unwrap()) - total(&before)).abs();
    let mut gpu = Simulation::on(&device, &model, &Options::default()).unwrap();
    gpu.set_state(&state).unwrap();
    gpu.steps(h, count).unwrap();
    cpu.set_state(gpu.state().unwrap()).unwrap();
    let on_gpu = (total(&cpu.mechanics().unwrap()) - total(&before)).abs();
    let scale = total(&before).abs() * 1e-9;
    assert!(
        on_gpu <= 10.0 * on_cpu + scale,
        "{on_gpu:e}, on the CPU {on_cpu:e}"
    );
}

/// A state that overflows ends in an error that names a body and the step, and the state before it is
/// kept, steps before it being taken.
#[test]
fn faults() {
    let Some(device) = device() else { return };
    let model = generate::random_chain(20, &Rod::default(), 1).unwrap();
    let mut simulation = Simulation::on(&device, &model, &Options::default()).unwrap();
    let mut state = State::random(&model, 2);
    state.qd.fill(1e30);
    simulation.set_state(&state).unwrap();
    let error = simulation.steps(1e9, 40).unwrap_err();
    let Error::Step {
        step,
        count,
        source,
    } = &error
    else {
        unreachable!("{error}");
    };
    assert_eq!(*count, 40);
    assert!(matches!(**source, Error::Overflow { .. }), "{source}");
    let kept = simulation.state().unwrap();
    assert!(kept.qd.iter().chain(&kept.q).all(|x| x.is_finite()));
    assert_eq!(kept.time, 1e9 * *step as f64);
    if *step == 0 {
        assert_eq!(kept.qd, state.qd);
    }
    // The same step fails again, and a good state goes on.
    assert!(matches!(
        simulation.step(1e9),
        Err(Error::Step { step: 0, .. })
    ));
    let good = State::random(&model, 3);
    simulation.set_state(&good).unwrap();
    simulation.step(1e-3).unwrap();
    let mut again = Simulation::on(&device, &model, &Options::default()).unwrap();
    again.set_state(&good).unwrap();
    again.step(1e-3).unwrap();
    assert_eq!(simulation.state().unwrap(), again.state().unwrap());

    // Numbers that are none never reach the device.
    let mut broken = good.clone();
    broken.q[3] = f64::NAN;
    assert!(matches!(
        simulation.set_state(&broken),
        Err(Error::Model(_))
    ));
    let mut forces = Forces::none(&model);
    forces.joint[2] = f64::INFINITY;
    let refused = simulation.set_forces(&forces);
    assert!(matches!(refused, Err(Error::NonFiniteInput { .. })));
    assert!(matches!(
        simulation.step(f64::NAN),
        Err(Error::NonFiniteInput { .. })
    ));
    assert_eq!(simulation.state().unwrap(), again.state().unwrap());
}

/// What a device cannot compute in is refused before anything is uploaded.
#[test]
fn precisions() {
    let Some(device) = device() else { return };
    let model = generate::random_chain(3, &Rod::default(), 1).unwrap();
    let reference = Options {
        chunks: Some(Precision::Reference),
        ..Options::default()
    };
    let refused = Simulation::on(&device, &model, &reference).unwrap_err();
    assert!(
        matches!(refused, Error::PrecisionUnavailable { .. }),
        "{refused}"
    );
    for (tree, expected) in [
        (None, Precision::F64),
        (Some(Precision::F32), Precision::F32),
        (Some(Precision::F64), Precision::F64),
    ] {
        let asked = Options {
            tree,
            ..Options::default()
        };
        let simulation = Simulation::on(&device, &model, &asked).unwrap();
        assert_eq!(simulation.precisions(), (Precision::F64, expected));
    }
    let finer = options(Precision::F32, Precision::F64, 8);
    let refused = Simulation::on(&device, &model, &finer).unwrap_err();
    assert!(matches!(refused, Error::TreePrecision { .. }), "{refused}");
    let plain = vertebra_gpu::Options {
        wanted: vertebra_gpu::wgpu::Features::empty(),
        ..vertebra_gpu::Options::default()
    };
    let plain = Device::open(plain).unwrap();
    let refused = Simulation::on(&plain, &model, &options(Precision::F64, Precision::F32, 8));
    assert!(matches!(refused, Err(Error::PrecisionUnavailable { .. })));
    let mut simulation = Simulation::on(&plain, &model, &Options::default()).unwrap();
    assert_eq!(simulation.precisions(), (Precision::F32, Precision::F32));
    simulation.step(1e-3).unwrap();
}

/// A hub without inertia to speak of, from which chains hang by joints about the hub's own axis: they
/// leave it nothing, and what rounding of the joins leaves is not taken for an inertia.
#[test]
fn singular_joints_are_named() {
    let bare = MassProperties {
        mass: 1e-9,
        center: DVec3::ZERO,
        inertia: DMat3::from_diagonal(DVec3::splat(1e-17)),
    };
    let tip = Pose::from_translation(DVec3::Z);
    let rod = MassProperties::rod(1.0, 1.0, 0.05);
    let frame = Joint::revolute(DVec3::Y);
    let hub = Joint::revolute(DVec3::X).at(tip);
    let mut description = ModelDescription::new("hub")
        .body("frame", None, frame, rod)
        .body("hub", Some("frame"), hub, bare);
    let mut random = Random::new(4);
    for chain in 0..3 {
        let mut parent = "hub".to_owned();
        for index in 0..20 {
            let name = format!("rod-{chain}-{index}");
            let joint = match index {
                0 => Joint::revolute(DVec3::X),
                _ => Joint::revolute(random.direction()).at(tip),
            };
            description = description.body(&name, Some(&parent), joint, rod);
            parent = name;
        }
    }
    let Some(device) = device() else { return };
    let model = description.build().unwrap();
    let options = options(Precision::F64, Precision::F32, 8);
    let mut simulation = Simulation::on(&device, &model, &options).unwrap();
    simulation.set_state(&State::random(&model, 5)).unwrap();
    let named = Error::SingularJoint {
        body: "hub".to_owned(),
    };
    assert_eq!(simulation.accelerations(), Err(named.clone()));
    let step = Error::Step {
        step: 0,
        count: 1,
        source: Box::new(named),
    };
    assert_eq!(simulation.step(1e-3), Err(step));
}
