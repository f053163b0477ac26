//! What a simulation on a GPU is asked for.

use crate::dca::{check_precisions, has_heavy_end};
use crate::solver::MOST_SWEEPS;
use crate::{Error, Integrator, Precision};
use vertebra_assembly::Model;
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::Features;

/// Joints of a chunk on average: where a device has lanes to spare, a chunk's length is time, and beyond [`LONG_CHAIN`]
/// bodies its joins are memory. Next to heavy bodies accuracy counts.
const SHORT_WINDOW: usize = 4;
const WINDOW: usize = 8;
const LONG_CHAIN: usize = 8192;

/// The same with corrections over joins in f32: the longer the chunks, the fewer joins lose digits (`docs/accuracy.md`).
const EXACT_WINDOW: usize = 16;

/// How a model is simulated on a GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Precision of kinematics, chunks and the state; none for f64 where the adapter has it, else f32.
    pub chunks: Option<Precision>,
    /// Precision of the joins, at most that of the chunks; none for that of the chunks. Under chunks in f64 joins in f32 save time,
    /// most where f64 is slow, and cost eight digits or more (`docs/gpu.md`).
    pub tree: Option<Precision>,
    /// How bodies are gathered into chunks; none for 4 joints each, or 8 of
    /// 8192 and more or where bodies weigh 16 times those inboard of them, or 16 with corrections over joins in f32.
    pub schedule: Option<ScheduleOptions>,
    /// How steps are taken.
    pub integrator: Integrator,
    /// Corrections of every solution by what it leaves of the bodies' equations, at most 3; each gains
    /// the digits that the joins have, up to those of the chunks, which have to be in f64.
    pub sweeps: usize,
}

impl Options {
    /// How the bodies are gathered.
    pub(super) fn gathering(
        &self,
        model: &Model,
        weights: &[f64],
        (chunks, tree): (Precision, Precision),
    ) -> ScheduleOptions {
        // In a chunk of few joints a heavy body is no leaf, and its inertia drowns those of light ones before it.
        let window = if self.sweeps > 0 && tree != chunks {
            EXACT_WINDOW
        } else if model.bodies().len() < LONG_CHAIN && !has_heavy_end(model, weights) {
            SHORT_WINDOW
        } else {
            WINDOW
        };
        self.schedule
            .unwrap_or(ScheduleOptions::with_window(window))
    }

    /// Precisions of chunks and of joins on a device.
    pub(crate) fn precisions(&self, device: &Device) -> Result<(Precision, Precision), Error> {
        let has_f64 = device.features().contains(Features::SHADER_F64);
        let best = if has_f64 {
            Precision::F64
        } else {
            Precision::F32
        };
        let chunks = self.chunks.unwrap_or(best);
        let tree = self.tree.unwrap_or(chunks);
        for asked in [chunks, tree] {
            if asked == Precision::Reference || asked == Precision::F64 && !has_f64 {
                return Err(Error::PrecisionUnavailable {
                    adapter: device.info().name.clone(),
                    precision: asked,
                });
            }
        }
        check_precisions(chunks, tree)?;
        if self.sweeps > MOST_SWEEPS || self.sweeps > 0 && chunks == Precision::F32 {
            return Err(Error::Sweeps {
                sweeps: self.sweeps,
                chunks,
            });
        }
        Ok((chunks, tree))
    }
}
