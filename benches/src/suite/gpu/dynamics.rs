//! Divide and conquer on a device: against the reference over all shapes, its steps against the CPU's,
//! the same bits on each run, and what happens to a step that overflows.

use super::compare::{Compared, file_of, judge};
use super::{holds, is_software};
use crate::replay::replay;
use crate::suite::trees::own_gravity;
use crate::suite::{Figure, Outcome, relative_error, worst_of};
use anyhow::Context;
use serde::{Deserialize, Serialize};
use vertebra::dynamics::gpu::{Options, Simulation};
use vertebra::generate::{self, RandomTree, Rod};
use vertebra::schedule::ScheduleOptions;
use vertebra::{
    DcaOptions, DcaWorkspace, Error, Forces, Integrator, Model, Precision, Random, State,
    Workspace, Wrench, aba, dca,
};
use vertebra_gpu::Device;
use vertebra_gpu::capture::Capture;
use vertebra_gpu::twin::Comparison;
use vertebra_gpu::wgpu::Features;

/// Chunks and joins, and the largest error on bodies of about the same mass.
pub(super) fn precisions(device: &Device) -> Vec<(Precision, Precision, f64)> {
    let mut list = vec![(Precision::F32, Precision::F32, 1e-3)];
    if device.features().contains(Features::SHADER_F64) {
        list.push((Precision::F64, Precision::F32, 5e-5));
        list.push((Precision::F64, Precision::F64, 1e-11));
    }
    list
}

pub(super) fn options(chunks: Precision, tree: Precision, window: usize) -> Options {
    Options {
        chunks: Some(chunks),
        tree: Some(tree),
        schedule: Some(ScheduleOptions::with_window(window)),
        ..Options::default()
    }
}

/// What accelerations are computed of, on a device and on the CPU.
#[derive(Debug, Serialize, Deserialize)]
pub struct Problem {
    model: Model,
    state: State,
    forces: Forces,
    chunks: Precision,
    tree: Precision,
    window: usize,
    /// Largest error \[1\].
    bound: f64,
}

impl Problem {
    /// Name of the computation.
    pub const NAME: &str = "dca";

    /// Compares the device with the CPU's twin, in the same precisions and chunks, and with the
    /// reference.
    ///
    /// # Errors
    /// Whatever either side refuses.
    pub fn compare(&self, device: &Device) -> Compared {
        let Self { model, state, .. } = self;
        let options = options(self.chunks, self.tree, self.window);
        let mut twin = DcaWorkspace::new(
            model,
            &DcaOptions {
                chunks: self.chunks,
                tree: self.tree,
                schedule: options.schedule,
                parallel: false,
            },
        )?;
        let twin = dca(model, state, &self.forces, &mut twin)?;
        let mut reference = Workspace::new(model, Precision::Reference);
        let exact = aba(model, state, &self.forces, &mut reference)?;
        let mut simulation = Simulation::on(device, model, &options)?;
        simulation.set_state(state)?;
        simulation.set_forces(&self.forces)?;
        let found = simulation.accelerations()?;
        // Two solutions within the bound of the reference are within twice that of each other.
        let sides = [
            ("twin", twin, 2.0 * self.bound),
            ("reference", exact, self.bound),
        ];
        let compare = |(stage, cpu, bound): (&str, &[f64], f64)| {
            Comparison::new(stage, cpu.to_vec().into(), found.clone().into(), bound)
        };
        Ok((sides.map(compare).into(), Vec::new()))
    }
}

/// A random state under forces of all kinds; in a forest, the second tree under gravity of its own.
pub(super) fn inputs(model: &Model, seed: u64) -> anyhow::Result<(State, Forces)> {
    let mut random = Random::new(seed);
    let mut forces = Forces::none(model);
    forces.joint.fill_with(|| random.symmetric());
    let bodies: Vec<_> = model.body_ids().collect();
    for turn in 0..4 {
        let wrench = Wrench::at_point(random.direction() * 5.0, random.direction() * 0.1);
        let wrench = wrench.with_torque(random.direction());
        let wrench = if turn % 2 == 0 {
            wrench
        } else {
            wrench.in_body_axes()
        };
        forces.push(bodies[random.below(bodies.len())], wrench);
    }
    own_gravity(model, &mut forces)?;
    Ok((State::random(model, seed), forces))
}

