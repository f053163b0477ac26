//! The scenario `batch` on a GPU: many states of one robot, their accelerations and whole steps.

use super::{Measurement, Meter, Selection, batch, gpu};
use crate::measure::Timing;
use crate::row::Row;
use crate::suite::{gold_robots, worst_of};
use anyhow::Context;
use std::time::Instant;
use vertebra::dynamics::gpu::{Batch, BatchOptions};
use vertebra::generate::{Rod, random_chain};
use vertebra::{
    Algorithm, Forces, Integrator, Model, Precision, Simulation, State, Workspace, aba,
    forward_error,
};
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::{DeviceType, Features};

/// Robots by their names among the reference models, and states in a batch.
const BATCHES: [(&str, usize); 3] = [
    ("humanoid27", 8192),
    ("humanoid27", 32_768),
    ("panda7", 4096),
];

/// Long chains in a batch: how many, and bodies of each.
const CHAINS: (usize, usize) = (8, 2048);

/// States of a batch that are held against the CPU, spread over all of it.
const CHECKED: usize = 64;

/// Steps that are taken without the host.
const STEPS: u32 = 64;

/// Length of a step \[s\].
const STEP: f64 = 1e-4;

/// The device and the robots that are measured on it.
pub struct Subject {
    device: Device,
    batches: Vec<Robots>,
}

/// A robot in many states.
struct Robots {
    model: Model,
    states: Vec<State>,
}

impl Robots {
    fn new(model: Model, size: usize, seed: u64) -> Self {
        let state = |item| State::random(&model, seed.wrapping_add(item));
        Self {
            states: (0..size as u64).map(state).collect(),
            model,
        }
    }

    fn are_long(&self) -> bool {
        self.model.bodies().len() >= CHAINS.1
    }
}

impl Subject {
    /// The device, if it is to be measured: any when the backend is named, else only a real GPU.
    ///
    /// # Errors
    /// If the backend is named and there is no device.
    pub fn find(named: bool, selection: &Selection) -> anyhow::Result<Option<Self>> {
        let device = match crate::suite::gpu::device() {
            Ok(device) => device,
            Err(error) if named => return Err(error.into()),
            Err(_) => return Ok(None),
        };
        if !named && device.info().device_type == DeviceType::Cpu {
            return Ok(None);
        }
        let models = gold_robots::models()?;
        let mut batches = Vec::new();
        for (name, size) in BATCHES {
            let model = models.iter().find(|model| model.name() == name);
            let model = model.with_context(|| format!("no reference model {name}"))?;
            let sizes = if selection.sizes.is_empty() {
                vec![size]
            } else {
                selection.sizes.clone()
            };
            for size in sizes {
                batches.push(Robots::new(model.clone(), size, selection.seed));
            }
        }
        let (size, bodies) = CHAINS;
        let chain = random_chain(bodies, &Rod::default(), selection.seed)?;
        batches.push(Robots::new(chain, size, selection.seed));
        Ok(Some(Self { device, batches }))
    }

