//! One simulation on every device: the same verbs, the same answers, and refusals that say what to do.

#![cfg(feature = "gpu")]
#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

use glam::DVec3;
use std::ops::ControlFlow;
use std::sync::OnceLock;
use vertebra_assembly::generate::{self, RandomTree, Rod};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{Closure, Joint, MassProperties, Model, ModelDescription, Random, State};
use vertebra_dynamics::gpu::PoseBuffer;
use vertebra_dynamics::{
    Algorithm, Device, Error, Forces, Integrator, Monitor, Precision, Simulation, SolverOptions,
    Workspace, Wrench, aba,
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
                .with_solver(&SolverOptions::default())
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

/// A solver's corrections are those that a GPU is asked for by its own options, and are made.
#[test]
fn a_gpu_corrects_as_often_as_asked() {
    let Some(device) = gpu() else { return };
    let (model, state, _) = problem(3);
    let asked = SolverOptions {
        tree: Some(Precision::F32),
        sweeps: 1,
        ..SolverOptions::default()
    };
    let own = |sweeps| vertebra_dynamics::gpu::Options {
        sweeps,
        ..Default::default()
    };
    let solved = |mut simulation: Simulation| {
        simulation.set_state(state.clone()).unwrap();
        simulation.accelerations().unwrap()
    };
    let solver = Simulation::on(&device, model.clone()).unwrap();
    let solver = match solver.with_solver(&asked) {
        Err(Error::PrecisionUnavailable { .. }) => return,
        made => made.unwrap(),
    };
    let gpu = device.gpu().unwrap();
    let by_device = |sweeps| Simulation::on_gpu(gpu, model.clone(), &own(sweeps)).unwrap();
    let corrected = solved(solver);
    assert_eq!(corrected, solved(by_device(1)));
    assert_ne!(corrected, solved(by_device(0)));
}

/// Another precision on a GPU leaves the joins as they were chosen: by its own rule where nobody said, else as asked.
#[test]
fn another_precision_leaves_the_joins() {
    use Precision::{F32, F64};
    let Some(device) = gpu().filter(has_f64) else {
        return;
    };
    let even = generate::random_chain(8, &Rod::default(), 1).unwrap();
    let masses = generate::Masses::HeavyLast(1e6);
    let uneven = generate::uneven_tree(8, 1, &Rod::default(), &masses, 1).unwrap();
    let gpu = device.gpu().unwrap();
    let on = |model: &Model, tree| {
        let options = vertebra_dynamics::gpu::Options {
            tree,
            ..Default::default()
        };
        Simulation::on_gpu(gpu, model.clone(), &options).unwrap()
    };
    let precisions = |simulation: &Simulation| {
        let choice = simulation.choice();
        (choice.precision, choice.tree)
    };
    for (model, asked, joins) in [
        (&even, None, F32),
        (&uneven, None, F64),
        (&even, Some(F64), F64),
    ] {
        let same = on(model, asked).with_precision(F64).unwrap();
        assert_eq!(precisions(&same), (F64, joins), "{asked:?}");
    }
    for model in [&even, &uneven] {
        let single = on(model, None).with_precision(F32).unwrap();
        assert_eq!(precisions(&single), (F32, F32));
        let again = single.with_precision(F64).unwrap();
        assert_eq!(precisions(&again), precisions(&on(model, None)));
    }
    let finer = on(&even, Some(F64)).with_precision(F32);
    assert!(matches!(finer, Err(Error::TreePrecision { .. })));
    // Of a solver they are as precise as all else, unless it is asked for others.
    let solver = SolverOptions::default();
    let all = on(&even, None).with_solver(&solver).unwrap();
    assert_eq!(precisions(&all), (F64, F64));
    let all = all.with_precision(F32).unwrap();
    assert_eq!(precisions(&all), (F32, F32));
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

/// Checks on a GPU find the error there is, change nothing, and end a run where they are told to.
#[test]
fn errors_are_watched_on_a_gpu() {
    let Some(device) = gpu() else { return };
    let model = generate::random_chain(40, &Rod::default(), 2).unwrap();
    let on = || {
        let simulation = Simulation::on(&device, model.clone()).unwrap();
        let mut simulation = simulation.with_precision(Precision::F32).unwrap();
        simulation.set_state(State::random(&model, 3)).unwrap();
        simulation
    };
    let mut plain = on();
    let exact = reference(&model, plain.state().unwrap());
    let largest = exact.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let errors = plain.accelerations().unwrap().into_iter().zip(&exact);
    let error = errors.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / largest;
    plain.steps(1e-4, 25).unwrap();
    let mut watched = on().with_monitor(Monitor::every(10, 1e-8)).unwrap();
    watched.steps(1e-4, 3).unwrap();
    let first = *watched.monitor().unwrap().latest().unwrap();
    assert_eq!((first.step, first.time), (0, 0.0));
    // The state on the device is rounded to f32, which is no error of the solution.
    let found = first.found.change;
    assert!(
        found > 0.02 * error && found < 50.0 * error,
        "{found:e} of {error:e}"
    );
    watched.steps(1e-4, 22).unwrap();
    assert_eq!(plain.state().unwrap(), watched.state().unwrap());
    let monitor = watched.monitor().unwrap();
    assert_eq!((monitor.checks(), monitor.exceeded()), (3, 3));
    assert_eq!(monitor.latest().unwrap().step, 20);
    let mut calls = 0;
    let ends_at_third = Monitor::every(5, 1e-8).on_exceeded(move |_| {
        calls += 1;
        if calls < 3 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    let mut ended = on().with_monitor(ends_at_third).unwrap();
    let error = ended.steps(1e-4, 25).unwrap_err();
    let Error::Step {
        step: 10,
        count: 25,
        source,
    } = &error
    else {
        panic!("{error:?}");
    };
    assert!(matches!(**source, Error::Inexact { .. }), "{error}");
    assert!((ended.time() - 1e-3).abs() < 1e-12);
    let mut ten = on();
    ten.steps(1e-4, 10).unwrap();
    assert_eq!(ten.state().unwrap().q, ended.state().unwrap().q);
}

fn reference(model: &Model, state: &State) -> Vec<f64> {
    let mut workspace = Workspace::new(model, Precision::Reference);
    let exact = aba(model, state, &Forces::none(model), &mut workspace).unwrap();
    exact.to_vec()
}

/// A GPU takes what meets a tolerance, from the cheapest on, and leaves to the processor what it cannot meet.
#[test]
fn a_tolerance_is_met_on_a_gpu() {
    let Some(device) = gpu().filter(has_f64) else {
        return;
    };
    let masses = generate::Masses::HeavyLast(1e8);
    let even = generate::random_chain(60, &Rod::default(), 2).unwrap();
    let heavy = generate::uneven_tree(60, 1, &Rod::default(), &masses, 5).unwrap();
    for (model, tolerance, on_gpu, sweeps) in [
        (&even, 1e-3, true, 0),
        (&even, 1e-9, true, 0),
        // Chunks of four lose eight digits beside the tip, which a correction brings back.
        (&heavy, 1e-12, true, 1),
        (&even, 1e-14, false, 0),
    ] {
        let options = vertebra_dynamics::gpu::Options {
            schedule: Some(ScheduleOptions::with_window(4)),
            ..Default::default()
        };
        let gpu = device.gpu().unwrap();
        let mut simulation = (Simulation::on_gpu(gpu, model.clone(), &options).unwrap())
            .with_solver(&SolverOptions::to_tolerance(tolerance))
            .unwrap();
        let state = State::random(model, 3);
        simulation.set_state(state.clone()).unwrap();
        let found = simulation.accelerations().unwrap();
        let exact = reference(model, &state);
        let largest = exact.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let errors = found.iter().zip(&exact).map(|(a, b)| (a - b).abs());
        let error = errors.fold(0.0, f64::max) / largest;
        // In f32 the state is rounded first.
        assert!(error <= tolerance, "{tolerance:e}: {error:e}");
        let achieved = *simulation.achieved().unwrap();
        assert!(achieved.error <= tolerance, "{tolerance:e}: {achieved}");
        assert_eq!(simulation.choice().on_gpu, on_gpu, "{achieved}");
        if on_gpu {
            assert_eq!(achieved.sweeps, sweeps, "{achieved}");
        }
        // Beyond the next measurement; programs of steps take long to compile on a processor.
        if sweeps == 1 {
            simulation.steps(1e-5, 65).unwrap();
            assert!((simulation.time() - 65e-5).abs() < 1e-12);
            assert!(simulation.achieved().unwrap().error <= tolerance);
        }
    }
}

/// On adapters without f64 the processor meets what f32 cannot, and what it can stays on the GPU.
#[test]
fn a_tolerance_is_met_without_f64() {
    if gpu().is_none() {
        return;
    }
    let plain = Options {
        wanted: Features::empty(),
        ..Options::default()
    };
    let device: Device = vertebra_gpu::Device::open(plain).unwrap().into();
    let model = generate::random_chain(12, &Rod::default(), 2).unwrap();
    let state = State::random(&model, 3);
    let exact = reference(&model, &state);
    let largest = exact.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (tolerance, on_gpu) in [(1e-3, true), (1e-9, false)] {
        let simulation = Simulation::on(&device, model.clone()).unwrap();
        let mut simulation = simulation
            .with_solver(&SolverOptions::to_tolerance(tolerance))
            .unwrap();
        simulation.set_state(state.clone()).unwrap();
        let found = simulation.accelerations().unwrap();
        let errors = found.iter().zip(&exact).map(|(a, b)| (a - b).abs());
        let error = errors.fold(0.0, f64::max) / largest;
        assert!(error <= tolerance, "{tolerance:e}: {error:e}");
        assert_eq!(simulation.choice().on_gpu, on_gpu);
        assert!(simulation.achieved().unwrap().error <= tolerance);
    }
}

/// A state in which the device is no longer so exact goes on on the processor, without a step lost.
#[test]
fn what_a_gpu_cannot_meet_goes_on_on_the_processor() {
    let Some(device) = gpu().filter(has_f64) else {
        return;
    };
    // Thin rods, every other one about itself: what turns them is rounded off beside the other moments.
    let mut description = ModelDescription::new("spinning");
    let name = |index: usize| format!("rod {index}");
    for index in 0..20_usize {
        let axis = if index % 2 == 0 { DVec3::X } else { DVec3::Z };
        let at = DVec3::Z * if index == 0 { 0.0 } else { 1.0 };
        let joint = Joint::revolute(axis).at(Pose::from_translation(at));
        let parent = index.checked_sub(1).map(name);
        let mass = MassProperties::rod(1.0, 1.0, 1e-4);
        description = description.body(name(index), parent.as_deref(), joint, mass);
    }
    let model = description.build().unwrap();
    let state = State::random(&model, 5);
    let tolerance = SolverOptions::to_tolerance(1e-12);
    let run = |device: &Device| {
        let simulation = Simulation::on(device, model.clone()).unwrap();
        let mut simulation = simulation.with_solver(&tolerance).unwrap();
        simulation.set_state(state.clone()).unwrap();
        simulation.steps(1e-5, 5).unwrap();
        simulation
    };
    let (mut there, mut here) = (run(&device), run(&Device::cpu()));
    assert!(!there.choice().on_gpu, "{}", there.choice());
    assert_eq!(there.state().unwrap(), here.state().unwrap());
}

/// A step that a precision refuses between two measurements is taken in the next one.
#[test]
fn a_step_refused_goes_on_in_more_precision() {
    let Some(device) = gpu().filter(has_f64) else {
        return;
    };
    let model = generate::random_chain(6, &Rod::default(), 3).unwrap();
    let run = |device: &Device| {
        let simulation = Simulation::on(device, model.clone()).unwrap();
        let tolerance = SolverOptions::to_tolerance(1e-3);
        let mut simulation = simulation.with_solver(&tolerance).unwrap();
        simulation.set_state(State::random(&model, 4)).unwrap();
        simulation.steps(1e-5, 2).unwrap();
        assert_eq!(simulation.choice().precision, Precision::F32);
        // More than f32 holds, for less time than it knows.
        simulation.forces_mut().joint[2] = 1e45;
        simulation.steps(1e-46, 3).unwrap();
        assert_eq!(simulation.achieved().unwrap().precision, Precision::F64);
        simulation
    };
    let (mut there, mut here) = (run(&device), run(&Device::cpu()));
    assert!(there.choice().on_gpu, "{}", there.choice());
    let (found, expected) = (there.state().unwrap(), here.state().unwrap());
    let largest = expected.qd.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (a, b) in found.qd.iter().zip(&expected.qd) {
        assert!((a - b).abs() <= 1e-3 * largest, "{a} and {b}");
    }
}

/// What only a GPU is asked for has a door of its own: corrections of every solution.
#[test]
fn solutions_on_a_gpu_are_corrected() {
    let Some(device) = gpu().filter(has_f64) else {
        return;
    };
    let model = generate::random_chain(200, &Rod::default(), 3).unwrap();
    let state = State::random(&model, 4);
    let mut exact = Simulation::new(model.clone()).unwrap();
    exact.set_state(state.clone()).unwrap();
    exact.step(1e-4).unwrap();
    let exact = exact.state().unwrap().qd.clone();
    let error = |sweeps| {
        let options = vertebra_dynamics::gpu::Options {
            sweeps,
            ..Default::default()
        };
        let gpu = device.gpu().unwrap();
        let mut simulation = Simulation::on_gpu(gpu, model.clone(), &options).unwrap();
        simulation.set_state(state.clone()).unwrap();
        simulation.step(1e-4).unwrap();
        let off = simulation.state().unwrap().qd.iter().zip(&exact);
        off.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
    };
    let (once, plain) = (error(1), error(0));
    assert!(once < 1e-2 * plain && plain > 0.0, "{once:e} {plain:e}");
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
