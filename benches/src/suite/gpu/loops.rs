//! Mechanisms with closed loops on a device: accelerations and steps against the CPU, how far open loops are left, and
//! a loop that cannot be closed.

use super::dynamics::precisions;
use super::{holds, is_software};
use crate::scenario::loops::{STEP, mechanisms, side_by_side};
use crate::suite::driven::{self, closed, moved, works};
use crate::suite::{Figure, Outcome, relative_error, worst_of};
use vertebra::dynamics::gpu::Options;
use vertebra::{
    Error, Forces, Integrator, Model, Pose, Precision, Simulation, Solver, SolverOptions, Spring,
    State, glam::DVec3, mechanism,
};
use vertebra_gpu::Device;

/// Copies of a linkage that are moved together on hardware.
const MANY: usize = 2000;

/// Steps of a Stewart platform that nothing holds: after 1354 its slides, which have no end, have made the legs a thousand
/// times as long as thick, and f32 refuses them, on the CPU too (`docs/loops.md`).
const FALLING: usize = 800;

/// Accelerations, whole steps of both integrators and the violation after them, in all precisions.
pub(super) fn loops(device: &Device) -> Outcome {
    let mut figures = Vec::new();
    let mut subjects = mechanisms()?;
    if is_software(device) {
        // Which takes minutes to compile kernels for elements in trees.
        subjects.retain(|(model, _)| model.first_element().is_none());
    }
    let (model, start) = &subjects[0];
    let copies = if is_software(device) { 20 } else { MANY };
    subjects.push(side_by_side(model, start, copies)?);
    let further = if is_software(device) { 16 } else { 1600 };
    let mut subjects: Vec<(Model, State, usize)> = (subjects.into_iter())
        .map(|(model, start)| (model, start, further))
        .collect();
    let (model, start) = mechanism::stewart_platform()?;
    subjects.push((model, start, further.min(FALLING)));
    for (chunks, tree, _) in precisions(device) {
        let options = Options {
            chunks: Some(chunks),
            tree: Some(tree),
            ..Options::default()
        };
        // Loops spread what is rounded by their compliances, redundant ones by 1 / mu in f32.
        let (spread, open) = match chunks {
            Precision::F32 => (1e5, 1e-4),
            _ => (1e4, 1e-9),
        };
        let bound = spread * tree.epsilon();
        // Software takes seconds to compile for each: all of them in f64, one in other precisions.
        let count = match is_software(device) && tree != Precision::F64 {
            true => 1,
            false => subjects.len(),
        };
        for (model, start, further) in &subjects[..count] {
            let name = |what: &str| format!("{what}, {}, {chunks} over {tree}", model.name());
            let error = accelerations(device, model, start, &options)?;
            figures.push(Figure::new(name("accelerations"), error, bound));
            for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
                let options = Options {
                    integrator,
                    ..options
                };
                let (error, violation) = steps(device, (model, start), *further, &options)?;
                let name = |what: &str| format!("{}, {integrator:?}", name(what));
                figures.push(Figure::new(name("rates"), error, bound));
                figures.push(Figure::new(name("violation"), violation, open));
            }
        }
    }
    figures.push(refusal(device)?);
    Ok(figures)
}

/// Largest error of accelerations.
fn accelerations(
    device: &Device,
    model: &Model,
    start: &State,
    options: &Options,
) -> anyhow::Result<f64> {
    let forces = Forces::none(model);
    let mut solver = Solver::new(model, &SolverOptions::default())?;
    let exact = solver.forward_dynamics(model, start, &forces)?;
    let mut simulation = vertebra::dynamics::gpu::Simulation::on(device, model, options)?;
    simulation.set_state(start)?;
    Ok(relative_error(&simulation.accelerations()?, exact))
}

/// Error of rates after a few steps, and the violation after more.
fn steps(
    device: &Device,
    (model, start): (&Model, &State),
    further: usize,
    options: &Options,
) -> anyhow::Result<(f64, f64)> {
    let mut cpu = Simulation::new(model.clone())?.with_integrator(options.integrator);
    let mut gpu = Simulation::on_gpu(device, model.clone(), options)?;
    for simulation in [&mut cpu, &mut gpu] {
        simulation.set_state(start.clone())?;
        simulation.steps(STEP, 18)?;
    }
    let error = relative_error(&gpu.state()?.qd, &cpu.state()?.qd);
    gpu.steps(STEP, further)?;
    let found = gpu.loop_violation()?;
    let violation = found.map_or(f64::NAN, |found| found.position);
    Ok((error, worst_of(violation, 0.0)))
}

