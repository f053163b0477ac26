//! Forward errors over 64 seeds of every case on a device: against bounds, and against what they were before on
//! such a device.

use super::is_software;
use crate::accuracy::case::Case;
use crate::accuracy::entry::measure;
use crate::accuracy::{Solvers, parse};
use crate::suite::Outcome;
use crate::suite::seeds::{Bounds, SEEDS, find, judge};
use vertebra_gpu::Device;

/// Numbers of bodies.
const SIZES: [usize; 2] = [32, 128];

/// The entries before, by the name that an adapter starts with; `benches/accuracy/README.md` tells how they are
/// made. Of one that has not been measured there are none.
const STORED: &[(&str, &str)] = &[
    (
        "llvmpipe",
        include_str!("../../../accuracy/llvmpipe/accuracy.json"),
    ),
    (
        "NVIDIA H100",
        include_str!("../../../accuracy/nvidia-h100/accuracy.json"),
    ),
];

/// Every solver on every case; of a processor that plays a GPU every tenth case, and few bodies.
pub(super) fn forward_errors(device: &Device) -> Outcome {
    let adapter = &device.info().name;
    let stored = STORED.iter().find(|(name, _)| adapter.starts_with(name));
    let stored = stored.map(|(_, text)| parse(text)).transpose()?;
    let stored = stored.filter(|entries| !entries.is_empty());
    let (sizes, every) = if is_software(device) {
        (&SIZES[..1], 10)
    } else {
        (&SIZES[..], 1)
    };
    let solvers = Solvers::on_gpu(device);
    let mut figures = Vec::new();
    for case in Case::all().iter().step_by(every) {
        for &bodies in sizes {
            for entry in measure(&solvers, case, bodies, SEEDS)? {
                let bounds = Bounds::on_gpu(case, &entry);
                let before = (stored.as_ref())
                    .map(|stored| find(stored, &entry))
                    .transpose()?;
                figures.extend(judge(case, &entry, before, bounds));
            }
        }
    }
    if stored.is_none() {
        for figure in &mut figures {
            figure.name += &format!(" (bounds alone: no errors of {adapter} are stored)");
        }
    }
    Ok(figures)
}
