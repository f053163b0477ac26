//! Dynamics on a GPU.

mod batch;

pub use batch::{GpuBatch, GpuBatchOptions};
