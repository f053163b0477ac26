//! Rows of one articulated model: forward and inverse dynamics, and a whole step.

use super::{Measurement, Meter, Selection, tolerance};
use crate::row::Row;
use crate::suite::{relative_error, worst_of};
use std::sync::OnceLock;
use vertebra::{
    DcaOptions, DcaWorkspace, Forces, Model, Precision, Random, Simulation, State, Workspace,
    Wrench, aba, crba_forward_dynamics, dca, joint_wrenches, residual, rnea,
};

/// Random inputs a row is measured on, in turn; its error is the largest over them. The reference
/// takes twenty times as long as f64, so there are fewer for the largest models.
const fn cases(bodies: usize) -> usize {
    match bodies {
        0..=8192 => 10,
        8193..=65_536 => 3,
        _ => 1,
    }
}

/// Bodies beyond which a timed step always starts from a random state.
pub(crate) const FEW_STEPS: usize = 65_536;

/// What a row says that has fewer inputs than others.
const FEWER_CASES: &str = "errors are the largest over 10 random inputs, over 3 beyond 8192 bodies, and of one beyond \
     65 536";

/// Bodies from which divide and conquer has work for several threads.
const PARALLEL_BODIES: usize = 2048;

/// Largest number of freedoms for which a dense factorisation is measured: it takes n^3.
const DENSE_LIMIT: usize = 512;

/// Time step of the rows that take one \[s\].
const STEP: f64 = 1e-4;

/// A model and the inputs it is measured on.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Name of the scenario in the rows.
    pub scenario: String,
    /// The model.
    pub model: Model,
    /// States and forces: random positions and rates, a random force on a random body.
    pub inputs: Vec<(State, Forces)>,
    /// Published time of a step \[s\].
    pub published_step_s: Option<f64>,
    /// Joint accelerations of each input in the reference precision, rounded to f64, once known.
    reference: OnceLock<Vec<Vec<f64>>>,
}

impl Subject {
    /// Random inputs for a model.
    #[must_use]
    pub fn new(scenario: &str, model: Model, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let bodies: Vec<_> = model.body_ids().collect();
        let inputs = (0..cases(bodies.len()) as u64)
            .map(|case| {
                let state = State::random(&model, seed.wrapping_add(1 + case));
                let mut forces = Forces::none(&model);
                let body = bodies[random.below(bodies.len())];
                forces.push(body, Wrench::at_center(random.direction() * 10.0));
                (state, forces)
            })
            .collect();
        Self {
            scenario: scenario.to_owned(),
            model,
            inputs,
            published_step_s: None,
            reference: OnceLock::new(),
        }
    }