    /// The rows asked for: accelerations with the lanes the cost model chooses and with others, and
    /// steps.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        for (number, robots) in self.batches.iter().enumerate() {
            for precision in selection.precisions() {
                let has = self.device.features().contains(Features::SHADER_F64);
                if precision == Precision::Reference || (precision == Precision::F64 && !has) {
                    continue;
                }
                let name = robots.model.name();
                let size = robots.states.len();
                // Divide and conquer where no lanes are named and the model is long.
                let mut add = |method: &'static str, lanes, integrator: Option<Integrator>| {
                    if selection.wants(method) {
                        let label =
                            format!("batch {name} x {size}: {method} {precision} on the GPU");
                        let options = BatchOptions {
                            precision,
                            lanes,
                            integrator: integrator.unwrap_or_default(),
                            algorithm: (robots.are_long() && lanes.is_none())
                                .then_some(Algorithm::Dca),
                        };
                        list.push(Measurement::new(label, move |meter| {
                            if integrator.is_none() {
                                self.accelerations(robots, meter, method, options)
                            } else {
                                self.steps(robots, meter, method, options)
                            }
                        }));
                    }
                };
                if robots.are_long() {
                    add("dca-batch", None, None);
                    add("aba-batch-1", Some(1), None);
                    add("step-batch", None, Some(Integrator::SemiImplicitEuler));
                    continue;
                }
                add("aba-batch", None, None);
                if selection.quick && precision == Precision::F64 {
                    continue;
                }
                add("step-batch", None, Some(Integrator::SemiImplicitEuler));
                // What the choice of lanes rests on.
                if number == 0 {
                    for (method, lanes) in [
                        ("aba-batch-1", 1),
                        ("aba-batch-2", 2),
                        ("aba-batch-4", 4),
                        ("aba-batch-8", 8),
                    ] {
                        add(method, Some(lanes), None);
                    }
                    add("step-batch-rk4", None, Some(Integrator::RungeKutta4));
                }
            }
        }
        list
    }

    fn accelerations(
        &self,
        robots: &Robots,
        meter: &Meter,
        method: &str,
        options: BatchOptions,
    ) -> anyhow::Result<Option<Row>> {
        let Robots { model, states } = robots;
        let mut batch = Batch::new(&self.device, model, states.len(), &options)?;
        let forces = vec![Forces::none(model); states.len()];
        let upload = Instant::now();
        batch.set_states(states)?;
        batch.set_forces(&forces)?;
        let upload = upload.elapsed();
        batch.solve_on_device()?;
        let found = batch.accelerations_of_each()?;
        let whole = Instant::now();
        batch.solve_on_device()?;
        let reread = batch.accelerations_of_each()?;
        let whole = whole.elapsed();
        anyhow::ensure!(found == reread, "accelerations differ from call to call");
        // In f32 a few random states are gimbal locks, which are refused.
        let refused = found.iter().filter(|qdd| qdd.is_err()).count();
        let mut exact = Workspace::new(model, Precision::Reference);
        let mut error = 0.0_f64;
        for item in checked(states.len()) {
            if let Ok(qdd) = &found[item] {
                aba(model, &states[item], &forces[item], &mut exact)?;
                error = worst_of(error, forward_error(qdd, &exact)?);
            }
        }
        let note = format!(
            "{}; setting states and forces {:.0} us, solving and reading {:.0} us; {refused} states refused",
            batch.choice(),
            1e6 * upload.as_secs_f64(),
            1e6 * whole.as_secs_f64()
        );
        let timing = timed(meter, &mut batch, |batch| Ok(batch.solve_on_device()?))?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(error),
            note,
            ..self.row(robots, method, options.precision, &timing)
        }))
    }

    fn steps(
        &self,
        robots: &Robots,
        meter: &Meter,
        method: &str,
        options: BatchOptions,
    ) -> anyhow::Result<Option<Row>> {
        let Robots { model, states } = robots;
        let mut batch = Batch::new(&self.device, model, states.len(), &options)?;
        batch.set_states(states)?;
        batch.steps_on_device(STEP, 1)?;
        let found = batch.states()?;
        let refused: Vec<usize> = batch
            .failures()?
            .into_iter()
            .map(|(item, _)| item)
            .collect();
        let mut error = 0.0_f64;
        for item in checked(states.len()).filter(|item| !refused.contains(item)) {
            let mut simulation =
                Simulation::new(model.clone())?.with_integrator(options.integrator);
            simulation.set_state(states[item].clone())?;
            simulation.step(STEP)?;
            let moved = simulation.state()?;
            let rates = crate::suite::relative_error(&found[item].qd, &moved.qd);
            let positions = crate::suite::relative_error(&found[item].q, &moved.q);
            error = worst_of(error, worst_of(rates, positions));
        }
        // From the same states, so that however many steps are measured none leaves the range.
        let run = |batch: &mut Batch| Ok(batch.steps_on_device(0.0, STEPS)?);
        batch.set_states(states)?;
        let timing = timed(meter, &mut batch, run)?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(error),
            note: format!(
                "{STEPS} steps without the host, {:.1} us each; {}; {} states refused",
                1e6 * timing.median_s / f64::from(STEPS),
                batch.choice(),
                refused.len(),
            ),
            ..self.row(robots, method, options.precision, &timing)
        }))
    }

    fn row(&self, robots: &Robots, method: &str, precision: Precision, timing: &Timing) -> Row {
        let scenario = format!("{} {}", batch::NAME, robots.model.name());
        let size = robots.states.len() as u64;
        Row {
            backend: "gpu".to_owned(),
            device: self.device.description(),
            ..Row::new(
                &scenario,
                method,
                &precision.to_string(),
                size,
                "states",
                timing,
            )
        }
    }
}

/// Items that are checked.
fn checked(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(count.div_ceil(CHECKED).max(1))
}

/// Samples the time on the device of what `run` submits, or with waiting where it takes no times.
fn timed(
    meter: &Meter,
    batch: &mut Batch,
    mut run: impl FnMut(&mut Batch) -> anyhow::Result<()>,
) -> anyhow::Result<Option<Timing>> {
    let has_times = batch.take_times().is_ok();
    gpu::sample(meter, || {
        let start = Instant::now();
        run(batch)?;
        if !has_times {
            batch.failures()?;
        }
        Ok(batch
            .gpu_time()
            .unwrap_or_else(|| start.elapsed().as_secs_f64()))
    })
}
