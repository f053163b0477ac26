//! One simulation on every device: the same verbs, the same answers, and refusals that say what to do.

#![cfg(feature = "gpu")]
#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

mod exact;

use glam::DVec3;
use std::sync::OnceLock;
use vertebra_assembly::generate::{self, RandomTree, Rod};
use vertebra_assembly::{Closure, Joint, MassProperties, Model, ModelDescription, Random, State};
use vertebra_dynamics::gpu::PoseBuffer;
use vertebra_dynamics::{
    Algorithm, Device, Error, Forces, Integrator, Monitor, Precision, Simulation, SolverOptions,
    Wrench,
};
use vertebra_gpu::wgpu::{Features, Limits};
use vertebra_gpu::{Options, tests_are_left_out};
use vertebra_spatial::Pose;

/// The processor and a GPU, one for all tests.
fn devices() -> Vec<Device> {
    static GPU: OnceLock<Option<Device>> = OnceLock::new();
    let open = || (!tests_are_left_out()).then(|| Device::auto().unwrap());
    let gpu = GPU.get_or_init(open).clone();
    [Some(Device::cpu()), gpu].into_iter().flatten().collect()
}

fn gpu() -> Option<Device> {
    devices().pop().filter(Device::is_gpu)
}

fn has_f64(device: &Device) -> bool {
    let gpu = device.gpu();
    gpu.is_none_or(|gpu| gpu.features().contains(Features::SHADER_F64))
}

fn problem(seed: u64) -> (Model, State, Forces) {
    let tree = RandomTree {
        articulations: 2,
        floating: true,
        // Kernels for all joints take a software driver half a minute to compile.
        mixed: false,
        ..RandomTree::mixed(30)
    };
    let model = generate::random_tree(&tree, seed).unwrap();
    let mut forces = Forces::none(&model);
    let mut random = Random::new(seed);
    forces.joint.fill_with(|| random.symmetric());
    let state = State::random(&model, seed);
    (model, state, forces)
}

/// Everything that can be asked of a moved simulation, as numbers.
fn answers(simulation: &mut Simulation) -> Vec<f64> {
    let model = simulation.model().clone();
    let mut numbers = vec![simulation.time()];
    let state = simulation.state().unwrap();
    numbers.extend(state.q.iter().chain(&state.qd));
    assert_eq!(state.time, numbers[0]);
    let poses = simulation.poses().unwrap().to_vec();
    for (body, pose) in model.body_ids().zip(&poses) {
        let alone = simulation.pose(body).unwrap();
        assert!((alone.translation - pose.translation).length() < 1e-9);
        numbers.extend(pose.translation.to_array());
        numbers.extend(pose.rotation.to_array().map(f64::abs));
    }
    let tip = model.last_body();
    numbers.extend(simulation.velocity(tip).unwrap().linear.to_array());
    let sums = simulation.mechanics().unwrap();
    numbers.extend([sums.kinetic_energy, sums.potential_energy]);
    let solved = simulation.solve().unwrap();
    numbers.extend(solved.joint_accelerations().unwrap());
    numbers
}

#[test]
fn the_same_verbs_give_the_same_answers() {
    for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
        let (model, state, forces) = problem(5);
        let mut found = Vec::new();
        for device in devices().into_iter().filter(has_f64) {
            let mut simulation = Simulation::on(&device, model.clone())
                .unwrap()
                .with_integrator(integrator)
                .with_precision(Precision::F64)
                .unwrap();
            simulation.set_state(state.clone()).unwrap();
            *simulation.forces_mut() = forces.clone();
            simulation.steps(1e-4, 17).unwrap();
            // Forces that come later count from there on.
            let push = Wrench::at_center([3.0, -2.0, 1.0]);
            simulation.forces_mut().push(model.last_body(), push);
            simulation.step(2e-4).unwrap();
            found.push(answers(&mut simulation));
        }
        let [cpu, rest @ ..] = &found[..] else {
            continue;
        };
        let largest = cpu.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for gpu in rest {
            assert_eq!(cpu.len(), gpu.len());
            for (a, b) in cpu.iter().zip(gpu) {
                assert!((a - b).abs() <= 1e-10 * largest, "{a} {b}, {integrator:?}");
            }
        }
    }
}

/// A solver chosen on the way does not move the state.
#[test]
fn the_state_outlives_a_change_of_solver() {
    let (model, state, _) = problem(6);
    for device in devices() {
        let mut simulation = Simulation::on(&device, model.clone()).unwrap();
        simulation.set_state(state.clone()).unwrap();
        simulation.steps(1e-4, 3).unwrap();
        let moved = simulation.state().unwrap().clone();
        let mut simulation = simulation.with_precision(Precision::F32).unwrap();
        assert_eq!(simulation.time(), moved.time);
        let kept = simulation.state().unwrap();
        for (a, b) in kept.q.iter().zip(&moved.q) {
            assert!((a - b).abs() <= f64::from(f32::EPSILON) * (1.0 + b.abs()));
        }
        assert_eq!(simulation.choice().precision, Precision::F32);
        simulation.step(1e-4).unwrap();
        assert_ne!(simulation.state().unwrap().q, moved.q);
    }
}

