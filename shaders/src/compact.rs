//! Compaction.

use vertebra_gpu::{Recording, Slot, workgroups};

use crate::kernels::{COMPACT, LOAD_FLAG, THREADS, TILE};
use crate::operator::Operator;
use crate::ranges::{Levels, length};
use crate::scan::{Scan, ScanKind};

/// Records writing those `values` whose flag is not zero to the front of `kept`, in their order,
/// and how many they are to the first element of `kept_count`. `flags`, `values` and `kept` have
/// the same length; what stands behind the kept values in `kept` stays.
pub fn compact(
    recording: &mut Recording,
    flags: Slot<u32>,
    values: Slot<u32>,
    kept: Slot<u32>,
    kept_count: Slot<u32>,
) {
    record(recording, [flags, values, kept], kept_count, None);
}

/// [`compact`] of the first `count[0]` values, a number that only the device need know; a larger one
/// than there are values stands for all. `kept_count` may be the same buffer.
pub fn compact_counted(
    recording: &mut Recording,
    flags: Slot<u32>,
    values: Slot<u32>,
    kept: Slot<u32>,
    kept_count: Slot<u32>,
    count: Slot<u32>,
) {
    record(recording, [flags, values, kept], kept_count, Some(count));
}

fn record(
    recording: &mut Recording,
    [flags, values, kept]: [Slot<u32>; 3],
    kept_count: Slot<u32>,
    count: Option<Slot<u32>>,
) {
    recording.scope("compact", |recording| {
        recording.require_same_len(flags, values);
        recording.require_same_len(flags, kept);
        recording.require_len(kept_count, 1);
        let len = length(recording, flags);
        let levels = Levels::record(recording, len, [TILE, 1], count);
        recording.clear(kept_count);
        if len == 0 {
            return;
        }
        let places = recording.buffer::<u32>("places", len as usize);
        let scan = Scan::with_load(&Operator::add_u32(), LOAD_FLAG);
        scan.record_level(recording, &levels, 0, flags, places, ScanKind::Exclusive);
        let buffers = [
            levels.slot.any(),
            flags.any(),
            places.any(),
            values.any(),
            kept.any(),
            kept_count.any(),
        ];
        recording.dispatch(&COMPACT, &buffers, workgroups(len, THREADS));
    });
}