/// Chains and trees of all joints, fixed and floating, forests, chunks short and long.
pub(super) fn accelerations(device: &Device) -> Outcome {
    let mut models = Vec::new();
    for count in [1, 2, 3, 33, 300] {
        let chain = generate::random_chain(count, &Rod::default(), count as u64)?;
        models.push((format!("chain of {count}"), 8, chain));
    }
    let mut seed = 0;
    for count in [5, 60, 500] {
        for (reach, window, articulations) in [(1, 8, 1), (3, 2, 2), (8, 8, 5), (count, 4, 1)] {
            seed += 1;
            let tree = RandomTree {
                count,
                reach,
                articulations,
                floating: seed % 2 == 0,
                mixed: true,
            };
            let name = format!("tree of {count}, reach {reach}, window {window}");
            models.push((name, window, generate::random_tree(&tree, seed)?));
        }
    }
    let mut figures = Vec::new();
    for (name, window, model) in models {
        let (state, forces) = inputs(&model, 7)?;
        for (chunks, tree, bound) in precisions(device) {
            let problem = Problem {
                model: model.clone(),
                state: state.clone(),
                forces: forces.clone(),
                chunks,
                tree,
                window,
                bound,
            };
            let label = format!("{name}, {chunks} over {tree}");
            let found = problem.compare(device);
            figures.extend(judge(device, Problem::NAME, &label, &problem, found)?);
        }
    }
    Ok(figures)
}

/// A result beyond its bound leaves model, state and forces in a file, which replays.
pub(super) fn captured(device: &Device) -> Outcome {
    let model = generate::random_chain(33, &Rod::default(), 1)?;
    let (state, forces) = inputs(&model, 7)?;
    let problem = Problem {
        model,
        state,
        forces,
        chunks: Precision::F32,
        tree: Precision::F32,
        window: 8,
        bound: 0.0,
    };
    let found = problem.compare(device);
    let outcome = judge(device, Problem::NAME, "exactly", &problem, found);
    let error = outcome.err().context("f32 was exact")?;
    let path = file_of(&error)?;
    let kept = Capture::read(path)?.inputs == serde_json::to_value(&problem)?;
    let agrees = replay(path, Some("twin"), 3)?;
    std::fs::remove_file(path)?;
    Ok(vec![
        holds("the file has model, state and forces", kept),
        holds("it differs again", !agrees),
    ])
}

/// Steps of both integrators, and the poses after them. A software driver takes minutes to compile all
/// kernels for all joints: there f64 has one integrator and f32 joins the other.
pub(super) fn steps(device: &Device) -> Outcome {
    let tree = RandomTree {
        count: 100,
        reach: 4,
        articulations: 2,
        floating: true,
        mixed: true,
    };
    let model = generate::random_tree(&tree, 11)?;
    let (state, forces) = inputs(&model, 12)?;
    let mut figures = Vec::new();
    for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
        let mut cpu = vertebra::Simulation::new(model.clone())?.with_integrator(integrator);
        cpu.set_state(state.clone())?;
        *cpu.forces_mut() = forces.clone();
        cpu.steps(1e-4, 18)?;
        for (chunks, tree, bound) in precisions(device) {
            let is_fine = tree == Precision::F64;
            let is_left_out = is_fine != (integrator == Integrator::RungeKutta4);
            if is_software(device) && (is_left_out || chunks == Precision::F32) {
                continue;
            }
            let options = Options {
                integrator,
                ..options(chunks, tree, 4)
            };
            let mut gpu = Simulation::on(device, &model, &options)?;
            gpu.set_state(&state)?;
            gpu.set_forces(&forces)?;
            gpu.steps(1e-4, 18)?;
            let moved = gpu.state()?;
            let name = |what| format!("{what}, {integrator:?}, {chunks} over {tree}");
            let expected = cpu.state()?.clone();
            let q = relative_error(&moved.q, &expected.q);
            figures.push(Figure::new(name("positions"), q, bound));
            let qd = relative_error(&moved.qd, &expected.qd);
            figures.push(Figure::new(name("rates"), qd, bound));
            let mut apart = 0.0_f64;
            for (body, pose) in model.body_ids().zip(gpu.poses()?) {
                let expected = cpu.pose(body)?;
                let angle = 1.0 - pose.rotation.dot(expected.rotation).abs();
                let scale = 1.0 + expected.translation.length();
                let distance = (pose.translation - expected.translation).length() / scale;
                apart = worst_of(apart, worst_of(angle, distance));
            }
            figures.push(Figure::new(name("poses"), apart, 10.0 * bound));
        }
    }
    Ok(figures)
}

/// The same steps twice, and in one call or several.
pub(super) fn same_bits(device: &Device) -> Outcome {
    let count = if is_software(device) { 300 } else { 5000 };
    let model = generate::random_tree(&RandomTree::mixed(count), 3)?;
    let (state, forces) = inputs(&model, 4)?;
    let run = |calls: &[usize]| -> anyhow::Result<State> {
        let mut simulation = Simulation::on(device, &model, &Options::default())?;
        simulation.set_state(&state)?;
        simulation.set_forces(&forces)?;
        for &count in calls {
            simulation.steps(1e-4, count)?;
        }
        Ok(simulation.state()?)
    };
    let once = run(&[20])?;
    Ok(vec![
        holds("twice", once == run(&[20])?),
        holds("in several calls", once.q == run(&[3, 16, 1])?.q),
    ])
}