/// Poses that are on their way are those from before the steps that were asked for meanwhile.
#[test]
fn poses_on_their_way_are_not_overtaken() {
    let (model, state, _) = problem(7);
    for device in devices() {
        let mut simulation = Simulation::on(&device, model.clone()).unwrap();
        simulation.set_state(state.clone()).unwrap();
        let before = simulation.poses().unwrap().to_vec();
        let first = simulation.begin_poses().unwrap();
        simulation.steps(1e-3, 5).unwrap();
        let second = simulation.begin_poses().unwrap();
        simulation.steps(1e-3, 5).unwrap();
        assert_eq!(first.wait().unwrap(), before);
        let second = second.wait().unwrap();
        assert_ne!(second, before);
        assert_ne!(simulation.poses().unwrap(), second);
        let buffer = simulation.pose_buffer();
        assert_eq!(buffer.is_some(), device.is_gpu());
        if let Some(PoseBuffer::F64(buffer)) = buffer {
            assert_eq!(buffer.len(), 2 * model.bodies().len());
        }
    }
}

/// Nothing falls back unasked, and what did says why.
#[test]
fn a_missing_adapter_falls_back_only_when_allowed() {
    let missing = || Device::named("no such adapter");
    let error = missing().unwrap_err();
    assert!(error.to_string().contains("no such adapter"), "{error}");
    let device = missing().unwrap_or_else(Device::cpu_instead);
    assert!(!device.is_gpu() && device.gpu().is_none());
    assert_eq!(device.fallback(), Some(&error));
    assert_eq!(device.to_string(), "the CPU");
    assert_eq!(Device::cpu().fallback(), None);
    let (model, ..) = problem(1);
    let mut simulation = Simulation::on(&device, model).unwrap();
    simulation.step(1e-3).unwrap();
    assert!(!simulation.choice().on_gpu && simulation.solver().is_some());
}

/// The choice is made by the model, unless a device was asked for; it says so either way.
#[test]
fn the_faster_device_is_chosen_where_that_is_allowed() {
    let Some(device) = gpu() else { return };
    let (model, ..) = problem(2);
    let asked = Simulation::on(&device, model.clone()).unwrap();
    let choice = *asked.choice();
    assert!(choice.on_gpu && choice.forced && asked.solver().is_none());
    assert_eq!(choice.algorithm, Algorithm::Dca);
    let text = choice.to_string();
    assert!(text.contains("on the GPU, as asked: aba 0.0"), "{text}");
    // Thirty bodies are faster on any processor, its own driver's included.
    let chosen = Simulation::on(&device.where_faster(), model).unwrap();
    let choice = *chosen.choice();
    assert!(!choice.on_gpu && !choice.forced, "{choice}");
    assert!(choice.gpu_s.unwrap() > choice.aba_s, "{choice}");
    assert!(
        choice.to_string().contains("a step on the GPU 0.0"),
        "{choice}"
    );
}

/// What a GPU does not do is refused, and changes nothing.
#[test]
fn refusals_leave_the_state() {
    let Some(device) = gpu() else { return };
    let (model, state, _) = problem(3);
    let on = || {
        let mut simulation = Simulation::on(&device, model.clone()).unwrap();
        simulation.set_state(state.clone()).unwrap();
        simulation
    };
    let mut midpoint = on().with_integrator(Integrator::ImplicitMidpoint);
    assert!(matches!(
        midpoint.step(1e-3),
        Err(Error::IntegratorUnavailable { .. })
    ));
    assert_eq!(midpoint.time(), state.time);
    let mut midpoint = midpoint.with_integrator(Integrator::RungeKutta4);
    midpoint.step(1e-3).unwrap();
    let recursion = SolverOptions {
        algorithm: Some(Algorithm::Aba),
        ..SolverOptions::default()
    };
    let refused = on().with_solver(&recursion).unwrap_err();
    assert!(
        matches!(refused, Error::UnavailableOnGpu { .. }),
        "{refused}"
    );
    let refused = on().with_solver(&SolverOptions::to_tolerance(0.0));
    assert!(matches!(refused, Err(Error::ToleranceRange { .. })));
}

/// A step that is no number is refused before anything is computed, a check that is due included.
#[test]
fn a_step_that_is_no_number_is_not_begun() {
    let (model, state, _) = problem(4);
    let damped = Joint::revolute(DVec3::X).with_damping(0.1);
    let rod = MassProperties::rod(1.0, 1.0, 0.05);
    let damped = ModelDescription::new("damped").body("rod", None, damped, rod);
    let damped = damped.build().unwrap();
    for device in devices() {
        for (model, state) in [(&model, &state), (&damped, &State::neutral(&damped))] {
            let simulation = Simulation::on(&device, model.clone()).unwrap();
            let mut simulation = simulation.with_monitor(Monitor::every(1, 1e-12)).unwrap();
            simulation.set_state(state.clone()).unwrap();
            for h in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let refused = simulation.steps(h, 2);
                assert!(matches!(refused, Err(Error::NonFiniteInput { .. })));
            }
            assert_eq!(simulation.monitor().unwrap().checks(), 0);
            assert_eq!(simulation.state().unwrap(), state);
            if let Some(gpu) = device.gpu() {
                let options = vertebra_dynamics::gpu::Options::default();
                let mut alone =
                    vertebra_dynamics::gpu::Simulation::on(gpu, model, &options).unwrap();
                let refused = alone.steps(f64::NAN, 2);
                assert!(matches!(refused, Err(Error::NonFiniteInput { .. })));
            }
        }
    }
}

