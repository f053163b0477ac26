//! Steps of the scenario `joints` on a GPU.

use super::joints::{CHAIN, NAME, STEP, Subject};
use super::{Measurement, Meter, Selection, gpu};
use crate::row::Row;
use crate::suite::relative_error;
use std::time::Instant;
use vertebra::dynamics::gpu::{Options, Simulation};
use vertebra::{Model, Precision, State};
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Device, Timing};

/// Steps of a submission, after which the chain starts anew, and of the comparison with the CPU.
const BLOCK: usize = 16;
const COMPARED: usize = 2;

/// Chunks and joins.
const PRECISIONS: [(Precision, Precision); 3] = [
    (Precision::F32, Precision::F32),
    (Precision::F64, Precision::F32),
    (Precision::F64, Precision::F64),
];

/// The rows asked for.
#[must_use]
pub fn measurements<'a>(
    subject: &'a Subject,
    device: &'a Device,
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let has_f64 = device.features().contains(Features::SHADER_F64);
    let mut list = Vec::new();
    for (method, model) in subject.chains() {
        for (chunks, tree) in PRECISIONS {
            let asked = selection.precisions.is_empty() || selection.precisions.contains(&tree);
            let computes = chunks == Precision::F32 || has_f64;
            if selection.wants(method) && asked && computes {
                let label = format!("chain of {CHAIN}: {method} {chunks}/{tree} on the GPU");
                let options = Options {
                    chunks: Some(chunks),
                    tree: Some(tree),
                    ..Options::default()
                };
                list.push(Measurement::new(label, move |meter| {
                    steps(meter, device, (method, model), subject.seed(), &options)
                }));
            }
        }
    }
    list
}

/// Semi-implicit Euler steps; the error is that of the rates after the first ones, against the CPU's.
fn steps(
    meter: &Meter,
    device: &Device,
    (method, model): (&str, &Model),
    seed: u64,
    options: &Options,
) -> anyhow::Result<Option<Row>> {
    let state = State::random(model, seed);
    let mut cpu = vertebra::Simulation::new(model.clone())?;
    cpu.set_state(state.clone())?;
    cpu.steps(STEP, COMPARED)?;
    let mut simulation = Simulation::on(device, model, options)?;
    simulation.set_state(&state)?;
    simulation.steps(STEP, COMPARED)?;
    let error = relative_error(&simulation.state()?.qd, &cpu.state()?.qd);
    if device.features().contains(Features::TIMESTAMP_QUERY) {
        simulation.take_times(Timing::Whole)?;
    }
    let timing = gpu::sample(meter, || {
        simulation.set_state(&state)?;
        let start = Instant::now();
        simulation.steps(STEP, BLOCK)?;
        let wall = start.elapsed().as_secs_f64();
        Ok(simulation.gpu_time().unwrap_or(wall) / BLOCK as f64)
    })?;
    let (chunks, tree) = simulation.precisions();
    let precision = if chunks == tree {
        tree.to_string()
    } else {
        format!("{chunks}/{tree}")
    };
    Ok(timing.map(|timing| Row {
        error_forward: Some(error),
        backend: "gpu".to_owned(),
        device: device.description(),
        note: format!("{BLOCK} steps in a submission; error of the rates after {COMPARED}"),
        ..Row::new(NAME, method, &precision, CHAIN as u64, "bodies", &timing)
    }))
}
