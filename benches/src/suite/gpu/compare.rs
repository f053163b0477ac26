//! Comparisons with a twin, and the file that is left where one goes wrong.

use super::holds;
use super::stages::FINITE;
use crate::replay::{fault, replay};
use crate::suite::{Figure, Outcome};
use anyhow::{Context, anyhow, bail};
use serde::Serialize;
use std::path::{Path, PathBuf};
use vertebra_gpu::capture::Capture;
use vertebra_gpu::twin::{Comparison, Named, Twin};
use vertebra_gpu::{Device, Failure};
use vertebra_shaders::twins;

/// Stages computed on both sides, and the failures that were not expected.
pub type Compared = anyhow::Result<(Vec<Comparison>, Vec<Failure>)>;

/// What a check computes on both sides from named arrays, where that is no [`Twin`].
pub struct Computation {
    /// Name of the computation, which files give too.
    pub name: &'static str,
    /// Computes the stages on both sides.
    pub compare: fn(&Device, &[Named]) -> Compared,
}

/// Compares a twin on one input. Whatever goes wrong, a wrong result or none at all, the inputs are
/// written to a file that `replay` reads.
pub(super) fn compare(device: &Device, twin: &Twin, label: &str, inputs: &[Named]) -> Outcome {
    let found = twin.compare(device, inputs).map_err(anyhow::Error::from);
    judge(device, twin.name, label, inputs, found)
}

/// The same of a computation that is no twin.
pub(super) fn compare_own(
    device: &Device,
    computation: &Computation,
    label: &str,
    inputs: &[Named],
) -> Outcome {
    let found = (computation.compare)(device, inputs);
    judge(device, computation.name, label, inputs, found)
}

/// Figures of what was found; where that is wrong, an error that names the file with the inputs.
pub(super) fn judge(
    device: &Device,
    name: &str,
    label: &str,
    inputs: &(impl Serialize + ?Sized),
    found: Compared,
) -> Outcome {
    let reason = match found {
        Ok((comparisons, failures)) => match fault(&comparisons, &failures) {
            None => {
                let figure = |c: Comparison| {
                    Figure::new(format!("{} {label}", c.stage), c.error, c.tolerance)
                };
                return Ok(comparisons.into_iter().map(figure).collect());
            }
            Some(reason) => reason,
        },
        Err(error) => format!("{error:#}"),
    };
    Err(capture(device, name, label, inputs, reason))
}

/// An error that names the file to which it wrote the inputs.
pub(super) fn capture(
    device: &Device,
    name: &str,
    label: &str,
    inputs: &(impl Serialize + ?Sized),
    reason: String,
) -> anyhow::Error {
    let what = format!("{name} {label}");
    let written = Capture::new(name, &device.description(), &reason, &inputs)
        .and_then(|capture| capture.write(&std::env::temp_dir()));
    match written {
        Ok(path) => Captured { what, reason, path }.into(),
        Err(error) => anyhow!("{what}: {reason}; its inputs were not written: {error}"),
    }
}

/// What went wrong, and where its inputs are.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {reason}; see `vertebra-bench replay {} --dump STAGE`", .path.display())]
struct Captured {
    what: String,
    reason: String,
    path: PathBuf,
}

/// The file that an error left.
pub(super) fn file_of(error: &anyhow::Error) -> anyhow::Result<&Path> {
    let Captured { path, .. } = error.downcast_ref().context("no file was written")?;
    Ok(path)
}

/// Stages that fail and recordings that are refused leave a file, which replays as it happened.
pub(super) fn failures_are_captured(device: &Device) -> Outcome {
    // What is planted is in the check, not in the computation of this name.
    const PLANTED: Computation = Computation {
        name: FINITE.name,
        compare: |_, _| bail!("planted"),
    };
    let keys = Named::new("keys", vec![1_u32, 9, 2]);
    let bins = Named::new("bins", vec![4_u32]);
    let values = Named::new("values", vec![1_u32, 2]);
    let flags = Named::new("flags", vec![1_u32]);
    let data = Named::new("data", vec![1.0_f32, f32::INFINITY]);
    let (histogram, compaction, numbers) = (vec![keys, bins], vec![flags, values], vec![data]);
    let of_twin = |twin, inputs: &[Named]| compare(device, twin, "planted", inputs);
    let cases = [
        (
            of_twin(&twins::HISTOGRAM, &histogram),
            histogram,
            "`keys` at element 1",
            Some(false),
        ),
        (
            of_twin(&twins::COMPACT, &compaction),
            compaction,
            "equally many",
            None,
        ),
        (
            compare_own(device, &PLANTED, "planted", &numbers),
            numbers,
            "planted",
            Some(true),
        ),
    ];
    let mut figures = Vec::new();
    for (outcome, inputs, reason, agrees) in cases {
        let Err(error) = outcome else {
            bail!("nothing was found wrong where one should have: {reason}");
        };
        let path = file_of(&error)?;
        let capture = Capture::read(path)?;
        figures.push(holds(
            format!("inputs of {}", capture.computation),
            capture.inputs::<Vec<Named>>()? == inputs && capture.reason.contains(reason),
        ));
        figures.push(holds(
            format!("replay of {}", capture.computation),
            replay(path, None, 1).ok() == agrees,
        ));
        std::fs::remove_file(path)?;
    }
    Ok(figures)
}
