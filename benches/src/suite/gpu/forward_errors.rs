//! Forward errors over 64 seeds of every case on a device: against bounds, and against what they were before on
//! such a device.

use super::is_software;
use crate::accuracy::case::{Case, Shape};
use crate::accuracy::entry::measure;
use crate::accuracy::{Solvers, parse};
use crate::interrupt::Interrupt;
use crate::suite::Outcome;
use crate::suite::seeds::{Bounds, SEEDS, find, judge};
use vertebra_gpu::Device;

/// Numbers of bodies.
const SIZES: [usize; 2] = [32, 128];

/// The entries before, by the name that an adapter starts with; `benches/accuracy/README.md` tells how they are
/// made. Of one that has not been measured, or a case that has not been measured on it, there are none.
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
    let stored = stored.map_or(Ok(Vec::new()), |(_, text)| parse(text))?;
    let missing = if stored.is_empty() {
        format!(" (bounds alone: nothing of {adapter} is stored)")
    } else {
        format!(" (bounds alone: this is not among what is stored of {adapter})")
    };
    let (sizes, every) = if is_software(device) {
        (&SIZES[..1], 10)
    } else {
        (&SIZES[..], 1)
    };
    let solvers = Solvers::on_gpu(device);
    let mut figures = Vec::new();
    // Kernels for joints of all kinds take a processor long to compile; other checks have them.
    let cases = Case::all().into_iter();
    let cases =
        cases.filter(|case| !(is_software(device) && matches!(case.shape, Shape::Mixed(_))));
    for case in &cases.step_by(every).collect::<Vec<_>>() {
        for &bodies in sizes {
            let measured = measure(&solvers, case, bodies, SEEDS, &Interrupt::default())?;
            for entry in measured.into_iter().flatten() {
                let bounds = Bounds::on_gpu(case, &entry);
                let before = find(&stored, &entry);
                let mut judged = judge(case, &entry, before, bounds);
                if before.is_none() {
                    for figure in &mut judged {
                        figure.name += &missing;
                    }
                }
                figures.extend(judged);
            }
        }
    }
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is stored of a device is what its check allows: bounds that no device has met, or that what was measured exceeds,
    /// would be found out only there.
    #[test]
    fn stored_errors_are_within_bounds() {
        let cases = Case::all();
        for (device, text) in STORED {
            let stored = parse(text).unwrap();
            let sized = |entry: &&crate::accuracy::entry::Entry| SIZES.contains(&entry.bodies);
            let mut judged = 0;
            for entry in stored.iter().filter(sized) {
                let is_of = |case: &&Case| {
                    (entry.shape.as_str(), entry.pattern.as_str())
                        == (case.shape.name(), case.pattern.name)
                };
                let case = cases.iter().find(is_of).unwrap();
                let bounds = Bounds::on_gpu(case, entry);
                for figure in judge(case, entry, None, bounds) {
                    assert!(figure.passes(), "{device}: {figure:?}");
                    judged += 1;
                }
            }
            assert!(judged > 100, "{device}: {judged} figures");
        }
    }
}
