//! Rows of solutions that are corrected once or twice: what a correction costs and what it gains.

use super::Meter;
use super::model::{Subject, precision_name};
use crate::row::Row;
use crate::suite::{relative_error, worst_of};
use vertebra::{
    DcaOptions, DcaWorkspace, Error, Forces, Model, Precision, Solved, State, Workspace, aba, dca,
    joint_wrenches, refine, residual,
};

/// A method and its memory.
enum Method {
    Aba(Box<Workspace>),
    Dca(Box<DcaWorkspace>),
}

impl Method {
    /// Solves and corrects so many times.
    fn solve(
        &mut self,
        (model, state, forces): (&Model, &State, &Forces),
        sweeps: usize,
    ) -> Result<&[f64], Error> {
        match self {
            Self::Aba(workspace) => {
                aba(model, state, forces, workspace)?;
                for _ in 0..sweeps {
                    refine(forces, &mut **workspace)?;
                }
                workspace.joint_accelerations()
            }
            Self::Dca(workspace) => {
                dca(model, state, forces, workspace)?;
                for _ in 0..sweeps {
                    refine(forces, &mut **workspace)?;
                }
                workspace.joint_accelerations()
            }
        }
    }

    fn residual(&mut self, model: &Model, state: &State, forces: &Forces) -> Result<f64, Error> {
        fn by_body(
            model: &Model,
            state: &State,
            forces: &Forces,
            solved: &impl Solved,
        ) -> Result<f64, Error> {
            residual(model, state, forces, solved).map(|residual| residual.by_body)
        }
        match self {
            Self::Aba(workspace) => {
                joint_wrenches(workspace)?;
                by_body(model, state, forces, &**workspace)
            }
            Self::Dca(workspace) => {
                workspace.compute_joint_wrenches(forces)?;
                by_body(model, state, forces, &**workspace)
            }
        }
    }
}

impl Subject {
    /// Forward dynamics with one correction or two, on one thread: by divide and conquer with these options,
    /// otherwise by the articulated-body algorithm in f64. Errors as without.
    pub(super) fn refined(
        &self,
        meter: &Meter,
        tree: Option<DcaOptions>,
        sweeps: usize,
    ) -> anyhow::Result<Option<Row>> {
        let model = &self.model;
        let (name, precision, mut method) = match tree {
            None => (
                if sweeps > 1 {
                    "aba-refined-2"
                } else {
                    "aba-refined"
                },
                Precision::F64.to_string(),
                Method::Aba(Box::new(Workspace::new(model, Precision::F64))),
            ),
            Some(options) => (
                if sweeps > 1 {
                    "dca-refined-2"
                } else {
                    "dca-refined"
                },
                precision_name(&options),
                Method::Dca(Box::new(DcaWorkspace::new(model, &options)?)),
            ),
        };
        let (mut forward, mut own) = (0.0_f64, 0.0_f64);
        for ((state, forces), exact) in self.inputs.iter().zip(self.reference()?) {
            let qdd = method.solve((model, state, forces), sweeps)?;
            forward = worst_of(forward, relative_error(qdd, exact));
            own = worst_of(own, method.residual(model, state, forces)?);
        }
        let mut inputs = self.inputs.iter().cycle();
        let timing = meter.time(|| {
            let Some((state, forces)) = inputs.next() else {
                return Ok(());
            };
            method.solve((model, state, forces), sweeps).map(|_| ())
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            error_residual: Some(own),
            ..self.row(name, &precision, &timing)
        }))
    }
}
