//! What acts in joints on a device, against the CPU: inertia of freedoms' own on joints of every kind, and steps
//! with springs, dampers, friction, stops and motors.

use super::dynamics::{options, precisions};
use super::is_software;
use crate::suite::driven::{STEP, moved, works};
use crate::suite::{Figure, Outcome, relative_error, worst_of};
use anyhow::Context;
use vertebra::dynamics::gpu::{Batch, BatchOptions, Options};
use vertebra::generate::{self, Masses, Rod};
use vertebra::{
    DcaOptions, DcaWorkspace, Elements, Forces, Integrator, Model, Motor, Precision, Random,
    Simulation, State, Workspace, aba, dca,
};
use vertebra_gpu::Device;

/// Mechanisms of all joints and elements; the largest for hardware, as software takes minutes to compile for any.
fn mechanisms(device: &Device) -> anyhow::Result<Vec<Model>> {
    let sizes: &[usize] = if is_software(device) {
        &[40]
    } else {
        &[3, 40, 300]
    };
    let numbered = sizes.iter().zip(1..);
    let models = numbered.map(|(&count, seed)| generate::random_mechanism(count, true, seed));
    Ok(models.collect::<Result<_, _>>()?)
}

/// Joints of a chunk: in fewer, a heavy end drowns light bodies whatever is corrected.
const WINDOW: usize = 8;

/// Accelerations where freedoms have inertia of their own over decades, and corrected ones.
pub(super) fn inertia(device: &Device) -> Outcome {
    let mut models = mechanisms(device)?;
    let tips = Masses::HeavyTips(1e8);
    models.push(generate::uneven_tree(60, 1, &Rod::default(), &tips, 5)?);
    let mut figures = Vec::new();
    for model in models {
        let mut random = Random::new(7);
        let state = State::random(&model, 7);
        let mut forces = Forces::none(&model);
        forces.joint.fill_with(|| random.symmetric());
        let own = (0..model.dof_count()).map(|_| match random.below(3) {
            0 => 0.0,
            decade => 10_f64.powf(2.0 * random.symmetric() - decade as f64),
        });
        forces.joint_inertia = own.collect();
        // And all that elements do in a step, which binds the freedoms of spherical joints.
        let mut elements = Elements::new(&model);
        let forces = elements.load(&state, &forces, STEP)?;
        let mut reference = Workspace::new(&model, Precision::Reference);
        let exact = aba(&model, &state, forces, &mut reference)?.to_vec();
        for (chunks, tree, _) in precisions(device) {
            // Software takes minutes to compile kernels for all joints: of those there is one, of hinges all.
            if is_software(device) && model.first_element().is_some() && tree != Precision::F64 {
                continue;
            }
            let is_mixed = chunks != tree;
            let sweeps: &[usize] = if is_mixed { &[0, 2] } else { &[0] };
            for &sweeps in sweeps {
                let options = Options {
                    sweeps,
                    ..options(chunks, tree, WINDOW)
                };
                let bare = model.bare();
                let mut simulation =
                    vertebra::dynamics::gpu::Simulation::on(device, &bare, &options)?;
                simulation.set_state(&state)?;
                simulation.set_forces(forces)?;
                let found = simulation.accelerations()?;
                let bodies = model.bodies().len();
                let name = format!("{bodies} bodies, {chunks} over {tree}, {sweeps} corrections");
                // The same digits as on the CPU, where corrected joins are as good as those in f64.
                let tree = if sweeps > 0 { chunks } else { tree };
                let twin = DcaOptions {
                    chunks,
                    tree,
                    schedule: options.schedule,
                    parallel: false,
                };
                let mut twin = DcaWorkspace::new(&model, &twin)?;
                let twin = relative_error(dca(&model, &state, forces, &mut twin)?, &exact);
                let bound = 16.0 * twin + 256.0 * tree.epsilon();
                figures.push(Figure::new(name, relative_error(&found, &exact), bound));
            }
        }
    }
    Ok(figures)
}

