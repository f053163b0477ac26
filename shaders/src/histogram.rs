//! Histogram.

use vertebra_gpu::{Recording, Slot, Stage, workgroups};

use crate::kernels::{HISTOGRAM, HISTOGRAM_TILE};
use crate::layout::Bins;
use crate::ranges::length;

/// Records counting how often each key occurs: `counts[key]`. A key beyond the counts is a failure
/// of `stage`, named by its index.
pub fn histogram(recording: &mut Recording, stage: Stage, keys: Slot<u32>, counts: Slot<u32>) {
    recording.scope("histogram", |recording| {
        recording.clear(counts);
        let (count, bins) = (length(recording, keys), length(recording, counts));
        if count == 0 {
            return;
        }
        let status = recording.status();
        let range = recording.buffer_from("range", &[Bins { count, bins }]);
        let buffers = [range.any(), keys.any(), counts.any(), status.any()];
        let kernel = HISTOGRAM.constant("STAGE", stage);
        recording.dispatch(&kernel, &buffers, workgroups(count, HISTOGRAM_TILE));
    });
}