    /// The rows asked for.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let bodies = self.model.bodies().len();
        let mut list = Vec::new();
        let mut add = |method: &str, detail: &str, run: Run<'a>| {
            if selection.wants(method) {
                let label = format!("{} {bodies} bodies: {method} {detail}", self.scenario);
                list.push(Measurement::new(label, run));
            }
        };
        for precision in selection.precisions() {
            let detail = precision.to_string();
            add("aba", &detail, Box::new(move |m| self.aba(m, precision)));
            if precision == Precision::F64 {
                for (name, sweeps) in [("aba-refined", 1), ("aba-refined-2", 2)] {
                    let run = move |m: &Meter| self.refined(m, None, sweeps);
                    add(name, &detail, Box::new(run));
                }
                let run = move |m: &Meter| self.to_tolerance(m, None);
                add(tolerance::METHOD, "", Box::new(run));
                let options = DcaOptions {
                    tree: Precision::F32,
                    parallel: false,
                    ..DcaOptions::default()
                };
                let detail = precision_name(&options);
                for (name, sweeps) in [("dca-refined", 1), ("dca-refined-2", 2)] {
                    let run = move |m: &Meter| self.refined(m, Some(options), sweeps);
                    add(name, &detail, Box::new(run));
                }
            }
            add("rnea", &detail, Box::new(move |m| self.rnea(m, precision)));
            add(
                "step",
                &detail,
                Box::new(move |m| self.step(m, precision, Read::Last)),
            );
            let dense_limit = if selection.quick {
                DENSE_LIMIT / 2
            } else {
                DENSE_LIMIT
            };
            if precision == Precision::F64 && self.model.dof_count() <= dense_limit {
                add("crba", &detail, Box::new(move |m| self.crba(m, precision)));
                let run = move |m: &Meter| self.derivatives(m);
                add("aba-derivatives", &detail, Box::new(run));
            }
            for options in trees(precision) {
                for threads in selection.threads() {
                    if threads > 1 && bodies < PARALLEL_BODIES {
                        continue;
                    }
                    let detail = format!("{} on {threads}", precision_name(&options));
                    let run = move |m: &Meter| self.dca(m, &options, threads);
                    add("dca", &detail, Box::new(run));
                }
            }
        }
        list
    }

    pub(super) fn row(
        &self,
        method: &str,
        precision: &str,
        timing: &crate::measure::Timing,
    ) -> Row {
        let bodies = self.model.bodies().len();
        let few = cases(bodies) < cases(0);
        Row {
            note: if few { FEWER_CASES } else { "" }.to_owned(),
            ..Row::new(
                &self.scenario,
                method,
                precision,
                bodies as u64,
                "bodies",
                timing,
            )
        }
    }

    /// The joint accelerations of each input in the reference precision, rounded to f64; computed
    /// once, as it takes longer than most rows.
    pub(super) fn reference(&self) -> Result<&[Vec<f64>], vertebra::Error> {
        if let Some(reference) = self.reference.get() {
            return Ok(reference);
        }
        let mut exact = Workspace::of_tree(&self.model, Precision::Reference);
        let solve = |(state, forces): &(State, Forces)| {
            aba(&self.model, state, forces, &mut exact).map(<[f64]>::to_vec)
        };
        let solved = self.inputs.iter().map(solve).collect::<Result<_, _>>()?;
        Ok(self.reference.get_or_init(|| solved))
    }

    /// Forward dynamics by the articulated-body algorithm. Errors: against the reference, and the
    /// residual of the bodies' own equations.
    pub(super) fn aba(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let mut workspace = Workspace::of_tree(&self.model, precision);
        let (mut forward, mut own) = (0.0_f64, 0.0_f64);
        for ((state, forces), exact) in self.inputs.iter().zip(self.reference()?) {
            let qdd = aba(&self.model, state, forces, &mut workspace)?;
            forward = worst_of(forward, relative_error(qdd, exact));
            joint_wrenches(&mut workspace)?;
            own = worst_of(
                own,
                residual(&self.model, state, forces, &workspace)?.by_body,
            );
        }
        let mut inputs = self.inputs.iter().cycle();
        let timing = meter.time(|| {
            let Some((state, forces)) = inputs.next() else {
                return Ok(());
            };
            aba(&self.model, state, forces, &mut workspace).map(|_| ())
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            error_residual: Some(own),
            ..self.row("aba", &precision.to_string(), &timing)
        }))
    }

    /// Forward dynamics by divide and conquer over the assembly tree, in a pool of so many threads.
    /// Errors: against the reference, and the residual of the bodies' own equations.
    pub(super) fn dca(
        &self,
        meter: &Meter,
        options: &DcaOptions,
        threads: usize,
    ) -> anyhow::Result<Option<Row>> {
        let model = &self.model;
        let reference = self.reference()?;
        let options = DcaOptions {
            parallel: threads > 1,
            ..*options
        };
        let measure = || -> anyhow::Result<Option<Row>> {
            let mut workspace = DcaWorkspace::of_tree(model, &options)?;
            let (mut forward, mut own) = (0.0_f64, 0.0_f64);
            for ((state, forces), exact) in self.inputs.iter().zip(reference) {
                let qdd = dca(model, state, forces, &mut workspace)?;
                forward = worst_of(forward, relative_error(qdd, exact));
                workspace.compute_joint_wrenches(forces)?;
                own = worst_of(own, residual(model, state, forces, &workspace)?.by_body);
            }
            let mut inputs = self.inputs.iter().cycle();
            let timing = meter.time(|| {
                let Some((state, forces)) = inputs.next() else {
                    return Ok(());
                };
                dca(model, state, forces, &mut workspace).map(|_| ())
            })?;
            Ok(timing.map(|timing| Row {
                threads,
                error_forward: Some(forward),
                error_residual: Some(own),
                ..self.row("dca", &precision_name(&options), &timing)
            }))
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build()?.install(measure)
    }

    /// Forward dynamics through the mass matrix. Error: against the reference.
    fn crba(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let mut workspace = Workspace::of_tree(&self.model, precision);
        let mut forward = 0.0_f64;
        for ((state, forces), exact) in self.inputs.iter().zip(self.reference()?) {
            let dense = crba_forward_dynamics(&self.model, state, forces, &mut workspace)?;
            forward = worst_of(forward, relative_error(&dense, exact));
        }
        let mut inputs = self.inputs.iter().cycle();
        let timing = meter.time(|| {
            let Some((state, forces)) = inputs.next() else {
                return Ok(());
            };
            crba_forward_dynamics(&self.model, state, forces, &mut workspace).map(|_| ())
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            ..self.row("crba", &precision.to_string(), &timing)
        }))
    }

    /// Inverse dynamics. Errors: against the reference; and the joint forces that come back from the
    /// accelerations they cause; both over the largest force, bias forces among them.
    fn rnea(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let mut workspace = Workspace::of_tree(&self.model, precision);
        let mut exact = Workspace::of_tree(&self.model, Precision::Reference);
        let still = vec![0.0; self.model.dof_count()];
        let (mut forward, mut own) = (0.0_f64, 0.0_f64);
        let accelerations = self.reference()?;
        for ((state, forces), qdd) in self.inputs.iter().zip(accelerations) {
            let model = &self.model;
            let bias = rnea(model, state, &still, forces, &mut exact)?.to_vec();
            let reference = rnea(model, state, qdd, forces, &mut exact)?;
            let tau = rnea(model, state, qdd, forces, &mut workspace)?;
            forward = worst_of(forward, difference(tau, reference, &bias));
            own = worst_of(own, difference(tau, &forces.joint, &bias));
        }
        let mut inputs = self.inputs.iter().zip(accelerations).cycle();
        let timing = meter.time(|| {
            let Some(((state, forces), qdd)) = inputs.next() else {
                return Ok(());
            };
            rnea(&self.model, state, qdd, forces, &mut workspace).map(|_| ())
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            error_residual: Some(own),
            ..self.row("rnea", &precision.to_string(), &timing)
        }))
    }

    /// A whole step, as the source measured it: forward dynamics, integration, and the places of
    /// bodies. Errors: rates after the step against accelerations of the reference; residual of the
    /// bodies' own equations.
    pub(super) fn step(
        &self,
        meter: &Meter,
        precision: Precision,
        read: Read,
    ) -> anyhow::Result<Option<Row>> {
        let model = &self.model;
        let mut workspace = Workspace::of_tree(model, precision);
        let (mut forward, mut own) = (0.0_f64, 0.0_f64);
        for (state, forces) in &self.inputs {
            aba(model, state, forces, &mut workspace)?;
            joint_wrenches(&mut workspace)?;
            own = worst_of(own, residual(model, state, forces, &workspace)?.by_body);
            let mut rates = Vec::new();
            for precision in [precision, Precision::Reference] {
                let mut simulation = self.simulation(precision, state, forces)?;
                simulation.step(STEP)?;
                rates.push(simulation.state()?.qd.clone());
            }
            forward = worst_of(forward, difference(&rates[0], &rates[1], &[]));
        }
        let mut simulations = Vec::new();
        for (state, forces) in &self.inputs {
            simulations.push((self.simulation(precision, state, forces)?, state));
        }
        let (mut turn, count) = (0, simulations.len());
        let timing = meter.time(|| {
            let (simulation, start) = &mut simulations[turn % count];
            turn += 1;
            // Back to the start now and then: no scene is stepped far from its random state, from which
            // the largest blow up within a few steps in f32.
            let steps = if model.bodies().len() > FEW_STEPS {
                1
            } else {
                64
            };
            if turn % (steps * count) < count {
                simulation.set_state(start.clone())?;
            }
            simulation.step(STEP)?;
            match read {
                Read::Nothing => Ok(()),
                Read::Last => simulation.pose(model.last_body()).map(|_| ()),
                Read::All => {
                    let mut bodies = model.body_ids();
                    bodies.try_for_each(|body| simulation.pose(body).map(|_| ()))
                }
            }
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            error_residual: Some(own),
            reference_time_s: self.published_step_s,
            ..self.row(read.method(), &precision.to_string(), &timing)
        }))
    }

    /// A simulation of the model from one of its inputs.
    ///
    /// # Errors
    /// If the input does not fit the model.
    pub fn simulation(
        &self,
        precision: Precision,
        state: &State,
        forces: &Forces,
    ) -> Result<Simulation, vertebra::Error> {
        let mut simulation = Simulation::new(self.model.clone())?.with_precision(precision)?;
        simulation.set_state(state.clone())?;
        *simulation.forces_mut() = forces.clone();
        Ok(simulation)
    }
}

