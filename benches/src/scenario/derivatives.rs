//! Rows of first derivatives of dynamics.

use super::Meter;
use super::model::Subject;
use crate::row::Row;
use crate::suite::{relative_error, worst_of};
use vertebra::{Derivatives, Error, Forces, Precision, State, Workspace, aba_derivatives};

impl Subject {
    /// Derivatives of forward dynamics by positions, rates and joint forces. Error: the largest of the three
    /// matrices against the reference precision, each over its largest entry, of the first input.
    pub(super) fn derivatives(&self, meter: &Meter) -> anyhow::Result<Option<Row>> {
        let precision = Precision::F64;
        let mut forward = 0.0_f64;
        if let Some(first) = self.inputs.first() {
            let exact = self.differentiate(Precision::Reference, first)?;
            let found = self.differentiate(precision, first)?;
            for (found, exact) in found.iter().zip(&exact) {
                forward = worst_of(forward, relative_error(found, exact));
            }
        }
        let mut workspace = Workspace::of_tree(&self.model, precision);
        let mut out = Derivatives::new(&self.model);
        let mut inputs = self.inputs.iter().cycle();
        let timing = meter.time(|| {
            let Some((state, forces)) = inputs.next() else {
                return Ok(());
            };
            aba_derivatives(&self.model, state, forces, &mut workspace, &mut out)
        })?;
        Ok(timing.map(|timing| Row {
            error_forward: Some(forward),
            ..self.row("aba-derivatives", &precision.to_string(), &timing)
        }))
    }

    /// The three matrices, by columns.
    fn differentiate(
        &self,
        precision: Precision,
        (state, forces): &(State, Forces),
    ) -> Result<[Vec<f64>; 3], Error> {
        let mut workspace = Workspace::of_tree(&self.model, precision);
        let mut out = Derivatives::new(&self.model);
        aba_derivatives(&self.model, state, forces, &mut workspace, &mut out)?;
        Ok([&out.position, &out.rate, &out.drive].map(|matrix| {
            let columns = (0..matrix.ncols()).map(|column| matrix.col_as_slice(column));
            columns.flatten().copied().collect()
        }))
    }
}
