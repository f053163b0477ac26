//! One articulation on the GPU by divide and conquer: forward dynamics and a whole step, by timestamps;
//! errors as of the rows of the CPU.

use super::rows::shares;
use super::{Meter, row, sample};
use crate::row::Row;
use crate::scenario::model::{FEW_STEPS, Subject};
use crate::scenario::{Measurement, Selection, tolerance};
use crate::suite::{relative_error, worst_of};
use std::time::Instant;
use vertebra::dynamics::gpu::{Options, Simulation};
use vertebra::generate::{self, Rod};
use vertebra::{
    DcaOptions, DcaWorkspace, Forces, Model, Precision, State, Workspace, aba, dca, schedule,
};
use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Device, Timing};

/// Time step \[s\].
const STEP: f64 = 1e-4;

/// Step of the timed ones \[s\]: thousands of them stay near the random state, from which long chains
/// soon blow up.
const TIMED_STEP: f64 = 1e-8;

/// Steps in one run of the rows that take several.
const BLOCK: usize = 16;

/// Seeds of the rows that tell errors over many.
const SEEDS: u64 = 24;

/// Sizes of these.
const SEEDED: [usize; 2] = [128, 2048];

/// Joints of a chunk that are compared.
const WINDOWS: [usize; 5] = [2, 4, 8, 12, 16];

/// Chunks and joins.
pub(super) const PRECISIONS: [(Precision, Precision); 3] = [
    (Precision::F32, Precision::F32),
    (Precision::F64, Precision::F32),
    (Precision::F64, Precision::F64),
];

/// Those of a device whose results have a precision that is asked for.
fn asked(
    selection: &Selection,
    has_f64: bool,
) -> impl Iterator<Item = (Precision, Precision)> + use<'_> {
    PRECISIONS.into_iter().filter(move |(chunks, tree)| {
        let is_asked = selection.precisions.is_empty() || selection.precisions.contains(tree);
        is_asked && (*chunks == Precision::F32 || has_f64)
    })
}

/// The rows asked for.
pub(crate) fn measurements<'a>(
    subject: &'a Subject,
    device: &'a Device,
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let mut list = Vec::new();
    let bodies = subject.model.bodies().len();
    let has_f64 = device.features().contains(Features::SHADER_F64);
    for (chunks, tree) in asked(selection, has_f64) {
        let name = name(chunks, tree);
        let mut add = |method: &str, run: Run<'a>| {
            let label = format!(
                "{} {bodies} bodies: {method} {name} on the GPU",
                subject.scenario
            );
            list.push(Measurement::new(label, run));
        };
        let options = Options {
            chunks: Some(chunks),
            tree: Some(tree),
            ..Options::default()
        };
        let chain = Chain {
            subject,
            device,
            options,
            name: name.clone(),
        };
        if selection.wants("dca") {
            let chain = chain.clone();
            add("dca", Box::new(move |meter| chain.solve(meter, "dca")));
        }
        // With f64 joins there is no second digit to gain.
        let sweeps: &[_] = match (chunks, tree) {
            (Precision::F64, Precision::F32) => &[(1, "dca-refined"), (2, "dca-refined-2")],
            (Precision::F64, Precision::F64) => &[(1, "dca-refined")],
            _ => &[],
        };
        if selection.wants("dca-refined") {
            for &(sweeps, method) in sweeps {
                let mut chain = chain.clone();
                chain.options.sweeps = sweeps;
                add(method, Box::new(move |meter| chain.refine(meter, method)));
            }
        }
        if selection.wants(tolerance::METHOD) && chunks == Precision::F64 && tree == chunks {
            let run = move |meter: &Meter| subject.to_tolerance(meter, Some(device));
            add(tolerance::METHOD, Box::new(run));
        }
        if selection.wants("step") {
            let one = chain.clone();
            add("step", Box::new(move |meter| one.step(meter, 1)));
        }
        if selection.wants("step-16") && bodies <= FEW_STEPS {
            let block = chain.clone();
            add("step-16", Box::new(move |meter| block.step(meter, BLOCK)));
        }
        // Only when asked for.
        if selection.methods.iter().any(|method| method == "shapes") {
            for window in WINDOWS {
                let mut chain = chain.clone();
                chain.options.schedule = Some(schedule::ScheduleOptions::with_window(window));
                let method = format!("dca-window-{window}");
                let label = method.clone();
                add(&label, Box::new(move |meter| chain.solve(meter, &method)));
            }
        }
        if selection.wants("seeds") && SEEDED.contains(&bodies) {
            let chain = chain.clone();
            add("seeds", Box::new(move |meter| chain.seeds(meter)));
        }
    }
    list
}

