//! Radix sort of key-value pairs, least significant digit first (Merrill and Grimshaw 2011): for
//! each digit count, scan, scatter.
//!
//! Onesweep's single pass a digit (Adinets and Merrill 2022) waits for other workgroups, and WebGPU
//! does not promise that those make progress.

use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Device, Kernel, Recording, Slot, workgroups};

use crate::kernels::{SORT_COUNT, SORT_SCATTER, THREADS};
use crate::layout::Digit;
use crate::operator::Operator;
use crate::ranges::{Levels, length};
use crate::scan::{Scan, ScanKind};

/// The lanes that find equal digits together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// Each lane by itself, digits of 4 bits: runs everywhere.
    Lanes,
    /// Subgroups of 8 lanes at least and 32 at most, digits of 8 bits.
    Subgroups8,
    /// Subgroups of 32 lanes, digits of 8 bits.
    Subgroups32,
    /// Subgroups of 32 lanes at least and 128 at most, digits of 8 bits.
    Subgroups128,
}

impl Rows {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Lanes,
        Self::Subgroups8,
        Self::Subgroups32,
        Self::Subgroups128,
    ];

    /// The best that a device can do.
    #[must_use]
    pub fn on(device: &Device) -> Self {
        let subgroups = [Self::Subgroups32, Self::Subgroups8, Self::Subgroups128];
        let found = subgroups.into_iter().find(|rows| rows.fit(device));
        found.unwrap_or(Self::Lanes)
    }

    /// Whether a device has subgroups of these sizes, or none are needed.
    fn fit(self, device: &Device) -> bool {
        let info = device.info();
        let (least, most) = self.subgroup_sizes();
        self == Self::Lanes
            || device.features().contains(Features::SUBGROUP)
                && least <= info.subgroup_min_size
                && info.subgroup_max_size <= most
    }

    /// The smallest and the largest subgroups it is right for; any for lanes by themselves.
    #[must_use]
    pub fn subgroup_sizes(self) -> (u32, u32) {
        match self {
            Self::Lanes => (0, u32::MAX),
            Self::Subgroups8 => (8, 32),
            Self::Subgroups32 => (32, 32),
            Self::Subgroups128 => (32, 128),
        }
    }

    fn bits(self) -> u32 {
        if self == Self::Lanes { 4 } else { 8 }
    }

    /// Most rows of a workgroup.
    fn rows(self) -> u32 {
        match self {
            Self::Lanes => THREADS,
            Self::Subgroups8 => THREADS / 8,
            Self::Subgroups32 | Self::Subgroups128 => THREADS / 32,
        }
    }

    /// The parts that make it.
    fn parts(self) -> &'static [&'static str] {
        const NONE: &[&str] = &[
            include_str!("../wgsl/shared/peers_none.wgsl"),
            include_str!("../wgsl/shared/sort_main_none.wgsl"),
        ];
        const SUBGROUP: &str = include_str!("../wgsl/shared/peers_subgroup.wgsl");
        const MAIN: &str = include_str!("../wgsl/shared/sort_main_subgroup.wgsl");
        const UP_TO_32: &[&str] = &[SUBGROUP, MAIN, include_str!("../wgsl/shared/lanes_32.wgsl")];
        const UP_TO_128: &[&str] = &[
            SUBGROUP,
            MAIN,
            include_str!("../wgsl/shared/lanes_128.wgsl"),
        ];
        match self {
            Self::Lanes => NONE,
            Self::Subgroups8 | Self::Subgroups32 => UP_TO_32,
            Self::Subgroups128 => UP_TO_128,
        }
    }
}

/// Stable sort of key-value pairs of words by key.
#[derive(Clone, Debug)]
pub struct Sort {
    count: Kernel,
    scatter: Kernel,
    scan: Scan,
    rows: Rows,
    /// Keys of a lane.
    items: u32,
}

impl Sort {
    /// Numbers of keys a lane can hold.
    pub const ITEMS: [u32; 5] = [4, 8, 12, 16, 24];

    /// The sort as it is fastest on a device.
    #[must_use]
    pub fn on(device: &Device) -> Self {
        let items = Self::ITEMS.into_iter().rev();
        let shapes = items.filter(|items| *items <= MOST_ITEMS);
        let mut sorts = shapes.map(|items| Self::new(Rows::on(device), items));
        let found = sorts.find(|sort| sort.fits(device));
        found.unwrap_or_else(Self::portable)
    }

    /// Whether a device has the workgroup memory, the subgroups and the features for it.
    #[must_use]
    pub fn fits(&self, device: &Device) -> bool {
        self.scatter.workgroup_memory() <= device.limits().max_compute_workgroup_storage_size
            && self.rows.fit(device)
    }

    /// Its rows, and the number of keys a lane holds.
    #[must_use]
    pub fn shape(&self) -> (Rows, u32) {
        (self.rows, self.items)
    }

    /// The sort as it runs on every device.
    #[must_use]
    pub fn portable() -> Self {
        Self::new(Rows::Lanes, 4)
    }