/// A failing step is told alike: which of how many, why, and the state before it stays.
#[test]
fn failing_steps_are_told_alike() {
    let model = generate::random_chain(20, &Rod::default(), 1).unwrap();
    for device in devices() {
        let mut simulation = Simulation::on(&device, model.clone()).unwrap();
        let mut state = State::random(&model, 2);
        state.qd.fill(1e150);
        if !has_f64(&device) {
            state.qd.fill(1e30);
        }
        simulation.set_state(state).unwrap();
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
        assert_eq!(simulation.time(), 1e9 * *step as f64);
        let kept = simulation.state().unwrap();
        assert!(kept.q.iter().chain(&kept.qd).all(|x| x.is_finite()));
        let alone = simulation.step(1e9).unwrap_err();
        assert!(matches!(alone, Error::Overflow { .. }), "{alone}");
        let endless = simulation.steps(f64::NAN, 3);
        assert!(matches!(endless, Err(Error::NonFiniteInput { .. })));
        simulation.forces_mut().joint[3] = f64::NAN;
        let pushed = simulation.steps(1e-3, 3);
        assert!(matches!(pushed, Err(Error::NonFiniteInput { .. })));
        simulation.forces_mut().joint[3] = 0.0;
        simulation.set_state(State::random(&model, 3)).unwrap();
        simulation.steps(1e-3, 3).unwrap();
    }
}

/// A model that is too large is told with the limit and with a size that fits indeed.
#[test]
fn a_model_too_large_tells_what_fits() {
    if tests_are_left_out() {
        return;
    }
    const LIMIT: u64 = 1 << 18;
    let small = Options {
        limits: Limits {
            max_storage_buffer_binding_size: LIMIT,
            max_storage_buffers_per_shader_stage: 10,
            max_compute_workgroup_storage_size: 32 << 10,
            ..Limits::default()
        },
        exact_limits: true,
        ..Options::default()
    };
    let device = Device::from(vertebra_gpu::Device::open(small).unwrap());
    let chain = |count| generate::random_chain(count, &Rod::default(), 1).unwrap();
    let error = Simulation::on(&device, chain(3000)).unwrap_err();
    let Error::ModelTooLarge {
        bodies: 3000,
        what: "bodies",
        fit,
        limit: "max_storage_buffer_binding_size",
        available: LIMIT,
    } = error
    else {
        unreachable!("{error}");
    };
    let mut fitting = Simulation::on(&device, chain(fit)).unwrap();
    fitting.step(1e-5).unwrap();
    let refused = Simulation::on(&device, chain(fit + fit / 4));
    assert!(matches!(refused, Err(Error::ModelTooLarge { .. })));
    // Tied to the world by every fourth link, a chain needs more for its loops than for itself.
    let tied = |count| {
        let mut description = chain(count).describe();
        for link in (0..count).step_by(4) {
            let (name, body) = (format!("tie-{link}"), format!("body-{link}"));
            let ends = [Some(body.as_str()), None];
            description = description.close(name, ends, [Pose::IDENTITY; 2], Closure::Ball);
        }
        description.build().unwrap()
    };
    let error = Simulation::on(&device, tied(400)).unwrap_err();
    let Error::ModelTooLarge {
        bodies: 400,
        what: "closed loops",
        fit,
        ..
    } = error
    else {
        unreachable!("{error}");
    };
    assert!(fit > 8 && error.to_string().contains("for its closed loops"));
    Simulation::on(&device, tied(fit)).unwrap();
}

/// A device lost under way is an error, and the state that was read last is left.
#[test]
fn a_lost_device_leaves_the_last_state() {
    let Some(device) = gpu() else { return };
    let lost = device.gpu().unwrap().reopen().unwrap();
    let model = generate::random_chain(5, &Rod::default(), 1).unwrap();
    let mut simulation = Simulation::on(&lost.clone().into(), model).unwrap();
    simulation.steps(1e-4, 2).unwrap();
    let read = simulation.state().unwrap().clone();
    lost.raw().0.destroy();
    let is_lost =
        |error: Error| matches!(error, Error::Gpu(vertebra_gpu::Error::DeviceLost { .. }));
    assert!(is_lost(simulation.steps(1e-4, 2).unwrap_err()));
    assert!(is_lost(simulation.state().unwrap_err()));
    assert_eq!(*simulation.last_state(), read);
}
