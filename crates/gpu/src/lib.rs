//! Compute on any GPU, or on the processor through a software driver: recordings of dispatches as
//! data, typed buffers, typed errors, timestamps. It knows no physics.
//!
//! * A [`Kernel`] is WGSL and the list of its [`Binding`]s.
//! * A [`Recording`] is a list of commands over named buffers: it is built, [checked](Recording::check)
//!   and printed without a GPU.
//! * A [`Device`] makes it a [`Program`], with buffers and pipelines, which is [run](Program::run)
//!   any number of times.
//! * A [`Pending`] run becomes an [`Output`] while the next is already under way.
//!
//! Whatever a caller can cause ends in an [`Error`] that names the culprit and the remedy. Kernels
//! report failures by [stages](Stage); their results are then not handed out.
//!
//! # A kernel of one's own
//!
//! ```
//! use vertebra_gpu::{Binding, Device, ELEMENTS, Kernel, Recording, workgroups};
//!
//! // y <- a x + y, one lane an element.
//! const AXPY: Kernel = Kernel::new(
//!     "axpy",
//!     &["
//!     @group(0) @binding(0) var<uniform> a: f32;
//!     @group(0) @binding(1) var<storage, read> x: array<f32>;
//!     @group(0) @binding(2) var<storage, read_write> y: array<f32>;
//!
//!     @compute @workgroup_size(64)
//!     fn main(
//!         @builtin(global_invocation_id) id: vec3<u32>,
//!         @builtin(num_workgroups) groups: vec3<u32>,
//!     ) {
//!         let i = element(id, groups, 64u);
//!         if i < arrayLength(&y) {
//!             y[i] += a * x[i];
//!         }
//!     }", ELEMENTS],
//!     &[
//!         Binding::uniform::<f32>("a"),
//!         Binding::read::<f32>("x"),
//!         Binding::read_write::<f32>("y"),
//!     ],
//!     [64, 1, 1],
//! );
//!
//! let mut recording = Recording::new("axpy twice");
//! let a = recording.buffer_from("a", &[0.5_f32]);
//! let x = recording.buffer_from("x", &[1.0_f32, 2.0, 3.0, 4.0]);
//! let y = recording.buffer::<f32>("y", 4);
//! for _ in 0..2 {
//!     recording.dispatch(&AXPY, &[a.any(), x.any(), y.any()], workgroups(4, 64));
//! }
//! recording.download(y);
//! println!("{recording}");
//!
//! # if vertebra_gpu::tests_are_left_out() { return Ok(()); }
//! let device = Device::auto()?;
//! let program = device.prepare(&recording)?;
//! let first = program.run()?; // does not wait
//! let second = program.run()?;
//! assert_eq!(first.wait()?.read(y)?, [1.0, 2.0, 3.0, 4.0]);
//! assert_eq!(second.wait()?.read(y)?, [2.0, 4.0, 6.0, 8.0]);
//! # Ok::<(), vertebra_gpu::Error>(())
//! ```

mod adapter;
mod buffer;
pub mod capture;
mod check;
mod demands;
mod device;
mod elements;
mod encode;
mod error;
mod kernel;
mod loops;
mod options;
mod output;
mod pipeline;
mod print;
mod problem;
mod program;
mod recording;
mod reflect;
mod run;
mod slots;
mod staging;
mod timing;
pub mod twin;

pub use adapter::{ADAPTER_VARIABLE, AdapterChoice, adapters, tests_are_left_out};
pub use buffer::Buffer;
pub use device::Device;
pub use elements::{ELEMENTS, workgroups};
pub use error::{Error, Failure, Problem, Shortfall};
pub use kernel::{Access, Binding, Constant, Kernel};
pub use options::Options;
pub use output::Output;
pub use program::Program;
pub use recording::{AnySlot, Recording, Shared, Slot, Stage};
pub use run::Pending;
pub use timing::Timing;
pub use wgpu;

/// The part of WGSL with which kernels report failures: a kernel that has it declares
/// `var<storage, read_write> status: array<atomic<u32>>` as its last binding and calls
/// `fail(element)`. The first failing element of a stage is kept, whatever the order of lanes.
pub const STATUS: &str = include_str!("status.wgsl");
