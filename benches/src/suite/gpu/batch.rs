//! Batches of the reference robots on the device, against the CPU.

use super::{Outcome, holds};
use crate::suite::{Figure, gold_robots, worst_of};
use vertebra::dynamics::gpu::{Batch, BatchOptions};
use vertebra::generate::{RandomTree, Rod, random_chain, random_tree};
use vertebra::{
    Algorithm, Error, Forces, Integrator, Model, Precision, Random, Simulation, State, Workspace,
    Wrench, aba, forward_error,
};
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::Features;

/// Items of a batch: some workgroups, and a part of one.
const ITEMS: usize = 70;

fn precisions(device: &Device) -> Vec<Precision> {
    let double = device.features().contains(Features::SHADER_F64);
    let all = [Precision::F32, Precision::F64];
    all.into_iter().take(if double { 2 } else { 1 }).collect()
}

/// Random forces in joints and on bodies.
fn forces(model: &Model, count: usize, seed: u64) -> Result<Vec<Forces>, Error> {
    let mut random = Random::new(seed);
    let bodies: Vec<_> = model.body_ids().collect();
    let one = |item: usize| {
        let mut forces = Forces::none(model);
        forces.joint.fill_with(|| random.symmetric());
        for _ in 0..item % 3 {
            let mut wrench = Wrench::at_point(random.direction() * 3.0, random.direction())
                .with_torque(random.direction());
            wrench.body_axes = item.is_multiple_of(2);
            forces.push(bodies[random.below(bodies.len())], wrench);
        }
        if item % 4 == 3 {
            forces.set_gravity(model, bodies[0], random.direction() * 5.0)?;
        }
        Ok(forces)
    };
    (0..count).map(one).collect()
}

/// The largest ratio of the error to what the CPU's recursion errs in the same precision, with
/// rounding of as many bodies.
pub(super) fn accelerations(device: &Device) -> Outcome {
    let mut models = gold_robots::models()?;
    for (seed, floating) in [(1, false), (2, true), (3, true)] {
        let tree = RandomTree {
            floating,
            ..RandomTree::mixed(20)
        };
        models.push(random_tree(&tree, seed)?);
    }
    let mut figures = Vec::new();
    for (number, model) in (0..).zip(&models) {
        let states: Vec<_> = (0..ITEMS as u64)
            .map(|item| State::random(model, 1000 * number + item))
            .collect();
        // Without forces on bodies other kernels are compiled.
        let forces = if number % 2 == 0 {
            forces(model, ITEMS, number)?
        } else {
            vec![Forces::none(model); ITEMS]
        };
        for precision in precisions(device) {
            // Every number occurs; compiling all for all would take minutes.
            let lanes = [1, 2, 4, 8][(number % 4) as usize];
            let options = BatchOptions {
                precision,
                lanes: Some(lanes),
                ..BatchOptions::default()
            };
            let mut batch = Batch::new(device, model, ITEMS, &options)?;
            batch.set_states(&states)?;
            batch.set_forces(&forces)?;
            let qdd = batch.solve()?;
            let again = batch.solve()?;
            let (mut ratio, dofs) = (0.0_f64, model.dof_count());
            let mut exact = Workspace::new(model, Precision::Reference);
            let mut same = Workspace::new(model, precision);
            for item in 0..ITEMS {
                aba(model, &states[item], &forces[item], &mut exact)?;
                let cpu = aba(model, &states[item], &forces[item], &mut same)?;
                let cpu = forward_error(cpu, &exact)?;
                let found = &qdd[item * dofs..(item + 1) * dofs];
                let rounding = 20.0 * model.bodies().len() as f64 * precision.epsilon();
                let error = forward_error(found, &exact)? / (30.0 * cpu + rounding);
                ratio = worst_of(ratio, error);
            }
            let name = format!("{} in {precision} on {lanes} lanes", model.name());
            figures.push(holds(format!("{name}: same bits"), qdd == again));
            figures.push(Figure::new(name, ratio, 1.0));
        }
    }
    Ok(figures)
}

