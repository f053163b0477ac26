//! Comparisons with a twin, and the file that is left where one goes wrong.

use super::holds;
use crate::replay::{fault, replay};
use crate::suite::{Figure, Outcome};
use anyhow::{Context, bail};
use std::path::PathBuf;
use vertebra_gpu::Device;
use vertebra_gpu::capture::Capture;
use vertebra_gpu::twin::{Comparison, Named, Twin};
use vertebra_shaders::twins;

/// Compares a twin on one input. Whatever goes wrong, a wrong result or none at all, the inputs are
/// written to a file that `replay` reads.
pub(super) fn compare(device: &Device, twin: &Twin, label: &str, inputs: &[Named]) -> Outcome {
    let reason = match twin.compare(device, inputs) {
        Ok((comparisons, failures)) => match fault(&comparisons, &failures) {
            None => {
                let figure = |c: Comparison| {
                    Figure::new(format!("{} {label}", c.stage), c.error, c.tolerance)
                };
                return Ok(comparisons.into_iter().map(figure).collect());
            }
            Some(reason) => reason,
        },
        Err(error) => error.to_string(),
    };
    let path = twin
        .capture(device, inputs, &reason)?
        .write(&std::env::temp_dir())?;
    Err(Captured {
        what: format!("{} {label}", twin.name),
        reason,
        path,
    }
    .into())
}

/// What went wrong, and where its inputs are.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {reason}; see `vertebra-bench replay {} --dump STAGE`", .path.display())]
struct Captured {
    what: String,
    reason: String,
    path: PathBuf,
}

/// Stages that fail and recordings that are refused leave a file, which replays as it happened.
pub(super) fn failures_are_captured(device: &Device) -> Outcome {
    let keys = Named::new("keys", vec![1_u32, 9, 2]);
    let bins = Named::new("bins", vec![4_u32]);
    let values = Named::new("values", vec![1_u32, 2]);
    let flags = Named::new("flags", vec![1_u32]);
    let mut figures = Vec::new();
    for (twin, inputs, reason, runs) in [
        (&twins::HISTOGRAM, [keys, bins], "`keys` at element 1", true),
        (&twins::COMPACT, [flags, values], "equally many", false),
    ] {
        let Err(error) = compare(device, twin, "planted", &inputs) else {
            bail!("{} found nothing wrong", twin.name);
        };
        let Captured { path, .. } = error.downcast_ref().context("no file was written")?;
        let capture = Capture::read(path)?;
        figures.push(holds(
            format!("inputs of {}", twin.name),
            capture.inputs::<Vec<Named>>()? == inputs && capture.reason.contains(reason),
        ));
        let replayed = replay(path, None, 1);
        figures.push(holds(
            format!("replay of {}", twin.name),
            if runs {
                matches!(replayed, Ok(false))
            } else {
                replayed.is_err()
            },
        ));
        std::fs::remove_file(path)?;
    }
    Ok(figures)
}