/// A second of motion of a random chain from rest, in steps of 10 us, or the first hundredth of it on a
/// processor: it stays finite, and energy drifts at most ten times as far as on the CPU.
pub(super) fn long(device: &Device) -> Outcome {
    const H: f64 = 1e-5;
    const LOOKS: usize = 10;
    let count = if is_software(device) { 1000 } else { 100_000 };
    let model = generate::random_chain(2048, &Rod::default(), 1)?;
    let mut state = State::random(&model, 2);
    state.qd.fill(0.0);
    let start = &state;
    // Drifts cross zero: of several looks the largest counts.
    let on_cpu = || -> anyhow::Result<f64> {
        let mut cpu = vertebra::Simulation::new(model.clone())?;
        cpu.set_state(start.clone())?;
        let (before, mut drift) = (energy(&mut cpu)?, 0.0_f64);
        for _ in 0..LOOKS {
            for _ in 0..count / LOOKS {
                cpu.step(H)?;
            }
            drift = worst_of(drift, (energy(&mut cpu)? - before).abs());
        }
        Ok(drift)
    };
    let on_gpu = || -> anyhow::Result<f64> {
        let mut cpu = vertebra::Simulation::new(model.clone())?;
        cpu.set_state(start.clone())?;
        let (before, mut drift) = (energy(&mut cpu)?, 0.0_f64);
        let mut gpu = Simulation::on(device, &model, &Options::default())?;
        gpu.set_state(start)?;
        for _ in 0..LOOKS {
            gpu.steps(H, count / LOOKS)?;
            cpu.set_state(gpu.state()?)?;
            drift = worst_of(drift, (energy(&mut cpu)? - before).abs());
        }
        Ok(drift)
    };
    let (gpu, cpu) = rayon::join(on_gpu, on_cpu);
    let (gpu, cpu) = (gpu?, cpu?);
    let name = format!("drift of energy over {count} steps [J], {cpu:.1e} on the CPU");
    Ok(vec![Figure::new(name, gpu, 10.0 * cpu)])
}

fn energy(simulation: &mut vertebra::Simulation) -> anyhow::Result<f64> {
    let sums = simulation.mechanics()?;
    Ok(sums.kinetic_energy + sums.potential_energy)
}

/// A device that is lost under way is an error, the state that was read last is left, and a
/// simulation on the device opened again goes on from it as if nothing had happened.
pub(super) fn device_lost(device: &Device) -> Outcome {
    let lost = device.reopen()?;
    let model = generate::random_chain(50, &Rod::default(), 1)?;
    let on = |device: &Device, state: &State| -> anyhow::Result<vertebra::Simulation> {
        let mut simulation = vertebra::Simulation::on(&device.clone().into(), model.clone())?;
        simulation.set_state(state.clone())?;
        Ok(simulation)
    };
    let mut simulation = on(&lost, &State::random(&model, 2))?;
    simulation.steps(1e-4, 20)?;
    let read = simulation.state()?.clone();
    lost.raw().0.destroy();
    let refused = simulation.steps(1e-4, 20);
    let is_lost =
        |error: &Error| matches!(error, Error::Gpu(vertebra_gpu::Error::DeviceLost { .. }));
    let unread = simulation.state().map(drop);
    let mut again = on(&lost.reopen()?, simulation.last_state())?;
    again.steps(1e-4, 20)?;
    let mut other = on(device, &read)?;
    other.steps(1e-4, 20)?;
    Ok(vec![
        holds(
            format!("steps: {refused:?}"),
            refused.is_err_and(|e| is_lost(&e)),
        ),
        holds(
            "the state cannot be read",
            unread.is_err_and(|e| is_lost(&e)),
        ),
        holds("the last one is there", *simulation.last_state() == read),
        holds("it goes on elsewhere", again.state()? == other.state()?),
    ])
}

/// A step that overflows names a body and itself, and leaves the state.
pub(super) fn overflow(device: &Device) -> Outcome {
    let model = generate::random_chain(50, &Rod::default(), 1)?;
    let mut simulation = Simulation::on(device, &model, &Options::default())?;
    let mut state = State::random(&model, 2);
    state.qd.fill(1e30);
    simulation.set_state(&state)?;
    let refused = simulation.steps(1e9, 40);
    let named = match &refused {
        Err(Error::Step { source, .. }) => {
            matches!(&**source, Error::Overflow { body, .. } if !body.is_empty())
        }
        _ => false,
    };
    let kept = simulation.state()?;
    let finite = kept.q.iter().chain(&kept.qd).all(|x| x.is_finite());
    let good = State::random(&model, 3);
    simulation.set_state(&good)?;
    simulation.step(1e-4)?;
    let mut again = Simulation::on(device, &model, &Options::default())?;
    again.set_state(&good)?;
    again.step(1e-4)?;
    Ok(vec![
        holds("a body is named", named),
        holds("the state is kept", finite),
        holds("it goes on", simulation.state()? == again.state()?),
    ])
}
