//! What a simulation on a GPU is asked for.

use crate::dca::check_precisions;
use crate::{Error, Integrator, Precision};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::Features;

/// Joints of a chunk on average: where a device has lanes to spare, a chunk's length is time, and
/// beyond these many bodies its joins are memory.
const SHORT_WINDOW: usize = 4;
const WINDOW: usize = 8;
const LONG_CHAIN: usize = 8192;

/// How a model is simulated on a GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Precision of kinematics, chunks and the state; none for f64 where the adapter has it, else f32.
    pub chunks: Option<Precision>,
    /// Precision of the joins, at most that of the chunks; none for f32.
    pub tree: Option<Precision>,
    /// How bodies are gathered into chunks; none for 4 joints each, or 8 of
    /// 8192 and more.
    pub schedule: Option<ScheduleOptions>,
    /// How steps are taken.
    pub integrator: Integrator,
}

impl Options {
    /// How so many bodies are gathered.
    pub(super) fn gathering(&self, bodies: usize) -> ScheduleOptions {
        let window = if bodies < LONG_CHAIN {
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
        let tree = self.tree.unwrap_or(Precision::F32);
        for asked in [chunks, tree] {
            if asked == Precision::Reference || asked == Precision::F64 && !has_f64 {
                return Err(Error::PrecisionUnavailable {
                    adapter: device.info().name.clone(),
                    precision: asked,
                });
            }
        }
        check_precisions(chunks, tree)?;
        Ok((chunks, tree))
    }
}
