//! How exact a GPU is asked to be: precisions, corrections, tolerances, checks.

use super::{gpu, has_f64, problem};
use glam::DVec3;
use std::ops::ControlFlow;
use vertebra_assembly::generate::{self, Rod};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{Joint, MassProperties, Model, ModelDescription, State};
use vertebra_dynamics::{
    Device, Error, Forces, Monitor, Precision, Simulation, SolverOptions, Workspace, aba,
};
use vertebra_gpu::Options;
use vertebra_gpu::wgpu::Features;
use vertebra_spatial::Pose;

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
        tree: asked.tree,
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

/// Joins on a GPU are as precise as chunks, or as was asked, which another precision of all else leaves.
#[test]
fn another_precision_leaves_the_joins() {
    use Precision::{F32, F64};
    let Some(device) = gpu().filter(has_f64) else {
        return;
    };
    let model = generate::random_chain(8, &Rod::default(), 1).unwrap();
    let gpu = device.gpu().unwrap();
    let on = |tree| {
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
    for (asked, joins) in [(None, F64), (Some(F32), F32), (Some(F64), F64)] {
        assert_eq!(precisions(&on(asked)), (F64, joins));
        let same = on(asked).with_precision(F64).unwrap();
        assert_eq!(precisions(&same), (F64, joins), "{asked:?}");
    }
    for (asked, joins) in [(None, F64), (Some(F32), F32)] {
        let single = on(asked).with_precision(F32).unwrap();
        assert_eq!(precisions(&single), (F32, F32));
        let again = single.with_precision(F64).unwrap();
        assert_eq!(precisions(&again), (F64, joins), "{asked:?}");
    }
    let finer = on(Some(F64)).with_precision(F32);
    assert!(matches!(finer, Err(Error::TreePrecision { .. })));
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
            tree: Some(Precision::F32),
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
