//! WGSL kernels, one a file, and the parallel primitives made of them, for recordings of
//! [`vertebra_gpu`].
//!
//! | primitive | what it does |
//! |---|---|
//! | [`Scan`] | sums of all elements before each, for any associative [`Operator`] |
//! | [`Reduce`] | the sum of all |
//! | [`Sort`] | key-value pairs by key, stable |
//! | [`compact`] | the values whose flag is set, in order |
//! | [`histogram`] | how often each key occurs |
//! | [`finite`] | fails where a number is infinite or NaN |
//!
//! All give the same bits on every run. Scan and reduction combine in one order whatever the
//! device. Lengths are those of the buffers, from 0 to 2^31; `record_counted` and
//! [`compact_counted`] take the number of elements from the device, where only it knows how many
//! there are. Buffers that should be equally long and are not make
//! [`Recording::check`](vertebra_gpu::Recording::check) refuse the recording.
//!
//! Shaders are composed by joining parts; [`KERNELS`] lists every kernel in every precision and
//! shape, for tools and tests.
//!
//! ```
//! use vertebra_gpu::{Device, Recording};
//! use vertebra_shaders::Sort;
//!
//! # if vertebra_gpu::tests_are_left_out() { return Ok(()); }
//! let device = Device::auto()?;
//! let mut recording = Recording::new("sort");
//! let keys = recording.buffer_from("keys", &[3_u32, 1, 2, 1]);
//! let values = recording.buffer_from("values", &[0_u32, 1, 2, 3]);
//! Sort::on(&device).record(&mut recording, keys, values, 32);
//! recording.download(keys);
//! recording.download(values);
//! let output = device.prepare(&recording)?.run()?.wait()?;
//! assert_eq!(output.read(keys)?, [1, 1, 2, 3]);
//! assert_eq!(output.read(values)?, [1, 3, 2, 0]);
//! # Ok::<(), vertebra_gpu::Error>(())
//! ```

mod batch;
pub mod collision;
mod compact;
pub mod dca;
mod finite;
mod histogram;
mod kernels;
mod layout;
mod operator;
pub mod parts;
mod ranges;
mod reduce;
mod scan;
mod sort;
pub mod twins;

pub use batch::{
    BATCH_HANDOFF, BATCH_ITEMS, BATCH_LANES, BatchFeatures, BatchFinish, BatchLink, BatchPlan,
    batch, batch_poses,
};
pub use compact::{compact, compact_counted};
pub use finite::{Float, finite};
pub use histogram::histogram;
pub use kernels::KERNELS;
pub use layout::{Bins, Digit, Lengths, Range, Ranges};
pub use operator::{Operator, Precision};
pub use reduce::Reduce;
pub use scan::{Scan, ScanKind};
pub use sort::{Rows, Sort};
