//! Scenario `chunks`: how long the chunks of an assembly tree should be. One chain, and divide and
//! conquer with windows from one joint, the classic tree, to 128.

use super::{Measurement, Meter, Selection, model};
use crate::row::Row;
use vertebra::DcaOptions;
use vertebra::generate::{self, Rod};
use vertebra::schedule::ScheduleOptions;

/// Name of the scenario on the command line.
pub const NAME: &str = "chunks";

/// Bodies of the chain.
const BODIES: usize = 2048;

/// Joints of a chunk, on average.
const WINDOWS: [usize; 8] = [1, 2, 4, 8, 16, 32, 64, 128];

/// The chain.
#[derive(Clone, Debug)]
pub struct Subject(model::Subject);

impl Subject {
    /// A random chain.
    ///
    /// # Errors
    /// None in practice: the chain can be built.
    pub fn new(seed: u64) -> anyhow::Result<Self> {
        let chain = generate::random_chain(BODIES, &Rod::default(), seed)?;
        let name = format!("chunks of a chain of {BODIES}");
        Ok(Self(model::Subject::new(&name, chain, seed)))
    }

    /// The rows asked for: a window each, on one thread.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        if !selection.wants("dca") {
            return list;
        }
        for options in selection.precisions().into_iter().flat_map(model::trees) {
            for window in WINDOWS {
                let label = format!(
                    "{} bodies in chunks of {window}: dca {}",
                    BODIES,
                    model::precision_name(&options)
                );
                let run = move |meter: &Meter| self.measure(meter, &options, window);
                list.push(Measurement::new(label, run));
            }
        }
        list
    }

    fn measure(
        &self,
        meter: &Meter,
        options: &DcaOptions,
        window: usize,
    ) -> anyhow::Result<Option<Row>> {
        let options = DcaOptions {
            schedule: Some(ScheduleOptions::with_window(window)),
            ..*options
        };
        let row = self.0.dca(meter, &options, 1)?;
        Ok(row.map(|row| Row {
            size: window as u64,
            size_unit: "joints a chunk".to_owned(),
            ..row
        }))
    }
}