/// Whole steps of a model in the precisions asked for, or that which is taken by default, for a comparison with other
/// models.
pub(crate) fn steps<'a>(
    subject: &'a Subject,
    device: &'a Device,
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let has_f64 = device.features().contains(Features::SHADER_F64);
    let precisions: Vec<_> = if selection.precisions.is_empty() {
        let default = if has_f64 {
            Precision::F64
        } else {
            Precision::F32
        };
        vec![(default, default)]
    } else {
        asked(selection, has_f64).collect()
    };
    let of = |(chunks, tree)| {
        let name = name(chunks, tree);
        let label = format!("{}: step-16 {name} on the GPU", subject.scenario);
        let options = Options {
            chunks: Some(chunks),
            tree: Some(tree),
            ..Options::default()
        };
        let chain = Chain {
            subject,
            device,
            options,
            name,
        };
        Measurement::new(label, move |meter| chain.step(meter, BLOCK))
    };
    precisions.into_iter().map(of).collect()
}

/// Solves once \[s\].
fn solved(simulation: &mut Simulation) -> anyhow::Result<f64> {
    let start = Instant::now();
    simulation.solve()?;
    Ok(simulation
        .gpu_time()
        .unwrap_or_else(|| start.elapsed().as_secs_f64()))
}

type Run<'a> = Box<dyn FnOnce(&Meter) -> anyhow::Result<Option<Row>> + 'a>;

pub(super) fn name(chunks: Precision, tree: Precision) -> String {
    if chunks == tree {
        return tree.to_string();
    }
    format!("{chunks}/{tree}")
}

/// A model on a device in some precisions.
#[derive(Clone)]
struct Chain<'a> {
    subject: &'a Subject,
    device: &'a Device,
    options: Options,
    name: String,
}

