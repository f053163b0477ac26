//! Everything that needs no access to the crate's inside, as one program.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test that cannot go on has failed"
)]
#![expect(
    clippy::cast_possible_truncation,
    reason = "coordinates are rounded to f32 on purpose, and counts are small"
)]

mod batches;
mod classes;
mod culling;
mod curves;
mod distances;
mod exact;
mod files;
mod gold;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(feature = "gpu")]
mod gpu_faults;
#[cfg(feature = "gpu")]
mod gpu_together;
mod hard_cases;
mod ply_off;
mod published;
mod readers;
mod self_collision;
mod solids;
mod support;
