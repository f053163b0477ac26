//! The test for numbers that are none.

use bytemuck::Pod;
use vertebra_gpu::{Kernel, Recording, Slot, Stage, workgroups};

use crate::kernels::{FINITE, THREADS};
use crate::ranges::length;

/// A floating-point number: `f32` or `f64`.
pub trait Float: Pod + sealed::Words {}
impl Float for f32 {}
impl Float for f64 {}

mod sealed {
    /// A number by its bits.
    pub trait Words {
        /// The part of WGSL that looks at them.
        const PART: &str;
        /// How many there are.
        const COUNT: u32;
    }

    impl Words for f32 {
        const PART: &str = include_str!("../wgsl/shared/words_f32.wgsl");
        const COUNT: u32 = 1;
    }

    impl Words for f64 {
        const PART: &str = include_str!("../wgsl/shared/words_f64.wgsl");
        const COUNT: u32 = 2;
    }
}

/// Records a test of `data`: a number that is infinite or NaN is a failure of `stage`, named by its
/// index. Works on devices without f64 too.
pub fn finite<T: Float>(recording: &mut Recording, stage: Stage, data: Slot<T>) {
    let count = length(recording, data);
    if count == 0 {
        return;
    }
    let status = recording.status();
    let number = recording.buffer_from("count", &[count]);
    let kernel = kernel::<T>().constant("STAGE", stage);
    let buffers = [number.any(), data.any(), status.any()];
    recording.dispatch(&kernel, &buffers, workgroups(count, THREADS));
}

/// The kernel for numbers of a type.
pub(crate) fn kernel<T: Float>() -> Kernel {
    FINITE.with(T::PART).stride("data", 4 * T::COUNT)
}
