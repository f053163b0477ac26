//! The kernels: their files, their bindings, and the parts they are joined with.

use vertebra_gpu::wgpu::Features;
use vertebra_gpu::{Binding, Kernel, STATUS};

use crate::layout::{Bins, Numbers, Pass, Range};
use crate::sort::{Rows, Sort};

/// Precision of the floating-point numbers of a kernel: `alias real`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Single.
    F32,
    /// Double; needs `SHADER_F64`.
    F64,
}

impl Precision {
    /// The part that defines `real` and `is_finite`.
    #[must_use]
    pub fn part(self) -> &'static str {
        match self {
            Self::F32 => include_str!("../wgsl/shared/real_f32.wgsl"),
            Self::F64 => include_str!("../wgsl/shared/real_f64.wgsl"),
        }
    }

    /// Features of the device that it needs.
    #[must_use]
    pub fn features(self) -> Features {
        match self {
            Self::F32 => Features::empty(),
            Self::F64 => Features::SHADER_F64,
        }
    }

    /// Size of a number \[byte\].
    #[must_use]
    pub fn bytes(self) -> u32 {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// An associative operation on elements of one type, for [`Scan`](crate::Scan) and
/// [`Reduce`](crate::Reduce).
///
/// Its WGSL defines `alias Element`, `fn identity() -> Element` and
/// `fn combine(a: Element, b: Element) -> Element`. It need not commute: order is kept.
#[derive(Clone, Debug)]
pub struct Operator {
    parts: Vec<&'static str>,
    bytes: u32,
    features: Features,
}

impl Operator {
    /// An operation of one's own on elements of `bytes` bytes.
    #[must_use]
    pub fn new(wgsl: &'static str, bytes: u32) -> Self {
        Self {
            parts: vec![wgsl],
            bytes,
            features: Features::empty(),
        }
    }

    /// Sums of words, modulo 2^32.
    #[must_use]
    pub fn add_u32() -> Self {
        Self::new(include_str!("../wgsl/shared/add_u32.wgsl"), 4)
    }

    /// Composition of the maps x -> a x + b of integers modulo 2^16, a in the lower half of a word
    /// and b in the upper; the first map first.
    #[must_use]
    pub fn affine() -> Self {
        Self::new(include_str!("../wgsl/shared/affine.wgsl"), 4)
    }

    /// Sums of numbers.
    #[must_use]
    pub fn add(precision: Precision) -> Self {
        let mut operator = Self::new(
            include_str!("../wgsl/shared/add_real.wgsl"),
            precision.bytes(),
        );
        operator.parts.push(precision.part());
        operator.features = precision.features();
        operator
    }

    /// Adds the operation to a kernel that is written for any, whose bindings `elements` hold
    /// elements.
    pub(crate) fn complete(&self, kernel: &Kernel, elements: &[&str]) -> Kernel {
        let mut kernel = kernel.clone().requires(self.features);
        for &part in &self.parts {
            kernel = kernel.with(part);
        }
        for binding in elements {
            kernel = kernel.stride(binding, self.bytes);
        }
        kernel.workgroup_memory_of(THREADS * self.bytes)
    }
}

/// Lanes of a workgroup.
pub(crate) const THREADS: u32 = 256;
/// Elements that a workgroup of [`REDUCE_TILES`] and [`SCAN_TILES`] takes.
pub(crate) const TILE: u32 = 1024;
/// Keys that a workgroup of [`HISTOGRAM`] takes.
pub(crate) const HISTOGRAM_TILE: u32 = 4096;

const SIZE: [u32; 3] = [THREADS, 1, 1];
const TILE_PART: &str = include_str!("../wgsl/shared/tile.wgsl");

/// Elements as they are.
pub(crate) const LOAD: &str = include_str!("../wgsl/shared/load.wgsl");
/// Elements as flags.
pub(crate) const LOAD_FLAG: &str = include_str!("../wgsl/shared/load_flag.wgsl");

/// Needs an operator and a way to load.
pub(crate) const REDUCE_TILES: Kernel = Kernel::new(
    "reduce_tiles",
    &[include_str!("../wgsl/reduce_tiles.wgsl"), TILE_PART],
    &[
        Binding::uniform::<Range>("range"),
        Binding::read::<u32>("data"),
        Binding::read_write::<u32>("totals"),
    ],
    SIZE,
);

/// Needs an operator and a way to load.
pub(crate) const SCAN_TILES: Kernel = Kernel::new(
    "scan_tiles",
    &[include_str!("../wgsl/scan_tiles.wgsl"), TILE_PART],
    &[
        Binding::uniform::<Range>("range"),
        Binding::read::<u32>("data"),
        Binding::read::<u32>("before"),
        Binding::read_write::<u32>("result"),
    ],
    SIZE,
);

pub(crate) const COMPACT: Kernel = Kernel::new(
    "compact",
    &[
        include_str!("../wgsl/compact.wgsl"),
        TILE_PART,
        LOAD_FLAG,
        include_str!("../wgsl/shared/add_u32.wgsl"),
    ],
    &[
        Binding::uniform::<Range>("range"),
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

pub(crate) const FINITE: Kernel = Kernel::new(
    "finite",
    &[include_str!("../wgsl/finite.wgsl"), STATUS],
    &[
        Binding::uniform::<Numbers>("numbers"),
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
        include_str!("../wgsl/shared/sort.wgsl"),
    ],
    &[
        Binding::uniform::<Pass>("pass_"),
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
        include_str!("../wgsl/shared/sort.wgsl"),
    ],
    &[
        Binding::uniform::<Pass>("pass_"),
        Binding::read::<u32>("keys"),
        Binding::read::<u32>("values"),
        Binding::read::<u32>("offsets"),
        Binding::read_write::<u32>("sorted_keys"),
        Binding::read_write::<u32>("sorted_values"),
    ],
    SIZE,
);

/// Every kernel as it can be dispatched, once for each precision and shape, with what it is.
pub static KERNELS: std::sync::LazyLock<Vec<(String, Kernel)>> = std::sync::LazyLock::new(|| {
    let mut kernels = Vec::new();
    let operators = [
        ("add_u32", Operator::add_u32()),
        ("affine", Operator::affine()),
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
    for rows in Rows::ALL {
        for items in Sort::ITEMS {
            let sort = Sort::new(rows, items);
            for kernel in sort.kernels() {
                let name = format!("{} {rows:?} {items}", kernel.name());
                kernels.push((name, kernel.clone()));
            }
        }
    }
    let others = [COMPACT, HISTOGRAM, FINITE];
    kernels.extend(others.map(|kernel| (kernel.name().to_owned(), kernel)));
    kernels.extend(crate::collision::kernels());
    kernels
});