/// Few long chains, which go by divide and conquer: the choice, and errors as of one alone.
pub(super) fn long_chains(device: &Device) -> Outcome {
    let bodies = if super::is_software(device) {
        300
    } else {
        2048
    };
    let model = random_chain(bodies, &Rod::default(), 1)?;
    let states: Vec<_> = (0..8).map(|seed| State::random(&model, seed)).collect();
    let forces = forces(&model, states.len(), 2)?;
    let mut figures = Vec::new();
    for precision in precisions(device) {
        let options = BatchOptions {
            precision,
            ..BatchOptions::default()
        };
        let mut batch = Batch::new(device, &model, states.len(), &options)?;
        let choice = *batch.choice();
        let conquers = choice.algorithm == Algorithm::Dca && !choice.forced;
        figures.push(holds(format!("{precision}: {choice}"), conquers));
        batch.set_states(&states)?;
        batch.set_forces(&forces)?;
        let qdd = batch.solve()?;
        let mut exact = Workspace::new(&model, Precision::Reference);
        let mut worst = 0.0_f64;
        for (item, found) in qdd.chunks_exact(bodies).enumerate() {
            aba(&model, &states[item], &forces[item], &mut exact)?;
            worst = worst_of(worst, forward_error(found, &exact)?);
        }
        // As of `dynamics_seeds`.
        let bound = if precision == Precision::F32 {
            2e-3
        } else {
            2e-11
        };
        let name = format!("{} chains of {bodies} in {precision}", states.len());
        figures.push(Figure::new(name, worst, bound));
    }
    Ok(figures)
}

/// Steps of both integrators follow the CPU's.
pub(super) fn steps(device: &Device) -> Outcome {
    const H: f64 = 1e-4;
    const STEPS: u32 = 70;
    let mut figures = Vec::new();
    let mut models = gold_robots::models()?;
    models.retain(|model| model.name() == "humanoid27");
    models.push(random_tree(&RandomTree::mixed(12), 4)?);
    for model in models {
        let states: Vec<_> = (0..33).map(|item| State::random(&model, item)).collect();
        for precision in precisions(device) {
            for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
                let options = BatchOptions {
                    precision,
                    integrator,
                    ..BatchOptions::default()
                };
                let mut batch = Batch::new(device, &model, states.len(), &options)?;
                batch.set_states(&states)?;
                batch.steps(H, STEPS)?;
                let found = batch.states()?;
                let mut worst = 0.0_f64;
                for item in [0, 15, 32] {
                    let mut cpu = Simulation::new(model.clone())?.with_integrator(integrator);
                    cpu.set_state(states[item].clone())?;
                    let mut largest = 1.0_f64;
                    for _ in 0..STEPS {
                        cpu.step(H)?;
                        let rates = cpu.state()?.qd.iter();
                        largest = rates.fold(largest, |m, x| m.max(x.abs()));
                    }
                    let numbers = |state: &State| [&state.q[..], &state.qd].concat();
                    let off = numbers(&found[item]).into_iter().zip(numbers(cpu.state()?));
                    let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, worst_of);
                    worst = worst_of(worst, off / largest);
                }
                // Every step rounds, and errors grow with what the motion makes of them.
                let bound = 100.0 * f64::from(STEPS) * precision.epsilon();
                let name = format!("{} in {precision}, {integrator:?}", model.name());
                figures.push(Figure::new(name, worst, bound));
            }
        }
    }
    Ok(figures)
}

/// An item that leaves the range of numbers is named with its body, and stands still; the others go
/// on.
pub(super) fn a_failing_item(device: &Device) -> Outcome {
    let models = gold_robots::models()?;
    let mut figures = Vec::new();
    for model in models.iter().take(1) {
        let mut states: Vec<_> = (0..ITEMS as u64)
            .map(|item| State::random(model, item))
            .collect();
        let last = model.dof_count() - 1;
        states[68].qd[last] = 1e25;
        let options = BatchOptions {
            precision: Precision::F32,
            ..BatchOptions::default()
        };
        let mut batch = Batch::new(device, model, ITEMS, &options)?;
        batch.set_states(&states)?;
        let name = match batch.steps(1e-3, 5) {
            Ok(()) => "nothing".to_owned(),
            Err(error) => error.to_string(),
        };
        let is_named = matches!(
            batch.failures()?.as_slice(),
            [(68, Error::Overflow { time, .. })] if *time == 0.0
        );
        figures.push(holds(format!("{}: {name}", model.name()), is_named));
        let moved = batch.states()?;
        let finite = |s: &State| s.q.iter().chain(&s.qd).all(|x| x.is_finite());
        figures.push(holds("all are finite", moved.iter().all(finite)));
        figures.push(holds("others go on", moved[69].q != states[69].q));
        figures.push(holds("it stands", moved[68].qd[last] > 0.99e25));
    }
    Ok(figures)
}
