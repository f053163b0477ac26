//! What a batch is asked for, and how it is computed then.

use super::schedule::Schedule;
use super::tree::Tree;
use crate::gpu::check_bare;
use crate::{Algorithm, Integrator, Precision, cost};
use core::fmt;
use vertebra_assembly::Model;
use vertebra_shaders::BATCH_LANES;

/// What a [`Batch`](super::Batch) is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchOptions {
    /// Precision of everything on the device, the states too.
    pub precision: Precision,
    /// How steps are taken.
    pub integrator: Integrator,
    /// The algorithm: the articulated-body algorithm, a few lanes an item, for many small items; divide and
    /// conquer over all at once for few large ones. None for the one that is expected to be faster.
    pub algorithm: Option<Algorithm>,
    /// Lanes among which the articulated-body algorithm shares the bodies of an item out, 1, 2, 4 or 8; none
    /// for the number that is expected to be the fastest.
    pub lanes: Option<u32>,
}

/// How a [`Batch`](super::Batch) is computed, and why: printed, a sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatchChoice {
    /// The algorithm.
    pub algorithm: Algorithm,
    /// Whether it was asked for.
    pub forced: bool,
    /// Whether no other algorithm computes the model's loops or screws, or what acts in its joints, in batches on a GPU.
    pub only: bool,
    /// Lanes an item, of the articulated-body algorithm.
    pub lanes: u32,
    /// Expected time of accelerations by the articulated-body algorithm \[s\].
    pub aba_s: f64,
    /// Expected time of a step by divide and conquer \[s\].
    pub dca_s: f64,
}

impl BatchChoice {
    pub(super) fn of(model: &Model, items: usize, options: &BatchOptions) -> Self {
        let tree = Tree::new(model);
        let time = |lanes: u32| {
            let schedule = Schedule::new(&tree, lanes as usize);
            cost::gpu_batch(items, schedule.levels, lanes, schedule.handoff_count)
        };
        // The smaller number of equals.
        let faster = |best: u32, lanes| {
            if time(lanes) < time(best) {
                lanes
            } else {
                best
            }
        };
        let lanes = match options.lanes {
            Some(lanes) => lanes.clamp(1, 8).next_power_of_two(),
            None => BATCH_LANES.into_iter().fold(BATCH_LANES[0], faster),
        };
        let levels = Schedule::new(&tree, lanes as usize).levels;
        let bodies = model.bodies().len();
        let aba_s = cost::gpu_batch_time(items, bodies, levels);
        let dca_s = cost::gpu_forest(items, bodies, options.precision);
        let faster = if dca_s < aba_s {
            Algorithm::Dca
        } else {
            Algorithm::Aba
        };
        let is_bare = check_bare(model).is_ok();
        let forced = options.algorithm.is_some() || options.lanes.is_some();
        Self {
            // Lanes are of the recursion alone.
            algorithm: match (options.algorithm, options.lanes) {
                _ if items == 0 => Algorithm::Aba,
                (Some(asked), _) => asked,
                (None, Some(_)) => Algorithm::Aba,
                (None, None) if !is_bare => Algorithm::Dca,
                (None, None) => faster,
            },
            forced,
            only: !forced && !is_bare && items > 0,
            lanes,
            aba_s,
            dca_s,
        }
    }
}

impl fmt::Display for BatchChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.algorithm {
            Algorithm::Aba => write!(f, "aba on {} lanes an item", self.lanes)?,
            Algorithm::Dca => f.write_str("dca over all items")?,
        }
        let why = if self.forced {
            "as asked"
        } else if self.only {
            "which alone computes screws, loops and what acts in joints"
        } else {
            "expected to be faster"
        };
        let (aba, dca) = (1e3 * self.aba_s, 1e3 * self.dca_s);
        write!(f, ", {why}: aba {aba:.3} ms, dca {dca:.3} ms")
    }
}
