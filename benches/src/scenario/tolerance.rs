//! Rows of accelerations to a tolerance: the time it takes to meet it, whatever that needs, and the error then.

use super::Meter;
use super::model::Subject;
use crate::accuracy::entry::TOLERANCE;
use crate::row::Row;
use crate::suite::{relative_error, worst_of};
use anyhow::Context;
use vertebra::{Simulation, SolverOptions};
use vertebra_gpu::Device;

/// Name of the rows.
pub(super) const METHOD: &str = "tolerance-1e-10";

impl Subject {
    /// Accelerations to a tolerance, on one thread or on a device from state and forces on the host to accelerations there, by
    /// the clock on the wall. The error is against the reference, the residual the solver's own; a note says what was taken.
    pub(super) fn to_tolerance(
        &self,
        meter: &Meter,
        device: Option<&Device>,
    ) -> anyhow::Result<Option<Row>> {
        let model = self.model.clone();
        let simulation = match device {
            Some(device) => Simulation::on(&device.clone().into(), model)?,
            None => Simulation::new(model)?,
        };
        let options = SolverOptions {
            parallel: false,
            ..SolverOptions::to_tolerance(TOLERANCE)
        };
        let mut simulation = simulation.with_solver(&options)?;
        let (mut forward, mut own) = (0.0_f64, 0.0_f64);
        let mut taken: Vec<String> = Vec::new();
        for ((state, forces), exact) in self.inputs.iter().zip(self.reference()?) {
            simulation.set_state(state.clone())?;
            simulation.forces_mut().clone_from(forces);
            forward = worst_of(forward, relative_error(&simulation.accelerations()?, exact));
            let achieved = simulation.achieved().context("no tolerance was met")?;
            own = worst_of(own, achieved.residual);
            let achieved = achieved.to_string();
            let (how, _) = achieved.split_once(':').unwrap_or((&achieved, ""));
            if !taken.iter().any(|other| other == how) {
                taken.push(how.to_owned());
            }
        }
        let mut inputs = self.inputs.iter().cycle();
        let timing = meter.time(|| {
            let Some((state, forces)) = inputs.next() else {
                return Ok(());
            };
            simulation.set_state(state.clone())?;
            simulation.forces_mut().clone_from(forces);
            simulation.accelerations().map(|_| ())
        })?;
        let row = timing.map(|timing| Row {
            error_forward: Some(forward),
            error_residual: Some(own),
            note: format!("taken: {}", taken.join("; ")),
            ..self.row(METHOD, "-", &timing)
        });
        Ok(row.map(|row| match device {
            None => row,
            Some(device) => Row {
                backend: "gpu".to_owned(),
                device: device.description(),
                ..row
            },
        }))
    }
}
