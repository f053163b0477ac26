//! The checks of a GPU: primitives against the CPU, the runtime, and what happens when things go
//! wrong. They run on any device, a software one too.

mod batch;
mod collision;
mod compare;
mod contacts;
mod dynamics;
mod dynamics_errors;
mod elements;
mod faults;
mod forward_errors;
mod loops;
mod mismatches;
mod primitives;
pub(crate) mod runtime;
mod sorts;
mod stages;
mod writes;

pub use compare::{Compared, Computation};
pub use dynamics::Problem;

use super::{Figure, Outcome};
use vertebra_gpu::Device;

/// A check on a device.
pub struct GpuCheck {
    /// Name of the check.
    pub name: &'static str,
    /// Measures the figures.
    pub run: fn(&Device) -> Outcome,
}

/// All checks.
pub const CHECKS: &[GpuCheck] = &[
    check("scan", primitives::scan),
    check("scan_in_order", primitives::affine_scan),
    check("float_scan", primitives::float_scan),
    check("reduce", primitives::reduce),
    check("own_operator", primitives::own_operator),
    check("sort", sorts::sort),
    check("sort_shapes", sorts::sort_shapes),
    check("sort_in_a_wrong_shape", sorts::sort_in_a_wrong_shape),
    check("counts_on_the_device", sorts::counts_on_the_device),
    check("compact", primitives::compact),
    check("histogram", primitives::histogram),
    check("same_bits", primitives::same_bits),
    check("failures_are_captured", compare::failures_are_captured),
    check("commands_in_order", runtime::commands_in_order),
    check("indirect_dispatch", runtime::indirect_dispatch),
    check(
        "elements_in_two_dimensions",
        runtime::elements_in_two_dimensions,
    ),
    check("lengths", runtime::lengths),
    check("large_writes", writes::large_writes),
    check("repetitions", runtime::repetitions),
    check("runs_overlap", runtime::runs_overlap),
    check("shared_buffers", runtime::shared_buffers),
    check("times", runtime::times),
    check("many_workgroups", stages::many_workgroups),
    check("no_adapter", faults::no_adapter),
    check("missing_feature", faults::missing_feature),
    check("limits_too_low", faults::limits_too_low),
    check("buffer_too_large", faults::buffer_too_large),
    check("out_of_memory", faults::out_of_memory),
    check("device_lost", faults::device_lost),
    check("invalid_shader", faults::invalid_shader),
    check("wrong_recordings", faults::wrong_recordings),
    check("wrong_sharing", mismatches::wrong_sharing),
    check("wrong_slots", mismatches::wrong_slots),
    check("unheard_failures", mismatches::unheard_failures),
    check(
        "failures_of_repetitions",
        mismatches::failures_of_repetitions,
    ),
    check("kernel_differs", mismatches::kernel_differs),
    check("nan_in_data", stages::nan_in_data),
    check("nan_made_on_the_device", stages::nan_made_on_the_device),
    check("failed_stage", stages::failed_stage),
    check("batch_accelerations", batch::accelerations),
    check("batch_long_chains", batch::long_chains),
    check("batch_steps", batch::steps),
    check("batch_failing_item", batch::a_failing_item),
    check("dca_accelerations", dynamics::accelerations),
    check("dca_captured", dynamics::captured),
    check("dca_long_chain", dynamics_errors::long_chain),
    check("dca_shapes", dynamics_errors::shapes),
    check("dynamics_seeds", dynamics_errors::seeds),
    check("dynamics_f32_seeds", dynamics_errors::f32_seeds),
    check("dynamics_refined", dynamics_errors::refined),
    check("dca_joint_inertia", elements::inertia),
    check("dynamics_elements", elements::steps),
    check("dynamics_smooth_elements", elements::smooth_steps),
    check("batch_elements", elements::batches),
    check("forward_errors", forward_errors::forward_errors),
    check("dca_steps", dynamics::steps),
    check("dca_same_bits", dynamics::same_bits),
    check("dynamics_long", dynamics::long),
    check("dynamics_loops", loops::loops),
    check("dynamics_loaded_loops", loops::loaded),
    check("loop_violations", loops::violations),
    check("dca_overflow", dynamics::overflow),
    check("dynamics_device_lost", dynamics::device_lost),
    check("no_nan", no_nan),
    check("collision_gold", collision::gold),
    check("collision_hard", collision::hard),
    check("collision_nearly_touching", collision::nearly_touching),
    check("collision_large", collision::large),
    check("collision_queues_grow", collision::queues_grow),
    check("collision_contacts", contacts::contacts),
    check("collision_choice", contacts::choice),
    check("collision_moved", collision::moved),
    check("collision_itself", collision::itself),
    check("collision_together", collision::together),
    check("collision_moller", collision::moller),
];

/// What the checks compute and is no twin of `vertebra_shaders`.
pub const COMPUTATIONS: &[Computation] =
    &[primitives::OWN_OPERATOR, stages::FINITE, stages::QUOTIENTS];

const fn check(name: &'static str, run: fn(&Device) -> Outcome) -> GpuCheck {
    GpuCheck { name, run }
}

/// The device that is checked, opened with its own limits and whatever of f64, subgroups and
/// timestamps it has.
///
/// # Errors
/// If there is none.
pub fn device() -> Result<Device, vertebra_gpu::Error> {
    Device::auto()
}

/// Wild models answered with numbers or errors, and the device as it was.
fn no_nan(device: &Device) -> Outcome {
    let models = if is_software(device) { 16 } else { 256 };
    crate::fuzz::no_nan_on(device, models)
}

/// A figure that is 0 where a statement holds.
fn holds(name: impl Into<String>, statement: bool) -> Figure {
    Figure::new(name, if statement { 0.0 } else { 1.0 }, 0.0)
}

/// Whether this is a processor that plays a GPU: tests are then smaller.
fn is_software(device: &Device) -> bool {
    device.info().device_type == vertebra_gpu::wgpu::DeviceType::Cpu
}
