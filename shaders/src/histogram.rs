//! Histogram.

use vertebra_gpu::{Recording, Slot, workgroups};

use crate::kernels::{HISTOGRAM, HISTOGRAM_TILE};
use crate::layout::Bins;
use crate::scan::length;

/// Records counting how often each key occurs: `counts[key]`. A key beyond the counts is a failure
/// of the stage `histogram`.
pub fn histogram(recording: &mut Recording, keys: Slot<u32>, counts: Slot<u32>) {
    let stage = recording.stage("histogram");
    let status = recording.status();
    recording.scope("histogram", |recording| {
        recording.clear(counts);
        let (count, bins) = (length(recording, keys), length(recording, counts));
        if count == 0 {
            return;
        }
        let range = recording.buffer_from("range", &[Bins { count, bins }]);
        let buffers = [range.any(), keys.any(), counts.any(), status.any()];
        let kernel = HISTOGRAM.constant("STAGE", stage);
        recording.dispatch(&kernel, &buffers, workgroups(count, HISTOGRAM_TILE));
    });
}