/// The poses that are read after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Read {
    /// None.
    Nothing,
    /// That of the last body, for which all are computed.
    Last,
    /// That of every body.
    All,
}

impl Read {
    /// Name of a step that is followed by it.
    pub(super) const fn method(self) -> &'static str {
        match self {
            Self::Nothing => "step-no-pose",
            Self::Last => "step",
            Self::All => "step-all-poses",
        }
    }
}

/// Measures a row; gives none when interrupted.
type Run<'a> = Box<dyn FnOnce(&Meter) -> anyhow::Result<Option<Row>> + 'a>;

/// The precisions of chunks and tree whose result has this precision: what they lose most is lost
/// in the joins.
pub(super) fn trees(precision: Precision) -> Vec<DcaOptions> {
    let chunks: &[Precision] = match precision {
        Precision::F32 => &[Precision::F32, Precision::F64],
        Precision::F64 => &[Precision::F64],
        Precision::Reference => &[Precision::Reference],
    };
    let options = |&chunks| DcaOptions {
        chunks,
        tree: precision,
        ..DcaOptions::default()
    };
    chunks.iter().map(options).collect()
}

/// Name of the precisions of a tree: `f64`, or `f64/f32` for chunks in f64 and joins in f32.
pub(super) fn precision_name(DcaOptions { chunks, tree, .. }: &DcaOptions) -> String {
    if chunks == tree {
        tree.to_string()
    } else {
        format!("{chunks}/{tree}")
    }
}

/// Largest difference between two vectors of one length over the largest entry of both and of
/// `terms`: zero when they are equal, also when everything is zero, and NaN when an entry is.
fn difference(found: &[f64], reference: &[f64], terms: &[f64]) -> f64 {
    let differences = found.iter().zip(reference).map(|(a, b)| (a - b).abs());
    let largest = differences.fold(0.0, worst_of);
    if largest == 0.0 {
        return 0.0;
    }
    let entries = [found, reference, terms].into_iter().flatten();
    largest / entries.map(|entry| entry.abs()).fold(0.0, worst_of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_finite_whatever_is_zero() {
        assert_eq!(difference(&[1.0, 2.5], &[1.0, 2.0], &[]), 0.2);
        assert_eq!(difference(&[1.0, 2.5], &[1.0, 2.0], &[-5.0]), 0.1);
        assert_eq!(difference(&[0.0, 1e-3], &[0.0, 0.0], &[]), 1.0);
        assert_eq!(difference(&[0.0], &[0.0], &[0.0]), 0.0);
        assert_eq!(difference(&[], &[], &[]), 0.0);
        assert!(difference(&[f64::NAN], &[1.0], &[]).is_nan());
    }
}
