//! The scenario `batch`: many states of one robot, an arm of 7 and a humanoid of 35 freedoms.

use super::{Measurement, Meter, Selection};
use crate::row::Row;
use crate::suite::{gold_robots, worst_of};
use vertebra::{Batch, Forces, Model, Precision, State, Workspace, aba, aba_batch, forward_error};

/// Name of the group of scenarios.
pub const NAME: &str = "batch";

/// The robots, by their names among the reference models.
const ROBOTS: [&str; 2] = ["panda7", "g1_29dof"];

/// States in a batch.
const SIZES: [usize; 2] = [1024, 8192];

/// States of a batch that are held against the reference, spread over all of it.
const CHECKED: usize = 64;

/// A robot in many states at once.
#[derive(Clone, Debug)]
pub struct Subject {
    scenario: String,
    model: Model,
    states: Vec<State>,
    forces: Vec<Forces>,
}

/// The robots in batches of the sizes asked for.
///
/// # Errors
/// None in practice: the reference models are valid.
pub fn subjects(selection: &Selection) -> anyhow::Result<Vec<Subject>> {
    let sizes: &[usize] = if selection.sizes.is_empty() {
        &SIZES
    } else {
        &selection.sizes
    };
    let models = gold_robots::models()?;
    let robots = models.iter().filter(|model| ROBOTS.contains(&model.name()));
    let subject = |(model, &size): (&Model, &usize)| Subject {
        scenario: format!("{NAME} {}", model.name()),
        states: (0..size as u64)
            .map(|item| State::random(model, selection.seed.wrapping_add(item)))
            .collect(),
        forces: vec![Forces::none(model); size],
        model: model.clone(),
    };
    Ok(robots
        .flat_map(|model| sizes.iter().map(move |size| (model, size)))
        .map(subject)
        .collect())
}

impl Subject {
    /// The rows asked for: state by state on one thread, and as a batch.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        let label = |method: &str, precision: Precision, threads: usize| {
            let (name, size) = (&self.scenario, self.states.len());
            format!("{name} x {size}: {method} {precision} on {threads} threads")
        };
        for precision in selection.precisions() {
            if selection.wants("aba") {
                list.push(Measurement::new(label("aba", precision, 1), move |meter| {
                    self.singly(meter, precision)
                }));
            }
            for threads in selection.threads() {
                if selection.wants("aba-batch") {
                    let label = label("aba-batch", precision, threads);
                    list.push(Measurement::new(label, move |meter| {
                        self.batch(meter, precision, threads)
                    }));
                }
            }
        }
        list
    }

    fn singly(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let mut workspace = Workspace::new(&self.model, precision);
        let error = self.error(|item| {
            let (state, forces) = (&self.states[item], &self.forces[item]);
            Ok(aba(&self.model, state, forces, &mut workspace)?.to_vec())
        })?;
        let timing = meter.time(|| {
            for (state, forces) in self.states.iter().zip(&self.forces) {
                aba(&self.model, state, forces, &mut workspace)?;
            }
            Ok::<_, vertebra::Error>(())
        })?;
        Ok(timing.map(|timing| self.row("aba", precision, 1, error, &timing)))
    }

    fn batch(
        &self,
        meter: &Meter,
        precision: Precision,
        threads: usize,
    ) -> anyhow::Result<Option<Row>> {
        let Self {
            model,
            states,
            forces,
            ..
        } = self;
        let mut batch = Batch::with_threads(model, precision, threads);
        aba_batch(model, states, forces, &mut batch)?;
        let error = self.error(|item| Ok(batch.joint_accelerations(item)?.to_vec()))?;
        let timing = meter.time(|| aba_batch(model, states, forces, &mut batch).map(|_| ()))?;
        Ok(timing.map(|timing| self.row("aba-batch", precision, threads, error, &timing)))
    }

    /// The largest error against the reference of what `solve` gives for items.
    fn error(
        &self,
        mut solve: impl FnMut(usize) -> anyhow::Result<Vec<f64>>,
    ) -> anyhow::Result<f64> {
        let mut exact = Workspace::new(&self.model, Precision::Reference);
        let mut worst = 0.0_f64;
        for item in (0..self.states.len()).step_by(self.states.len().div_ceil(CHECKED)) {
            aba(
                &self.model,
                &self.states[item],
                &self.forces[item],
                &mut exact,
            )?;
            worst = worst_of(worst, forward_error(&solve(item)?, &exact)?);
        }
        Ok(worst)
    }

    fn row(
        &self,
        method: &str,
        precision: Precision,
        threads: usize,
        error: f64,
        timing: &crate::measure::Timing,
    ) -> Row {
        let (precision, size) = (precision.to_string(), self.states.len() as u64);
        Row {
            threads,
            error_forward: Some(error),
            ..Row::new(&self.scenario, method, &precision, size, "states", timing)
        }
    }
}
