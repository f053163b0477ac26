//! Radix sort of key-value pairs, least significant digit first (Merrill and Grimshaw 2011): for
//! each digit count, scan, scatter.
//!
//! Onesweep's single pass a digit (Adinets and Merrill 2022) waits for other workgroups, and WebGPU
//! does not promise that those make progress.

use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Device, Kernel, Recording, Slot, workgroups};

use crate::kernels::{Operator, SORT_COUNT, SORT_SCATTER, THREADS};
use crate::layout::Pass;
use crate::scan::{Scan, ScanKind, length};

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
        let info = device.info();
        let fits = |rows: &Self| {
            let (least, most) = rows.subgroup_sizes();
            least <= info.subgroup_min_size && info.subgroup_max_size <= most
        };
        let subgroups = [Self::Subgroups32, Self::Subgroups8, Self::Subgroups128];
        let found = subgroups.into_iter().find(fits);
        match found {
            Some(rows) if device.features().contains(Features::SUBGROUP) => rows,
            _ => Self::Lanes,
        }
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

    /// Number of rows and bits of a digit, for the shaders.
    fn constants(self) -> &'static str {
        match self {
            Self::Lanes => "const BITS: u32 = 4u;\nconst ROWS: u32 = 256u;",
            Self::Subgroups8 => "const BITS: u32 = 8u;\nconst ROWS: u32 = 32u;",
            Self::Subgroups32 | Self::Subgroups128 => {
                "const BITS: u32 = 8u;\nconst ROWS: u32 = 8u;"
            }
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
    /// Keys of a workgroup.
    tile: u32,
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
        let info = device.info();
        let (least, most) = self.rows.subgroup_sizes();
        self.scatter.workgroup_memory() <= device.limits().max_compute_workgroup_storage_size
            && device.features().contains(self.scatter.features())
            && (self.rows == Rows::Lanes
                || least <= info.subgroup_min_size && info.subgroup_max_size <= most)
    }

    /// The sort as it runs on every device.
    #[must_use]
    pub fn portable() -> Self {
        Self::new(Rows::Lanes, 4)
    }

    /// The sort in a shape of one's own: `items` of [`Sort::ITEMS`] keys a lane, or the nearest.
    #[must_use]
    pub fn new(rows: Rows, items: u32) -> Self {
        let (items, part) = match items {
            0..=4 => (4, "const ITEMS: u32 = 4u;"),
            5..=8 => (8, "const ITEMS: u32 = 8u;"),
            9..=12 => (12, "const ITEMS: u32 = 12u;"),
            13..=16 => (16, "const ITEMS: u32 = 16u;"),
            _ => (24, "const ITEMS: u32 = 24u;"),
        };
        let shape = |kernel: Kernel| kernel.with(part).with(rows.constants());
        let count = shape(SORT_COUNT).workgroup_memory_of(4 << rows.bits());
        let mut scatter = shape(SORT_SCATTER).workgroup_memory_of(workgroup_memory(rows, items));
        for part in rows.parts() {
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
            tile: THREADS * items,
        }
    }

    /// Its kernels.
    pub(crate) fn kernels(&self) -> [&Kernel; 2] {
        [&self.count, &self.scatter]
    }

    /// Records sorting `keys`, and `values` with them, by the lowest `key_bits` bits of the keys
    /// (32 at most); pairs with equal bits keep their order. Both buffers have the same length.
    pub fn record(
        &self,
        recording: &mut Recording,
        keys: Slot<u32>,
        values: Slot<u32>,
        key_bits: u32,
    ) {
        let count = length(recording, keys);
        let key_bits = key_bits.min(32);
        let bits = self.rows.bits();
        let passes = key_bits.div_ceil(bits);
        if count < 2 || passes == 0 {
            return;
        }
        recording.scope("sort", |recording| {
            let len = count as usize;
            let mut from = [keys, values];
            let mut to = ["keys", "values"].map(|name| recording.buffer::<u32>(name, len));
            let tiles = count.div_ceil(self.tile);
            let counts_len = (tiles as usize) << bits;
            let counts = recording.buffer::<u32>("counts", counts_len);
            let offsets = recording.buffer::<u32>("offsets", counts_len);
            for pass in 0..passes {
                let shift = pass * bits;
                let fields = Pass {
                    count,
                    tiles,
                    shift,
                    mask: (1 << bits.min(key_bits - shift)) - 1,
                };
                let fields = recording.buffer_from("pass", &[fields]);
                let groups = workgroups(tiles, 1);
                // Within a single tile the scatter counts by itself.
                if tiles > 1 {
                    let buffers = [fields.any(), from[0].any(), counts.any()];
                    recording.dispatch(&self.count, &buffers, groups);
                    self.scan
                        .record(recording, counts, offsets, ScanKind::Exclusive);
                }
                let buffers = [
                    fields.any(),
                    from[0].any(),
                    from[1].any(),
                    offsets.any(),
                    to[0].any(),
                    to[1].any(),
                ];
                recording.dispatch(&self.scatter, &buffers, groups);
                std::mem::swap(&mut from, &mut to);
            }
            if passes % 2 == 1 {
                recording.copy(from[0], keys);
                recording.copy(from[1], values);
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
