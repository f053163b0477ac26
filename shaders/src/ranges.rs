//! How many elements each level of a primitive works on: known to the host, or to the device alone.

use bytemuck::Zeroable;
use vertebra_gpu::{Recording, Slot};

use crate::kernels::{SET_RANGES, TILE};
use crate::layout::{Lengths, Range, Ranges};

/// The ranges of a primitive in a buffer, and those for full buffers: what is dispatched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levels {
    /// What the kernels read.
    pub(crate) slot: Slot<Ranges>,
    /// The most that they may be.
    pub(crate) most: Ranges,
}

impl Levels {
    /// Levels of tiles of `tile` elements, each of which makes `per_tile` elements of the second
    /// level. Without a `count` on the device, all `len` elements there is room for.
    pub(crate) fn record(
        recording: &mut Recording,
        len: u32,
        [tile, per_tile]: [u32; 2],
        count: Option<Slot<u32>>,
    ) -> Self {
        let lengths = Lengths {
            most: len,
            tile,
            per_tile,
            further_tile: TILE,
        };
        let most = ranges(lengths, len);
        let Some(count) = count else {
            let slot = recording.buffer_from("ranges", &[most]);
            return Self { slot, most };
        };
        recording.require_len(count, 1);
        let slot = recording.buffer::<Ranges>("ranges", 1);
        let lengths = recording.buffer_from("lengths", &[lengths]);
        let buffers = [lengths.any(), count.any(), slot.any()];
        recording.dispatch(&SET_RANGES, &buffers, [1, 1, 1]);
        Self { slot, most }
    }
}

/// What the kernel `set_ranges` computes.
fn ranges(lengths: Lengths, count: u32) -> Ranges {
    let mut ranges = Ranges::zeroed();
    let mut count = count.min(lengths.most);
    let (mut tile, mut per_tile) = (lengths.tile, lengths.per_tile);
    for level in &mut ranges.level {
        let tiles = count.div_ceil(tile);
        *level = Range {
            count,
            tiles,
            unused: [0; 2],
        };
        // Beyond the words of a device there is no buffer either.
        count = tiles.saturating_mul(per_tile);
        (tile, per_tile) = (lengths.further_tile, 1);
    }
    ranges
}

/// Length of a buffer for kernels that count in words; a longer one is refused for its size.
pub(crate) fn length<T>(recording: &Recording, slot: Slot<T>) -> u32 {
    let len = recording.len(slot).unwrap_or(0);
    u32::try_from(len).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_level_is_a_single_tile() {
        // The most elements, in the smallest tiles with the most digits.
        for [tile, per_tile] in [[1024, 1], [1024, 256], [1024, 16], [6144, 256]] {
            for len in [0, 1, 1024, 1025, 1 << 20, (1 << 31) + 1] {
                let lengths = Lengths {
                    most: len,
                    tile,
                    per_tile,
                    further_tile: TILE,
                };
                let found = ranges(lengths, u32::MAX);
                assert!(found.level[3].tiles <= 1, "{found:?}");
                assert_eq!(found.level[0].count, len);
                let factors = [per_tile, 1, 1];
                for ((level, next), factor) in
                    found.level.iter().zip(&found.level[1..]).zip(factors)
                {
                    assert_eq!(next.count, level.tiles * factor);
                }
            }
        }
    }
}