impl Chain<'_> {
    fn simulation(&self, state: &State, forces: &Forces) -> anyhow::Result<Simulation> {
        let mut simulation = Simulation::on(self.device, &self.subject.model, &self.options)?;
        simulation.set_state(state)?;
        simulation.set_forces(forces)?;
        if self.device.features().contains(Features::TIMESTAMP_QUERY) {
            simulation.take_times(Timing::Whole)?;
        }
        Ok(simulation)
    }

    fn row(&self, method: &str, timing: &crate::measure::Timing) -> Row {
        Row {
            scenario: self.subject.scenario.clone(),
            precision: self.name.clone(),
            size_unit: "bodies".to_owned(),
            ..row(
                self.device,
                method,
                self.subject.model.bodies().len(),
                "bodies",
                timing,
            )
        }
    }

    /// Largest error over the inputs.
    fn error(&self) -> anyhow::Result<f64> {
        let mut forward = 0.0_f64;
        let mut simulation = None;
        for ((state, forces), exact) in self.subject.inputs.iter().zip(self.subject.reference()?) {
            let simulation = match &mut simulation {
                Some(simulation) => simulation,
                None => simulation.insert(self.simulation(state, forces)?),
            };
            simulation.set_state(state)?;
            simulation.set_forces(forces)?;
            forward = worst_of(forward, relative_error(&simulation.accelerations()?, exact));
        }
        Ok(forward)
    }

    /// Forward dynamics: chunks, joins, accelerations; kinematics up and down are those of the step.
    fn solve(&self, meter: &Meter, method: &str) -> anyhow::Result<Option<Row>> {
        let forward = self.error()?;
        let (state, forces) = &self.subject.inputs[0];
        let mut simulation = self.simulation(state, forces)?;
        simulation.solve()?;
        let timing = sample(meter, || solved(&mut simulation))?;
        let profile = self.profile(&mut simulation, Simulation::solve)?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            note: format!("without kinematics{profile}"),
            ..self.row(method, &timing)
        }))
    }

    /// Forward dynamics with corrections, and what one costs beside the solution: both in turns, as a device's clock
    /// is not steady.
    fn refine(&self, meter: &Meter, method: &str) -> anyhow::Result<Option<Row>> {
        let forward = self.error()?;
        let sweeps = self.options.sweeps;
        let (mut plain, mut refined) = (self.corrected(0)?, self.corrected(sweeps)?);
        let mut shares = Vec::new();
        let timing = sample(meter, || {
            let (alone, whole) = (solved(&mut plain)?, solved(&mut refined)?);
            shares.push((whole / alone - 1.0) / sweeps as f64);
            Ok(whole)
        })?;
        let profile = self.profile(&mut refined, Simulation::solve)?;
        let share = crate::measure::Timing::from_samples(shares);
        Ok(timing.zip(share).map(|(timing, share)| Row {
            error_forward: Some(forward),
            note: format!(
                "each correction adds {:.0} % of a solution without any, in turns; without kinematics{profile}",
                100.0 * share.median_s,
            ),
            ..self.row(method, &timing)
        }))
    }

    /// The first input with so many corrections.
    fn corrected(&self, sweeps: usize) -> anyhow::Result<Simulation> {
        let chain = Chain {
            options: Options {
                sweeps,
                ..self.options
            },
            ..self.clone()
        };
        let (state, forces) = &self.subject.inputs[0];
        chain.simulation(state, forces)
    }

    /// A whole step: kinematics, dynamics, integration and, after the last of `count`, all poses; the
    /// time of one. The error is that of the rates.
    fn step(&self, meter: &Meter, count: usize) -> anyhow::Result<Option<Row>> {
        let (state, forces) = &self.subject.inputs[0];
        let mut simulation = self.simulation(state, forces)?;
        simulation.steps(STEP, 1)?;
        let exact = self.subject.reference()?[0].iter();
        let expected: Vec<f64> = state
            .qd
            .iter()
            .zip(exact)
            .map(|(qd, a)| qd + STEP * a)
            .collect();
        let forward = relative_error(&simulation.state()?.qd, &expected);
        let dispatches = simulation.dispatches()?;
        let mut waits = Vec::new();
        let timing = sample(meter, || {
            let start = Instant::now();
            simulation.steps(TIMED_STEP, count)?;
            let wall = start.elapsed().as_secs_f64();
            waits.push(wall / count as f64);
            Ok(simulation.gpu_time().unwrap_or(wall) / count as f64)
        })?;
        let start = Instant::now();
        simulation.poses()?;
        let read = start.elapsed().as_secs_f64();
        let start = Instant::now();
        simulation.set_state(state)?;
        simulation.poses()?;
        let upload = start.elapsed().as_secs_f64();
        // Steps with the poses before them on their way meanwhile; the second time their program is ready.
        let mut together = f64::INFINITY;
        for _ in 0..2 {
            let start = Instant::now();
            let poses = simulation.begin_poses()?;
            simulation.steps(TIMED_STEP, count)?;
            poses.wait()?;
            together = start.elapsed().as_secs_f64();
        }
        waits.sort_by(f64::total_cmp);
        let wait = waits.get(waits.len() / 2).copied().unwrap_or_default();
        let profile = self.profile(&mut simulation, |simulation| {
            simulation.steps(TIMED_STEP, 1)
        })?;
        let method = if count == 1 { "step" } else { "step-16" };
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            reference_time_s: self.subject.published_step_s,
            note: format!(
                "{dispatches} dispatches; {:.0} us with submitting and waiting, poses read in {:.0} us, or all \
                 {count} and poses meanwhile in {:.0} us, state uploaded and posed in {:.0} us{profile}",
                1e6 * wait,
                1e6 * read,
                1e6 * together,
                1e6 * upload
            ),
            ..self.row(method, &timing)
        }))
    }

    /// Shares of the kernels in a run, each dispatch timed by itself.
    fn profile<E: Into<anyhow::Error>>(
        &self,
        simulation: &mut Simulation,
        run: impl Fn(&mut Simulation) -> Result<(), E>,
    ) -> anyhow::Result<String> {
        if !self.device.features().contains(Features::TIMESTAMP_QUERY) {
            return Ok(String::new());
        }
        simulation.take_times(Timing::Dispatches)?;
        let (state, _) = &self.subject.inputs[0];
        simulation.set_state(state)?;
        for _ in 0..4 {
            run(simulation).map_err(Into::into)?;
        }
        Ok(format!(
            "; one by one{}",
            shares(&simulation.dispatch_times())
        ))
    }

    /// Errors over many seeds, and those of the same algorithm on the CPU: whether the device loses
    /// digits that the CPU has.
    fn seeds(&self, meter: &Meter) -> anyhow::Result<Option<Row>> {
        let bodies = self.subject.model.bodies().len();
        let mut errors = [Vec::new(), Vec::new()];
        let (chunks, tree) = (self.options.chunks, self.options.tree);
        let mut times = Vec::new();
        for seed in 0..SEEDS {
            if meter.interrupt.requested() {
                return Ok(None);
            }
            let model: Model = generate::random_chain(bodies, &Rod::default(), seed)?;
            let (state, forces) = (State::random(&model, seed + 1), Forces::none(&model));
            let mut reference = Workspace::new(&model, Precision::Reference);
            let exact = aba(&model, &state, &forces, &mut reference)?.to_vec();
            let mut simulation = Simulation::on(self.device, &model, &self.options)?;
            if self.device.features().contains(Features::TIMESTAMP_QUERY) {
                simulation.take_times(Timing::Whole)?;
            }
            simulation.set_state(&state)?;
            let start = Instant::now();
            let found = simulation.accelerations()?;
            let time = simulation
                .gpu_time()
                .unwrap_or_else(|| start.elapsed().as_secs_f64());
            times.push(time);
            errors[0].push(relative_error(&found, &exact));
            let options = DcaOptions {
                chunks: chunks.unwrap_or_default(),
                tree: tree.unwrap_or_default(),
                schedule: Some(schedule::ScheduleOptions::with_window(4)),
                parallel: false,
            };
            let mut workspace = DcaWorkspace::new(&model, &options)?;
            let twin = dca(&model, &state, &forces, &mut workspace)?;
            errors[1].push(relative_error(twin, &exact));
        }
        let figures = errors.map(|mut errors| {
            errors.sort_by(f64::total_cmp);
            let middle = errors[errors.len() / 2];
            (middle, errors.last().copied().unwrap_or_default())
        });
        let [(median, largest), (twin_median, twin_largest)] = figures;
        let timing = crate::measure::Timing::from_samples(times);
        Ok(timing.map(|timing| Row {
            error_forward: Some(largest),
            note: format!(
                "errors over {SEEDS} seeds: median {median:.1e}, largest {largest:.1e}; of the CPU in \
                 the same precisions {twin_median:.1e}, {twin_largest:.1e}"
            ),
            ..self.row("seeds", &timing)
        }))
    }
}