/// A coupler that is too short to reach: an error that names the loop, and the state is kept.
fn refusal(device: &Device) -> anyhow::Result<Figure> {
    let (model, start) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4)?;
    let mut description = model.describe();
    for closed in &mut description.loops {
        closed.placements[0] = Pose::from_translation(DVec3::NEG_Z * 5.0);
    }
    let mut simulation = Simulation::on_gpu(device, description.build()?, &Options::default())?;
    simulation.set_state(start.clone())?;
    let refused = simulation.step(STEP);
    let is_named = matches!(&refused, Err(Error::LoopOpen { name, .. }) if name == "pin");
    let is_kept = simulation.state()? == &start;
    Ok(holds(format!("refused: {refused:?}"), is_named && is_kept))
}

/// Steps that are taken between two looks at what is open.
const LOOK: usize = 16;

/// Loops stay closed to 1e-4 of their size all in f32, to 1e-8 in f64, whenever one looks: a thousand steps of two linkages here;
/// on hardware of all mechanisms as many as the processor takes, a tenth of them in f64.
pub(super) fn violations(device: &Device) -> Outcome {
    // A tenth for larger ones, for the time's sake.
    let steps_of = |model: &Model| match model.bodies().len() {
        ..=8 => 100_000,
        _ => 10_000,
    };
    let mut figures = Vec::new();
    if is_software(device) {
        for (model, start) in [
            mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4)?,
            mechanism::bennett()?,
        ] {
            let moving = (&model, start);
            figures.push(stays_closed(device, moving, Precision::F32, 63 * LOOK)?);
        }
        return Ok(figures);
    }
    for (model, start) in mechanisms()? {
        let steps = steps_of(&model);
        let moving = (&model, start.clone());
        figures.push(stays_closed(device, moving, Precision::F32, steps)?);
        let moving = (&model, start);
        figures.push(stays_closed(device, moving, Precision::F64, steps / 10)?);
    }
    Ok(figures)
}

/// The largest violation that is seen in so many steps, looking after every [`LOOK`].
fn stays_closed(
    device: &Device,
    (model, start): (&Model, State),
    precision: Precision,
    steps: usize,
) -> anyhow::Result<Figure> {
    let options = Options {
        chunks: Some(precision),
        tree: Some(precision),
        ..Options::default()
    };
    let mut simulation = Simulation::on_gpu(device, model.clone(), &options)?;
    simulation.set_state(start)?;
    let mut worst = 0.0_f64;
    for _ in 0..steps / LOOK {
        simulation.steps(STEP, LOOK)?;
        let found = simulation.loop_violation()?;
        worst = worst_of(worst, found.map_or(f64::NAN, |found| found.position));
    }
    Ok(Figure::new(
        format!("{} {precision}, {steps} steps", model.name()),
        worst,
        if precision == Precision::F32 {
            1e-4
        } else {
            1e-8
        },
    ))
}

/// Random mechanisms of all joints, closures and elements; for software, which takes minutes to compile kernels for elements
/// in trees, a linkage with some.
fn loaded_mechanisms(device: &Device) -> anyhow::Result<Vec<(Model, State)>> {
    if !is_software(device) {
        return driven::mechanisms(9);
    }
    let (model, state) = mechanism::bennett()?;
    let mut description = model.describe();
    for body in &mut description.bodies {
        let joint = body.joint.clone().with_spring(Spring::at(2.0, 0.1));
        body.joint = joint
            .with_damping(0.1)
            .with_friction(0.05)
            .with_armature(0.01);
    }
    Ok(vec![closed((description.build()?, state))?])
}

/// What acts between loops, motors among it, ends steps as on the CPU, with the same work.
pub(super) fn loaded(device: &Device) -> Outcome {
    let mut figures = Vec::new();
    for (index, (model, state)) in loaded_mechanisms(device)?.into_iter().enumerate() {
        let (expected, work, _) = moved(&mut Simulation::new(model.clone())?, &state)?;
        for (chunks, tree, _) in precisions(device) {
            if tree != Precision::F64 && is_software(device) {
                continue;
            }
            let options = Options {
                chunks: Some(chunks),
                tree: Some(tree),
                ..Options::default()
            };
            let name = |what| format!("loaded loops {index}, {what}, {chunks} over {tree}");
            if !is_software(device) {
                let mut still = Simulation::on_gpu(device, model.clone(), &options)?;
                still.set_state(state.clone())?;
                still.steps(STEP, 100)?;
                let left = still.loop_violation()?;
                let left = left.map_or(f64::NAN, |found| found.position);
                let open = if chunks == Precision::F32 { 1e-4 } else { 1e-9 };
                figures.push(Figure::new(name("violation"), worst_of(left, 0.0), open));
            }
            // In f32 joints take other sides of their laws.
            if tree == Precision::F64 {
                let mut gpu = Simulation::on_gpu(device, model.clone(), &options)?;
                let (found, done, _) = moved(&mut gpu, &state)?;
                let rates = relative_error(&found.qd, &expected.qd);
                figures.push(Figure::new(name("rates"), rates, 1e-5));
                let error = relative_error(&works(&done), &works(&work));
                figures.push(Figure::new(name("work"), error, 1e-5));
            }
        }
    }
    Ok(figures)
}
