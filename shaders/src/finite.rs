//! The test for numbers that are none.

use bytemuck::Pod;
use vertebra_gpu::{Recording, Slot, Stage, workgroups};

use crate::kernels::{FINITE, THREADS};
use crate::layout::Numbers;
use crate::ranges::length;

/// A floating-point number: `f32` or `f64`.
pub trait Float: Pod + sealed::Sealed {}
impl Float for f32 {}
impl Float for f64 {}

mod sealed {
    /// What is a float is for WGSL to say.
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// Records a test of `data`: a number that is infinite or NaN is a failure of `stage`, named by its
/// index. Works on devices without f64 too.
pub fn finite<T: Float>(recording: &mut Recording, stage: Stage, data: Slot<T>) {
    let count = length(recording, data);
    if count == 0 {
        return;
    }
    let words = if size_of::<T>() == 8 { 2 } else { 1 };
    let status = recording.status();
    let numbers = recording.buffer_from("numbers", &[Numbers { count, words }]);
    let kernel = FINITE.constant("STAGE", stage).stride("data", 4 * words);
    let buffers = [numbers.any(), data.any(), status.any()];
    recording.dispatch(&kernel, &buffers, workgroups(count, THREADS));
}