    /// The sort in a shape of one's own: `items` of [`Sort::ITEMS`] keys a lane, or the next of them,
    /// or the last.
    #[must_use]
    pub fn new(rows: Rows, items: u32) -> Self {
        let [.., largest] = Self::ITEMS;
        let next = Self::ITEMS.into_iter().find(|known| *known >= items);
        let items = next.unwrap_or(largest);
        let shape = |kernel: Kernel| {
            let constants = [
                ("ITEMS", items),
                ("BITS", rows.bits()),
                ("ROWS", rows.rows()),
            ];
            let lines = constants.map(|(name, value)| format!("const {name}: u32 = {value}u;"));
            kernel.with_text(lines.join("\n"))
        };
        let count = shape(SORT_COUNT).workgroup_memory_of(4 << rows.bits());
        let mut scatter = shape(SORT_SCATTER).workgroup_memory_of(workgroup_memory(rows, items));
        for &part in rows.parts() {
            scatter = scatter.with(part);
        }
        if rows != Rows::Lanes {
            scatter = scatter.requires(Features::SUBGROUP);
        }
        Self {
            count,
            scatter,
            scan: Scan::new(&Operator::add_u32()),
            rows,
            items,
        }
    }

    /// Its kernels.
    pub(crate) fn kernels(&self) -> [&Kernel; 2] {
        [&self.count, &self.scatter]
    }

    /// Records sorting `keys`, and `values` with them, by the lowest `key_bits` bits of the keys
    /// (32 at most); pairs with equal bits keep their order. Both buffers have the same length.
    ///
    /// A driver whose subgroups do not fill a workgroup fails the stage `sort`;
    /// [`Sort::portable`] does without them.
    pub fn record(
        &self,
        recording: &mut Recording,
        keys: Slot<u32>,
        values: Slot<u32>,
        key_bits: u32,
    ) {
        self.record_passes(recording, [keys, values], key_bits, None);
    }

    /// [`Sort::record`] of the first `count[0]` pairs, a number that only the device need know; a
    /// larger one than there are pairs stands for all. The rest of both buffers stays.
    pub fn record_counted(
        &self,
        recording: &mut Recording,
        keys: Slot<u32>,
        values: Slot<u32>,
        key_bits: u32,
        count: Slot<u32>,
    ) {
        self.record_passes(recording, [keys, values], key_bits, Some(count));
    }

    fn record_passes(
        &self,
        recording: &mut Recording,
        pairs: [Slot<u32>; 2],
        key_bits: u32,
        count: Option<Slot<u32>>,
    ) {
        let len = length(recording, pairs[0]);
        let key_bits = key_bits.min(32);
        let bits = self.rows.bits();
        let passes = key_bits.div_ceil(bits);
        recording.scope("sort", |recording| {
            recording.require_same_len(pairs[0], pairs[1]);
            if len < 2 || passes == 0 {
                return;
            }
            let levels = Levels::record(recording, len, [THREADS * self.items, 1 << bits], count);
            let tiles = levels.most.level[0].tiles;
            let counts_len = levels.most.level[1].count as usize;
            let [counts, offsets] =
                ["counts", "offsets"].map(|name| recording.buffer::<u32>(name, counts_len));
            let spare = ["keys", "values"].map(|name| recording.buffer(name, len as usize));
            let (mut from, mut to) = (pairs, spare);
            // The last pass writes the buffers given, and of those only what counts.
            if passes % 2 == 1 {
                std::mem::swap(&mut from, &mut to);
                recording.copy(to[0], from[0]);
                recording.copy(to[1], from[1]);
            }
            let status = recording.status();
            let scatter = self
                .scatter
                .clone()
                .constant("STAGE", recording.stage("sort"));
            for pass in 0..passes {
                let shift = pass * bits;
                let mask = (1 << bits.min(key_bits - shift)) - 1;
                let digit = recording.buffer_from("digit", &[Digit { shift, mask }]);
                let groups = workgroups(tiles, 1);
                // Within a single tile the scatter counts by itself.
                if tiles > 1 {
                    let buffers = [levels.slot.any(), digit.any(), from[0].any(), counts.any()];
                    recording.dispatch(&self.count, &buffers, groups);
                    let kind = ScanKind::Exclusive;
                    recording.scope("scan", |recording| {
                        self.scan
                            .record_level(recording, &levels, 1, counts, offsets, kind);
                    });
                }
                let buffers = [
                    levels.slot.any(),
                    digit.any(),
                    from[0].any(),
                    from[1].any(),
                    offsets.any(),
                    to[0].any(),
                    to[1].any(),
                    status.any(),
                ];
                recording.dispatch(&scatter, &buffers, groups);
                std::mem::swap(&mut from, &mut to);
            }
        });
    }
}

/// More keys a lane gain nothing.
const MOST_ITEMS: u32 = 16;

/// Workgroup memory of the scatter \[byte\]: counters, starts and shifts of digits, the tile.
fn workgroup_memory(rows: Rows, items: u32) -> u32 {
    let bins = 1 << rows.bits();
    4 * (rows.rows() * bins / 2 + 2 * bins + THREADS * items)
}
