//! Mechanisms with closed loops on the GPU: whole steps by timestamps, and how far open they leave the loops.

use super::chains::{PRECISIONS, name};
use super::rows::shares;
use super::{Meter, row, sample};
use crate::row::Row;
use crate::scenario::loops::{NAME, RUN, STEP, STEPS, Subject};
use crate::scenario::{Measurement, Selection};
use std::time::Instant;
use vertebra::dynamics::gpu::{Options, Simulation};
use vertebra::{Precision, Simulation as OnProcessor};
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Device, Timing};

/// Steps in one run.
const BLOCK: usize = 16;

/// The rows asked for.
pub(crate) fn measurements<'a>(
    subject: &'a Subject,
    device: &'a Device,
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let mut list = Vec::new();
    let has_f64 = device.features().contains(Features::SHADER_F64);
    for (chunks, tree) in PRECISIONS {
        let asked = selection.precisions.is_empty() || selection.precisions.contains(&tree);
        if !asked || !selection.wants("step-16") || (chunks == Precision::F64 && !has_f64) {
            continue;
        }
        let (model, bodies) = (subject.model.name(), subject.model.bodies().len());
        let name = name(chunks, tree);
        let label = format!("{NAME} {model} {bodies} bodies: step-16 {name} on the GPU");
        let options = Options {
            chunks: Some(chunks),
            tree: Some(tree),
            ..Options::default()
        };
        list.push(Measurement::new(label, move |meter| {
            step(subject, device, &options, meter)
        }));
    }
    list
}

/// A step of semi-implicit Euler that keeps the loops closed, one of sixteen with poses after the last. Error: the
/// largest violation over the size of its loop after 2000 steps (`error_residual`).
fn step(
    subject: &Subject,
    device: &Device,
    options: &Options,
    meter: &Meter,
) -> anyhow::Result<Option<Row>> {
    let mut simulation = Simulation::on(device, &subject.model, options)?;
    simulation.set_state(&subject.start)?;
    simulation.steps(STEP, STEPS)?;
    let mut processor = OnProcessor::new(subject.model.clone())?;
    processor.set_state(simulation.state()?)?;
    let violation = processor.loop_violation()?.map(|found| found.position);
    let has_times = device.features().contains(Features::TIMESTAMP_QUERY);
    if has_times {
        simulation.take_times(Timing::Whole)?;
    }
    let mut turn = 0;
    let timing = sample(meter, || {
        if turn % (RUN / BLOCK) == 0 {
            simulation.set_state(&subject.start)?;
        }
        turn += 1;
        let start = Instant::now();
        simulation.steps(STEP, BLOCK)?;
        let wall = start.elapsed().as_secs_f64();
        Ok(simulation.gpu_time().unwrap_or(wall) / BLOCK as f64)
    })?;
    let mut profile = String::new();
    if has_times {
        simulation.take_times(Timing::Dispatches)?;
        simulation.set_state(&subject.start)?;
        for _ in 0..4 {
            simulation.steps(STEP, 1)?;
        }
        profile = format!("; one by one{}", shares(&simulation.dispatch_times()));
    }
    let dispatches = simulation.dispatches()?;
    let loops = subject.model.loops().len();
    let (chunks, tree) = simulation.precisions();
    let bodies = subject.model.bodies().len();
    Ok(timing.map(|timing| Row {
        scenario: format!("{NAME} {}", subject.model.name()),
        precision: name(chunks, tree),
        error_residual: violation,
        note: format!(
            "{loops} loops; {dispatches} dispatches; the residual is the violation over the loop's size after {STEPS} \
             steps{profile}"
        ),
        ..row(device, "step-16", bodies, "bodies", &timing)
    }))
}
