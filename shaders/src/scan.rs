//! Scan: reduce each tile, scan the totals, scan each tile from there.
//!
//! A single pass with look-back (Merrill and Garland 2016) would read everything once instead of
//! twice, but a workgroup that waits for another relies on progress that WebGPU does not promise.

use bytemuck::Pod;
use vertebra_gpu::{Kernel, Recording, Slot, workgroups};

use crate::kernels::{LOAD, Operator, REDUCE_TILES, SCAN_TILES, TILE};
use crate::layout::Range;

/// Whether an element counts into its own sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScanKind {
    /// All before it; the identity first.
    Exclusive,
    /// All before it, and itself.
    Inclusive,
}

/// Sums of all elements before each one, for any [`Operator`].
#[derive(Clone, Debug)]
pub struct Scan {
    /// Of the elements as they are loaded.
    reduce: Kernel,
    scan: Kernel,
    /// Of totals.
    plain_reduce: Kernel,
    plain_scan: Kernel,
}

impl Scan {
    /// A scan with this operation.
    #[must_use]
    pub fn new(operator: &Operator) -> Self {
        Self::with_load(operator, LOAD)
    }

    /// A scan of what `load` makes of the elements.
    pub(crate) fn with_load(operator: &Operator, load: &'static str) -> Self {
        let reduce = operator.complete(&REDUCE_TILES, &["data", "totals"]);
        let scan = operator.complete(&SCAN_TILES, &["data", "before", "result"]);
        Self {
            plain_reduce: reduce.clone().with(LOAD),
            plain_scan: scan.clone().with(LOAD),
            reduce: reduce.with(load),
            scan: scan.with(load),
        }
    }

    /// Records the scan of `data` into `result`, which has the same length and is another buffer.
    pub fn record<T: Pod>(
        &self,
        recording: &mut Recording,
        data: Slot<T>,
        result: Slot<T>,
        kind: ScanKind,
    ) {
        recording.scope("scan", |recording| {
            let kernels = [&self.reduce, &self.scan];
            self.level(recording, kernels, data, result, kind);
        });
    }

    /// One level of totals; there is another while they are more than a tile.
    fn level<T: Pod>(
        &self,
        recording: &mut Recording,
        [reduce, scan]: [&Kernel; 2],
        data: Slot<T>,
        result: Slot<T>,
        kind: ScanKind,
    ) {
        let count = length(recording, data);
        let tiles = count.div_ceil(TILE);
        let range = recording.buffer_from("range", &[Range { count, tiles }]);
        let groups = workgroups(tiles, 1);
        let before = recording.buffer::<T>("before", tiles as usize);
        if tiles > 1 {
            let totals = recording.buffer::<T>("totals", tiles as usize);
            recording.dispatch(reduce, &[range.any(), data.any(), totals.any()], groups);
            let plain = [&self.plain_reduce, &self.plain_scan];
            self.level(recording, plain, totals, before, ScanKind::Exclusive);
        }
        if count > 0 {
            let inclusive = u8::from(kind == ScanKind::Inclusive);
            let kernel = scan.clone().constant("INCLUSIVE", inclusive);
            let buffers = [range.any(), data.any(), before.any(), result.any()];
            recording.dispatch(&kernel, &buffers, groups);
        }
    }
}

/// Length of a buffer for kernels that count in words; a longer one is refused for its size.
pub(crate) fn length<T>(recording: &Recording, slot: Slot<T>) -> u32 {
    let len = recording.len(slot).unwrap_or(0);
    u32::try_from(len).unwrap_or(u32::MAX)
}
