//! Rows of one articulated model: forward and inverse dynamics, and a whole step.

use super::{Measurement, Meter, Selection};
use crate::row::Row;
use crate::suite::worst_of;
use vertebra::{
    Forces, Model, Precision, Random, Simulation, State, Workspace, Wrench, aba,
    crba_forward_dynamics, forward_error, joint_wrenches, residual, rnea,
};

/// Random inputs a row is measured on, in turn; its error is the largest over them.
const CASES: usize = 10;

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
}

impl Subject {
    /// Random inputs for a model.
    #[must_use]
    pub fn new(scenario: &str, model: Model, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let bodies: Vec<_> = model.body_ids().collect();
        let inputs = (0..CASES as u64)
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
        }
    }

    /// The rows asked for.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        let mut add = |method: &str, precision, run: Run| {
            if selection.wants(method) {
                let label = format!(
                    "{} {} bodies: {method} {precision}",
                    self.scenario,
                    self.model.bodies().len()
                );
                list.push(Measurement::new(label, move |meter| {
                    run(self, meter, precision)
                }));
            }
        };
        for precision in selection.precisions() {
            add("aba", precision, Self::aba);
            add("rnea", precision, Self::rnea);
            add("step", precision, Self::step);
            let dense_limit = if selection.quick {
                DENSE_LIMIT / 2
            } else {
                DENSE_LIMIT
            };
            if precision == Precision::F64 && self.model.dof_count() <= dense_limit {
                add("crba", precision, Self::crba);
            }
        }
        list
    }

    fn row(&self, method: &str, precision: Precision, timing: &crate::measure::Timing) -> Row {
        let size = self.model.bodies().len() as u64;
        Row::new(
            &self.scenario,
            method,
            &precision.to_string(),
            size,
            "bodies",
            timing,
        )
    }

    /// Forward dynamics by the articulated-body algorithm. Errors: against the reference, and the
    /// residual of the bodies' own equations.
    fn aba(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let mut workspace = Workspace::new(&self.model, precision);
        let mut exact = Workspace::new(&self.model, Precision::Reference);
        let (mut forward, mut own) = (0.0_f64, 0.0_f64);
        for (state, forces) in &self.inputs {
            aba(&self.model, state, forces, &mut exact)?;
            let qdd = aba(&self.model, state, forces, &mut workspace)?;
            forward = worst_of(forward, forward_error(qdd, &exact)?);
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
            ..self.row("aba", precision, &timing)
        }))
    }

    /// Forward dynamics through the mass matrix. Error: against the reference.
    fn crba(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let mut workspace = Workspace::new(&self.model, precision);
        let mut exact = Workspace::new(&self.model, Precision::Reference);
        let mut forward = 0.0_f64;
        for (state, forces) in &self.inputs {
            let dense = crba_forward_dynamics(&self.model, state, forces, &mut workspace)?;
            aba(&self.model, state, forces, &mut exact)?;
            forward = worst_of(forward, forward_error(&dense, &exact)?);
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
            ..self.row("crba", precision, &timing)
        }))
    }

    /// Inverse dynamics. Errors: against the reference; and the joint forces that come back from the
    /// accelerations they cause; both over the largest force, bias forces among them.
    fn rnea(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let mut workspace = Workspace::new(&self.model, precision);
        let mut exact = Workspace::new(&self.model, Precision::Reference);
        let still = vec![0.0; self.model.dof_count()];
        let (mut forward, mut own) = (0.0_f64, 0.0_f64);
        let mut accelerations = Vec::new();
        for (state, forces) in &self.inputs {
            let model = &self.model;
            let qdd = aba(model, state, forces, &mut exact)?.to_vec();
            let bias = rnea(model, state, &still, forces, &mut exact)?.to_vec();
            let reference = rnea(model, state, &qdd, forces, &mut exact)?;
            let tau = rnea(model, state, &qdd, forces, &mut workspace)?;
            forward = worst_of(forward, difference(tau, reference, &bias));
            own = worst_of(own, difference(tau, &forces.joint, &bias));
            accelerations.push(qdd);
        }
        let mut inputs = self.inputs.iter().zip(&accelerations).cycle();
        let timing = meter.time(|| {
            let Some(((state, forces), qdd)) = inputs.next() else {
                return Ok(());
            };
            rnea(&self.model, state, qdd, forces, &mut workspace).map(|_| ())
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            error_residual: Some(own),
            ..self.row("rnea", precision, &timing)
        }))
    }

    /// A whole step, as the source measured it: forward dynamics, integration, and the place of every
    /// body. Errors: rates after the step against accelerations of the reference; residual of the
    /// bodies' own equations.
    fn step(&self, meter: &Meter, precision: Precision) -> anyhow::Result<Option<Row>> {
        let model = &self.model;
        let mut workspace = Workspace::new(model, precision);
        let (mut forward, mut own) = (0.0_f64, 0.0_f64);
        for (state, forces) in &self.inputs {
            aba(model, state, forces, &mut workspace)?;
            joint_wrenches(&mut workspace)?;
            own = worst_of(own, residual(model, state, forces, &workspace)?.by_body);
            let mut rates = Vec::new();
            for precision in [precision, Precision::Reference] {
                let mut simulation = self.simulation(precision, state, forces)?;
                simulation.step(STEP)?;
                rates.push(simulation.state().qd.clone());
            }
            forward = worst_of(forward, difference(&rates[0], &rates[1], &[]));
        }
        let mut simulations = Vec::new();
        for (state, forces) in &self.inputs {
            simulations.push((self.simulation(precision, state, forces)?, state));
        }
        let mut turn = 0;
        let timing = meter.time(|| {
            let (simulation, start) = &mut simulations[turn % CASES];
            turn += 1;
            // Back to the start now and then: no scene is stepped far from its random state.
            if turn % (64 * CASES) < CASES {
                simulation.set_state(start.clone())?;
            }
            simulation.step(STEP)?;
            simulation.pose(model.last_body())
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            error_residual: Some(own),
            reference_time_s: self.published_step_s,
            ..self.row("step", precision, &timing)
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

type Run = fn(&Subject, &Meter, Precision) -> anyhow::Result<Option<Row>>;

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
