//! Time on the GPU, by timestamps around passes.

use crate::device::Device;
use crate::error::Error;
use crate::program::Step;

/// What to take the time of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Timing {
    /// Nothing.
    #[default]
    Off,
    /// From the start of the first dispatch to the end of the last.
    Whole,
    /// Also of each dispatch. Each then is a pass of its own, so that the whole takes longer.
    Dispatches,
}

/// Timestamps of a program.
#[derive(Debug)]
pub(crate) struct Clock {
    pub(crate) timing: Timing,
    pub(crate) queries: wgpu::QuerySet,
    pub(crate) resolved: wgpu::Buffer,
    /// Labels of the dispatches, in profile mode.
    pub(crate) labels: std::sync::Arc<[String]>,
    count: u32,
}

impl Clock {
    /// Timestamps for these steps; none where nothing is to be timed.
    pub(crate) fn new(
        device: &Device,
        timing: Timing,
        steps: &[Step],
    ) -> Result<Option<Self>, Error> {
        let passes = steps.iter().filter_map(|step| match step {
            Step::Pass(pass) => Some(pass),
            _ => None,
        });
        let labels: Vec<String> = passes.flatten().map(|d| d.label.clone()).collect();
        if timing == Timing::Off || labels.is_empty() {
            return Ok(None);
        }
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Err(Error::NoTimestamps {
                adapter: device.info().name.clone(),
            });
        }
        // A query set has a limited size; dispatches beyond it are not timed one by one.
        let most = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;
        let labels = match timing {
            Timing::Dispatches => labels.into_iter().take(most).collect(),
            _ => Vec::new(),
        };
        let count = 2 * u32::try_from(labels.len().max(1)).unwrap_or(1);
        let bytes = u64::from(count) * u64::from(wgpu::QUERY_SIZE);
        device
            .checked("timestamps", bytes, |device, _| Self {
                timing,
                queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("timestamps"),
                    ty: wgpu::QueryType::Timestamp,
                    count,
                }),
                resolved: device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("timestamps"),
                    size: bytes,
                    usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                }),
                labels: labels.into(),
                count,
            })
            .map(Some)
    }

    /// Number of timestamps.
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// Size of the timestamps \[byte\].
    pub(crate) fn bytes(&self) -> u64 {
        u64::from(self.count) * u64::from(wgpu::QUERY_SIZE)
    }

    /// Timestamps at the start and the end of a pass.
    pub(crate) fn writes(
        &self,
        start: Option<u32>,
        end: Option<u32>,
    ) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        (start.is_some() || end.is_some()).then_some(wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: start,
            end_of_pass_write_index: end,
        })
    }
}
