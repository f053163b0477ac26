//! Compaction.

use vertebra_gpu::{Recording, Slot, workgroups};

use crate::kernels::{COMPACT, LOAD_FLAG, Operator, THREADS};
use crate::layout::Range;
use crate::scan::{Scan, ScanKind, length};

/// Records writing those `values` whose flag is not zero to the front of `kept`, in their order,
/// and how many they are to the single element of `kept_count`. `flags`, `values` and `kept` have
/// the same length; what stands behind the kept values in `kept` stays.
pub fn compact(
    recording: &mut Recording,
    flags: Slot<u32>,
    values: Slot<u32>,
    kept: Slot<u32>,
    kept_count: Slot<u32>,
) {
    recording.scope("compact", |recording| {
        recording.clear(kept_count);
        let count = length(recording, flags);
        if count == 0 {
            return;
        }
        let places = recording.buffer::<u32>("places", count as usize);
        let scan = Scan::with_load(&Operator::add_u32(), LOAD_FLAG);
        scan.record(recording, flags, places, ScanKind::Exclusive);
        let range = recording.buffer_from("range", &[Range { count, tiles: 0 }]);
        let buffers = [
            range.any(),
            flags.any(),
            places.any(),
            values.any(),
            kept.any(),
            kept_count.any(),
        ];
        recording.dispatch(&COMPACT, &buffers, workgroups(count, THREADS));
    });
}
