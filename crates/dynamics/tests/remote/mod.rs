//! What tests on a GPU share.

use std::sync::OnceLock;
use vertebra_dynamics::Precision;
use vertebra_gpu::{Device, tests_are_left_out};

/// Chunks and joins: the three choices there are.
pub(crate) const PRECISIONS: [(Precision, Precision); 3] = [
    (Precision::F32, Precision::F32),
    (Precision::F64, Precision::F32),
    (Precision::F64, Precision::F64),
];

/// One for all tests of a program, so that pipelines are compiled once.
pub(crate) fn device() -> Option<Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    let open = || (!tests_are_left_out()).then(|| Device::auto().unwrap());
    DEVICE.get_or_init(open).clone()
}