/// Steps end as the CPU's do, with the same work, and energy balances as far as there.
pub(super) fn steps(device: &Device) -> Outcome {
    let mut figures = Vec::new();
    for model in mechanisms(device)? {
        let mut state = State::neutral(&model);
        state.qd.copy_from_slice(&State::random(&model, 4).qd);
        let (expected, work, off) = moved(&mut Simulation::new(model.clone())?, &state)?;
        for (chunks, tree, _) in precisions(device) {
            if tree == Precision::F32 && is_software(device) {
                continue;
            }
            let options = options(chunks, tree, 4);
            let mut gpu = Simulation::on_gpu(device, model.clone(), &options)?;
            let (found, done, gpu_off) = moved(&mut gpu, &state)?;
            let bodies = model.bodies().len();
            let name = |what| format!("{bodies} bodies, {what}, {chunks} over {tree}");
            let largest = works(&work).into_iter().map(f64::abs).fold(0.0, worst_of);
            if tree == Precision::F64 {
                // Hard stops are met to the root of rounding, and what differs grows with the steps.
                let rates = relative_error(&found.qd, &expected.qd);
                figures.push(Figure::new(name("rates"), rates, 1e-5));
                let works = relative_error(&works(&done), &works(&work));
                figures.push(Figure::new(name("work"), works, 1e-5));
            }
            // In f32 motions part, but energy balances.
            let moving = Simulation::new(model.clone()).and_then(|mut simulation| {
                simulation.set_state(state.clone())?;
                Ok(simulation.mechanics()?.kinetic_energy)
            })?;
            let rounding = 32.0 * tree.epsilon().sqrt() * worst_of(largest, moving);
            let balance = Figure::new(name("energy"), gpu_off.abs(), 4.0 * off.abs() + rounding);
            figures.push(balance);
        }
    }
    Ok(figures)
}

/// A batch goes by divide and conquer, and its items as each alone on the CPU.
pub(super) fn batches(device: &Device) -> Outcome {
    const ITEMS: usize = 8;
    let model = generate::random_mechanism(20, true, 2)?;
    let mut figures = Vec::new();
    for (precision, tree, _) in precisions(device) {
        if precision != Precision::F64 || tree != precision {
            continue;
        }
        let options = BatchOptions {
            precision,
            ..BatchOptions::default()
        };
        let mut batch = Batch::new(device, &model, ITEMS, &options)?;
        let mut states = vec![State::neutral(&model); ITEMS];
        for (seed, state) in (0..).zip(&mut states) {
            state.qd.copy_from_slice(&State::random(&model, seed).qd);
        }
        batch.set_states(&states)?;
        let freedoms = model.body_ids().zip(model.bodies());
        let mut driven = freedoms.filter(|(_, body)| body.dof_range().len() == 1);
        let (body, _) = driven.next().context("no joint has one freedom")?;
        let motor = |item: usize| Motor::position(0.1 * item as f64, 20.0, 0.5).limited(1.0);
        for item in 0..ITEMS {
            batch.set_motor(item, body, motor(item))?;
        }
        batch.steps(STEP, 20)?;
        let mut worst = 0.0_f64;
        for (item, found) in batch.states()?.iter().enumerate() {
            let mut alone = Simulation::new(model.clone())?;
            alone.set_state(states[item].clone())?;
            alone.set_motor(body, motor(item))?;
            alone.steps(STEP, 20)?;
            worst = worst_of(worst, relative_error(&found.qd, &alone.state()?.qd));
        }
        let name = format!("{ITEMS} mechanisms in {precision}, {}", batch.choice());
        figures.push(Figure::new(name, worst, 1e-6));
    }
    Ok(figures)
}

/// The classical Runge-Kutta method takes elements as forces.
pub(super) fn smooth_steps(device: &Device) -> Outcome {
    let mut figures = Vec::new();
    for model in mechanisms(device)? {
        let mut description = model.describe();
        for body in &mut description.bodies {
            body.joint.friction = 0.0;
            body.joint.limits = None;
        }
        let model = description.build()?;
        let state = State::random(&model, 5);
        let mut cpu = Simulation::new(model.clone())?.with_integrator(Integrator::RungeKutta4);
        let (expected, work, _) = moved(&mut cpu, &state)?;
        for (chunks, tree, _) in precisions(device) {
            if tree != Precision::F64 {
                continue;
            }
            let options = Options {
                integrator: Integrator::RungeKutta4,
                ..options(chunks, tree, 4)
            };
            let mut gpu = Simulation::on_gpu(device, model.clone(), &options)?;
            let (found, done, _) = moved(&mut gpu, &state)?;
            let name = |what| format!("{} bodies, {what}", model.bodies().len());
            let rates = relative_error(&found.qd, &expected.qd);
            figures.push(Figure::new(name("rates"), rates, 1e-7));
            let motors = relative_error(&[done.total()], &[work.total()]);
            figures.push(Figure::new(name("work"), motors, 1e-7));
        }
    }
    Ok(figures)
}
