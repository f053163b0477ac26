//! Scan: reduce each tile, scan the totals, scan each tile from there.
//!
//! A single pass with look-back (Merrill and Garland 2016) would read everything once instead of
//! twice, but a workgroup that waits for another relies on progress that WebGPU does not promise.

use bytemuck::Pod;
use vertebra_gpu::{Kernel, Recording, Slot, workgroups};

use crate::kernels::{LOAD, REDUCE_TILES, SCAN_TILES, TILE};
use crate::operator::Operator;
use crate::ranges::{Levels, length};

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

    /// Its kernels for the elements as they are loaded.
    pub(crate) fn kernels(&self) -> [&Kernel; 2] {
        [&self.reduce, &self.scan]
    }

    /// Records the scan of `data` into `result`, which has the same length and is another buffer.
    pub fn record<T: Pod>(
        &self,
        recording: &mut Recording,
        data: Slot<T>,
        result: Slot<T>,
        kind: ScanKind,
    ) {
        self.begin(recording, data, result, kind, None);
    }

    /// [`Scan::record`] of the first `count[0]` elements, a number that only the device need know;
    /// a larger one than there are elements stands for all. The rest of `result` stays.
    pub fn record_counted<T: Pod>(
        &self,
        recording: &mut Recording,
        data: Slot<T>,
        result: Slot<T>,
        kind: ScanKind,
        count: Slot<u32>,
    ) {
        self.begin(recording, data, result, kind, Some(count));
    }

    fn begin<T: Pod>(
        &self,
        recording: &mut Recording,
        data: Slot<T>,
        result: Slot<T>,
        kind: ScanKind,
        count: Option<Slot<u32>>,
    ) {
        recording.scope("scan", |recording| {
            recording.require_same_len(data, result);
            let len = length(recording, data);
            let levels = Levels::record(recording, len, [TILE, 1], count);
            self.record_level(recording, &levels, 0, data, result, kind);
        });
    }

    /// Records one level and, while its tiles are more than one, those of their totals.
    pub(crate) fn record_level<T: Pod>(
        &self,
        recording: &mut Recording,
        levels: &Levels,
        level: u8,
        data: Slot<T>,
        result: Slot<T>,
        kind: ScanKind,
    ) {
        let tiles = levels.most.level[usize::from(level)].tiles;
        if tiles == 0 {
            return;
        }
        let number = recording.buffer_from("level", &[u32::from(level)]);
        let groups = workgroups(tiles, 1);
        let before = recording.buffer::<T>("before", tiles as usize);
        if tiles > 1 {
            let totals = recording.buffer::<T>("totals", tiles as usize);
            let buffers = [levels.slot.any(), number.any(), data.any(), totals.any()];
            recording.dispatch(&self.reduce, &buffers, groups);
            let totals_of = Self {
                reduce: self.plain_reduce.clone(),
                scan: self.plain_scan.clone(),
                ..self.clone()
            };
            let kind = ScanKind::Exclusive;
            totals_of.record_level(recording, levels, level + 1, totals, before, kind);
        }
        let inclusive = u8::from(kind == ScanKind::Inclusive);
        let kernel = self.scan.clone().constant("INCLUSIVE", inclusive);
        let buffers = [
            levels.slot.any(),
            number.any(),
            data.any(),
            before.any(),
            result.any(),
        ];
        recording.dispatch(&kernel, &buffers, groups);
    }
}
