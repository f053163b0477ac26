//! Reduction: tiles, then tiles of their totals.

use bytemuck::Pod;
use vertebra_gpu::{Kernel, Recording, Slot, workgroups};

use crate::kernels::{LOAD, Operator, REDUCE_TILES, TILE};
use crate::layout::Range;
use crate::scan::length;

/// The sum of all elements in their order, for any [`Operator`].
#[derive(Clone, Debug)]
pub struct Reduce {
    kernel: Kernel,
}

impl Reduce {
    /// A reduction with this operation.
    #[must_use]
    pub fn new(operator: &Operator) -> Self {
        let kernel = operator.complete(&REDUCE_TILES, &["data", "totals"]);
        Self {
            kernel: kernel.with(LOAD),
        }
    }

    /// Records the sum of `data` into the single element of `result`; the identity if there is
    /// nothing.
    pub fn record<T: Pod>(&self, recording: &mut Recording, data: Slot<T>, result: Slot<T>) {
        recording.scope("reduce", |recording| {
            let mut data = data;
            loop {
                let count = length(recording, data);
                let tiles = count.div_ceil(TILE).max(1);
                let range = recording.buffer_from("range", &[Range { count, tiles }]);
                let totals = if tiles == 1 {
                    result
                } else {
                    recording.buffer("totals", tiles as usize)
                };
                let buffers = [range.any(), data.any(), totals.any()];
                recording.dispatch(&self.kernel, &buffers, workgroups(tiles, 1));
                if tiles == 1 {
                    return;
                }
                data = totals;
            }
        });
    }
}
