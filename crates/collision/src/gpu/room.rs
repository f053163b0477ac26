//! Room for what a search writes.

use vertebra_gpu::wgpu::Limits;
use vertebra_shaders::collision::{COUNTERS, RECORD};

use super::collider::{Resident, count};

/// Words of an entry of a queue, and of a hit.
pub(super) const ENTRY: usize = 3;

/// Room for a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Room {
    pub(super) jobs: u32,
    pub(super) groups: u32,
    /// Pairs of nodes of a level.
    pub(super) queue: u32,
    pub(super) hits: u32,
    pub(super) undecided: u32,
    /// Of the undecided, those left to the host once the device has settled what it can.
    pub(super) left: u32,
}

impl Room {
    /// A guess for meshes that meet: of surfaces that cross, each block near the crossing meets a few.
    pub(super) fn guess(jobs: u32, groups: u32, meshes: [&Resident; 2], most: &Self) -> Self {
        let blocks = meshes[0].blocks().saturating_add(meshes[1].blocks());
        Self {
            jobs,
            groups,
            queue: blocks.clamp(1024, most.queue.clamp(1024, 1 << 18)),
            hits: 2048,
            undecided: 256,
            left: 256,
        }
    }

    /// The longest lists that a kernel can be given.
    pub(super) fn most(limits: &Limits) -> Self {
        let bytes = limits
            .max_buffer_size
            .min(limits.max_storage_buffer_binding_size);
        let words = u32::try_from(bytes / 4).unwrap_or(u32::MAX);
        Self {
            jobs: u32::MAX,
            groups: u32::MAX,
            queue: (words / count(ENTRY)).min(1 << 25),
            hits: (words - count(COUNTERS)) / count(ENTRY),
            undecided: words / count(RECORD),
            left: words / count(RECORD),
        }
    }

    /// What holds both.
    pub(super) fn union(self, other: Self) -> Self {
        Self {
            jobs: self.jobs.max(other.jobs),
            groups: self.groups.max(other.groups),
            queue: self.queue.max(other.queue),
            hits: self.hits.max(other.hits),
            undecided: self.undecided.max(other.undecided),
            left: self.left.max(other.left),
        }
    }

    /// Whether lists of these lengths have room; `lists` says whether hits are a list.
    pub(super) fn holds(&self, counts: &Counts, lists: bool) -> bool {
        counts.queued <= self.queue
            && counts.undecided <= self.undecided
            && counts.left <= self.left
            && (!lists || counts.hits <= self.hits)
    }

    /// Room for these lengths, and for more, because more may come once a queue is long enough.
    pub(super) fn grown(&self, counts: &Counts, lists: bool, most: &Self) -> Self {
        let grown = |needed: u32, have: u32, most: u32| match needed {
            _ if needed <= have => have,
            _ => needed.max(have.saturating_mul(2)).min(most),
        };
        let hits = if lists { counts.hits } else { 0 };
        Self {
            queue: grown(counts.queued, self.queue, most.queue),
            hits: grown(hits, self.hits, most.hits),
            undecided: grown(counts.undecided, self.undecided, most.undecided),
            left: grown(counts.left, self.left, most.left),
            ..*self
        }
    }
}

/// What a run counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Counts {
    /// The longest queue of a level.
    pub(super) queued: u32,
    /// Pairs of blocks.
    pub(super) blocks: u32,
    pub(super) hits: u32,
    pub(super) undecided: u32,
    pub(super) left: u32,
}

impl Counts {
    /// From the counters of the device.
    pub(super) fn of(words: &[u32]) -> Option<Self> {
        let &[hits, blocks, undecided, left, ref above @ ..] = words.get(..COUNTERS)? else {
            return None;
        };
        Some(Self {
            queued: above.iter().fold(blocks, |most, level| most.max(*level)),
            blocks,
            hits,
            undecided,
            left,
        })
    }
}
