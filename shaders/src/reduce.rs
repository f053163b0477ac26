//! Reduction: tiles, then tiles of their totals.

use bytemuck::Pod;
use vertebra_gpu::{Kernel, Recording, Slot, workgroups};

use crate::kernels::{LOAD, REDUCE_TILES, TILE};
use crate::operator::Operator;
use crate::ranges::{Levels, length};

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

    /// Records the sum of `data` into the first element of `result`; the identity if there is
    /// nothing.
    pub fn record<T: Pod>(&self, recording: &mut Recording, data: Slot<T>, result: Slot<T>) {
        self.record_levels(recording, data, result, None);
    }

    /// [`Reduce::record`] of the first `count[0]` elements, a number that only the device need
    /// know; a larger one than there are elements stands for all.
    pub fn record_counted<T: Pod>(
        &self,
        recording: &mut Recording,
        data: Slot<T>,
        result: Slot<T>,
        count: Slot<u32>,
    ) {
        self.record_levels(recording, data, result, Some(count));
    }

    fn record_levels<T: Pod>(
        &self,
        recording: &mut Recording,
        mut data: Slot<T>,
        result: Slot<T>,
        count: Option<Slot<u32>>,
    ) {
        recording.scope("reduce", |recording| {
            recording.require_len(result, 1);
            let len = length(recording, data);
            let levels = Levels::record(recording, len, [TILE, 1], count);
            for (number, range) in (0_u32..).zip(&levels.most.level) {
                // Of nothing there is one total all the same.
                let tiles = range.tiles.max(1);
                let number = recording.buffer_from("level", &[number]);
                let totals = if tiles == 1 {
                    result
                } else {
                    recording.buffer("totals", tiles as usize)
                };
                let buffers = [levels.slot.any(), number.any(), data.any(), totals.any()];
                recording.dispatch(&self.kernel, &buffers, workgroups(tiles, 1));
                if tiles == 1 {
                    return;
                }
                data = totals;
            }
        });
    }
}
