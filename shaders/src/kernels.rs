//! The kernels: their files, their bindings, and the parts they are joined with.

use vertebra_gpu::{Binding, Kernel, STATUS};

use crate::dca::Dca;
use crate::finite;
use crate::layout::{Bins, Digit, Lengths, Ranges};
use crate::operator::{Operator, Precision};
use crate::scan::Scan;
use crate::sort::{Rows, Sort};
use crate::twins;

/// Lanes of a workgroup.
pub(crate) const THREADS: u32 = 256;
/// Elements that a workgroup of [`REDUCE_TILES`] and [`SCAN_TILES`] takes.
pub(crate) const TILE: u32 = 1024;
/// Keys that a workgroup of [`HISTOGRAM`] takes.
pub(crate) const HISTOGRAM_TILE: u32 = 4096;

const SIZE: [u32; 3] = [THREADS, 1, 1];
const RANGES: &str = include_str!("../wgsl/shared/ranges.wgsl");
const TILE_PART: &str = include_str!("../wgsl/shared/tile.wgsl");

/// Elements as they are.
pub(crate) const LOAD: &str = include_str!("../wgsl/shared/load.wgsl");
/// Elements as flags.
pub(crate) const LOAD_FLAG: &str = include_str!("../wgsl/shared/load_flag.wgsl");

/// Needs an operator and a way to load.
pub(crate) const REDUCE_TILES: Kernel = Kernel::new(
    "reduce_tiles",
    &[include_str!("../wgsl/reduce_tiles.wgsl"), RANGES, TILE_PART],
    &[
        Binding::uniform::<Ranges>("ranges"),
        Binding::uniform::<u32>("level"),
        Binding::read::<u32>("data"),
        Binding::read_write::<u32>("totals"),
    ],
    SIZE,
);

/// Needs an operator and a way to load.
pub(crate) const SCAN_TILES: Kernel = Kernel::new(
    "scan_tiles",
    &[include_str!("../wgsl/scan_tiles.wgsl"), RANGES, TILE_PART],
    &[
        Binding::uniform::<Ranges>("ranges"),
        Binding::uniform::<u32>("level"),
        Binding::read::<u32>("data"),
        Binding::read::<u32>("before"),
        Binding::read_write::<u32>("result"),
    ],
    SIZE,
);

pub(crate) const SET_RANGES: Kernel = Kernel::new(
    "set_ranges",
    &[include_str!("../wgsl/set_ranges.wgsl"), RANGES],
    &[
        Binding::uniform::<Lengths>("lengths"),
        Binding::read::<u32>("count"),
        Binding::read_write::<Ranges>("ranges"),
    ],
    [1, 1, 1],
);

pub(crate) const COMPACT: Kernel = Kernel::new(
    "compact",
    &[
        include_str!("../wgsl/compact.wgsl"),
        RANGES,
        LOAD_FLAG,
        include_str!("../wgsl/shared/add_u32.wgsl"),
    ],
    &[
        Binding::uniform::<Ranges>("ranges"),
        Binding::read::<u32>("data"),
        Binding::read::<u32>("places"),
        Binding::read::<u32>("values"),
        Binding::read_write::<u32>("kept"),
        Binding::read_write::<u32>("kept_count"),
    ],
    SIZE,
);

pub(crate) const HISTOGRAM: Kernel = Kernel::new(
    "histogram",
    &[include_str!("../wgsl/histogram.wgsl"), STATUS],
    &[
        Binding::uniform::<Bins>("range"),
        Binding::read::<u32>("keys"),
        Binding::read_write::<u32>("counts"),
        Binding::read_write::<u32>("status"),
    ],
    SIZE,
)
.workgroup_memory_of(4 * 2048);

/// Needs a type of numbers.
pub(crate) const FINITE: Kernel = Kernel::new(
    "finite",
    &[include_str!("../wgsl/finite.wgsl"), STATUS],
    &[
        Binding::uniform::<u32>("count"),
        Binding::read::<u32>("data"),
        Binding::read_write::<u32>("status"),
    ],
    SIZE,
);

/// Needs the shape of the sort.
pub(crate) const SORT_COUNT: Kernel = Kernel::new(
    "sort_count",
    &[
        include_str!("../wgsl/sort_count.wgsl"),
        RANGES,
        include_str!("../wgsl/shared/sort.wgsl"),
    ],
    &[
        Binding::uniform::<Ranges>("ranges"),
        Binding::uniform::<Digit>("digit"),
        Binding::read::<u32>("keys"),
        Binding::read_write::<u32>("counts"),
    ],
    SIZE,
);

/// Needs the shape of the sort.
pub(crate) const SORT_SCATTER: Kernel = Kernel::new(
    "sort_scatter",
    &[
        include_str!("../wgsl/sort_scatter.wgsl"),
        RANGES,
        include_str!("../wgsl/shared/sort.wgsl"),
        STATUS,
    ],
    &[
        Binding::uniform::<Ranges>("ranges"),
        Binding::uniform::<Digit>("digit"),
        Binding::read::<u32>("keys"),
        Binding::read::<u32>("values"),
        Binding::read::<u32>("offsets"),
        Binding::read_write::<u32>("sorted_keys"),
        Binding::read_write::<u32>("sorted_values"),
        Binding::read_write::<u32>("status"),
    ],
    SIZE,
);

/// Every kernel as it can be dispatched, once for each precision and shape, with what it is.
pub static KERNELS: std::sync::LazyLock<Vec<(String, Kernel)>> = std::sync::LazyLock::new(|| {
    let mut kernels = Vec::new();
    let operators = [
        ("add_u32", Operator::add_u32()),
        ("affine", twins::affine_operator()),
        ("add f32", Operator::add(Precision::F32)),
        ("add f64", Operator::add(Precision::F64)),
    ];
    for (name, operator) in &operators {
        let reduce = operator.complete(&REDUCE_TILES, &["data", "totals"]);
        let scan = operator.complete(&SCAN_TILES, &["data", "before", "result"]);
        for kernel in [reduce, scan] {
            kernels.push((format!("{} {name}", kernel.name()), kernel.with(LOAD)));
        }
    }
    // The scan of a compaction.
    for kernel in Scan::with_load(&Operator::add_u32(), LOAD_FLAG).kernels() {
        kernels.push((format!("{} flags", kernel.name()), kernel.clone()));
    }
    for rows in Rows::ALL {
        for items in Sort::ITEMS {
            let sort = Sort::new(rows, items);
            for kernel in sort.kernels() {
                let name = format!("{} {rows:?} {items}", kernel.name());
                kernels.push((name, kernel.clone()));
            }
        }
    }
    kernels.push(("finite f32".to_owned(), finite::kernel::<f32>()));
    kernels.push(("finite f64".to_owned(), finite::kernel::<f64>()));
    let others = [SET_RANGES, COMPACT, HISTOGRAM];
    kernels.extend(others.map(|kernel| (kernel.name().to_owned(), kernel)));
    kernels.extend(crate::batch::all());
    kernels.extend(Dca::all());
    kernels.extend(crate::collision::kernels());
    kernels
});
