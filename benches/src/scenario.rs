//! What is measured: the source's two scenarios; batches of robots; tests of two triangles where they
//! err, and meshes of millions of triangles; every other question about meshes; and the user's own files put through the same rows.
//!
//! A scenario is a list of [`Measurement`]s, each of which becomes one row.

pub mod batch;
pub mod batch_gpu;
pub mod chain;
pub mod chunks;
pub mod clipping;
pub mod closeness;
mod derivatives;
mod edits;
pub mod error_inputs;
pub mod error_table;
pub mod gpu;
pub mod joints;
pub mod joints_gpu;
pub mod loops;
pub mod meshes;
pub mod model;
pub mod needs;
pub mod published;
pub mod queries;
pub mod reference;
mod refined;
pub mod scaling;
pub mod separating_axes;
pub mod tableware;
mod tolerance;

use crate::interrupt::Interrupt;
use crate::measure::{Budget, Timing, try_sample};
use crate::row::Row;
use vertebra::Precision;

/// What to measure, as asked for on the command line.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Methods asked for by name or by the part before the first `-`; empty for all.
    pub methods: Vec<String>,
    /// Precisions asked for; empty for all.
    pub precisions: Vec<Precision>,
    /// Sizes asked for; empty for the scenario's own.
    pub sizes: Vec<usize>,
    /// Numbers of threads; empty for one and all.
    pub threads: Vec<usize>,
    /// Seed of everything random.
    pub seed: u64,
    /// Whether to leave out what takes long.
    pub quick: bool,
}

impl Selection {
    /// Whether a method is asked for.
    #[must_use]
    pub fn wants(&self, method: &str) -> bool {
        let family = method.split('-').next().unwrap_or(method);
        self.methods.is_empty() || self.methods.iter().any(|m| m == method || m == family)
    }

    /// The precisions asked for.
    #[must_use]
    pub fn precisions(&self) -> Vec<Precision> {
        if self.precisions.is_empty() {
            vec![Precision::F64, Precision::F32]
        } else {
            self.precisions.clone()
        }
    }

    /// The numbers of threads to compute with: those asked for, or one and all. None is more than
    /// there are, so that a row names the threads it had.
    #[must_use]
    pub fn threads(&self) -> Vec<usize> {
        let all = rayon::current_num_threads();
        let asked: &[usize] = if self.threads.is_empty() {
            &[1, all]
        } else {
            &self.threads
        };
        let mut threads = Vec::new();
        for count in asked.iter().map(|count| (*count).clamp(1, all)) {
            if !threads.contains(&count) {
                threads.push(count);
            }
        }
        threads
    }
}

/// How to measure.
#[derive(Clone, Debug)]
pub struct Meter {
    /// How long.
    pub budget: Budget,
    /// Until when.
    pub interrupt: Interrupt,
}

impl Meter {
    /// Times a call that may fail; none when interrupted.
    ///
    /// # Errors
    /// The call's.
    pub fn time<T, E>(&self, call: impl FnMut() -> Result<T, E>) -> Result<Option<Timing>, E> {
        try_sample(&self.budget, &self.interrupt, call)
    }
}

/// One row to be measured.
pub struct Measurement<'a> {
    /// What it is, for the progress bar.
    pub label: String,
    run: Run<'a>,
}

/// Measures a row; gives none when interrupted.
type Run<'a> = Box<dyn FnOnce(&Meter) -> anyhow::Result<Option<Row>> + 'a>;

impl<'a> Measurement<'a> {
    /// A row that `run` measures; it gives none when interrupted.
    pub fn new(
        label: impl Into<String>,
        run: impl FnOnce(&Meter) -> anyhow::Result<Option<Row>> + 'a,
    ) -> Self {
        Self {
            label: label.into(),
            run: Box::new(run),
        }
    }

    /// Measures the row; none when interrupted.
    ///
    /// # Errors
    /// What the measured method refuses.
    pub fn run(self, meter: &Meter) -> anyhow::Result<Option<Row>> {
        (self.run)(meter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_threads_than_there_are() {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(3)
            .build()
            .unwrap();
        let threads = |asked: &[usize]| {
            let selection = Selection {
                methods: Vec::new(),
                precisions: Vec::new(),
                sizes: Vec::new(),
                threads: asked.to_vec(),
                seed: 1,
                quick: true,
            };
            pool.install(|| selection.threads())
        };
        assert_eq!(threads(&[]), [1, 3]);
        assert_eq!(threads(&[2]), [2]);
        assert_eq!(threads(&[4, 1, 1024, 3]), [3, 1]);
    }
}
