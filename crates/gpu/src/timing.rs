//! Time on the GPU, by timestamps.

use std::sync::Arc;

use crate::device::Device;
use crate::error::Error;
use crate::program::Step;

/// What to take the time of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Timing {
    /// Nothing.
    #[default]
    Off,
    /// From the start of the first dispatch to the end of the last. Uploads, copies and clears before
    /// and downloads after them do not count, those between them do.
    Whole,
    /// From before the first command to after the last, of whatever kind, downloads too.
    Commands,
    /// As [`Timing::Whole`], and of each dispatch. Each then is a pass of its own, so that the whole
    /// takes longer. Of a run with [repetitions](crate::Program::run_times) the last is timed.
    Dispatches,
}

/// Timestamps of a program.
#[derive(Debug)]
pub(crate) struct Clock {
    pub(crate) timing: Timing,
    /// Each holds a limited number; all but the last are full.
    sets: Vec<wgpu::QuerySet>,
    resolved: wgpu::Buffer,
    /// Labels of the dispatches, where each is timed.
    pub(crate) labels: Arc<[String]>,
    count: u32,
}

const PER_SET: u32 = wgpu::QUERY_SET_MAX_QUERIES;

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
        let mut labels: Vec<String> = passes.flatten().map(|d| d.label.clone()).collect();
        let nothing = match timing {
            Timing::Off => true,
            Timing::Whole | Timing::Dispatches => labels.is_empty(),
            Timing::Commands => false,
        };
        if nothing {
            return Ok(None);
        }
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Err(Error::NoTimestamps {
                adapter: device.info().name.clone(),
            });
        }
        if timing != Timing::Dispatches {
            labels.clear();
        }
        // No recording of 2^31 dispatches fits into memory.
        let count = 2 * u32::try_from(labels.len().max(1)).unwrap_or(u32::MAX / 2);
        let bytes = u64::from(count) * u64::from(wgpu::QUERY_SIZE);
        device
            .checked("timestamps", bytes, |device, _| Self {
                timing,
                sets: (0..count.div_ceil(PER_SET))
                    .map(|set| {
                        device.create_query_set(&wgpu::QuerySetDescriptor {
                            label: Some("timestamps"),
                            ty: wgpu::QueryType::Timestamp,
                            count: (count - set * PER_SET).min(PER_SET),
                        })
                    })
                    .collect(),
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

    /// Size of the timestamps \[byte\].
    pub(crate) fn bytes(&self) -> u64 {
        u64::from(self.count) * u64::from(wgpu::QUERY_SIZE)
    }

    /// Timestamps around the pass of this dispatch.
    pub(crate) fn around(&self, dispatch: u32) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.writes(2 * dispatch, [true, true])
    }

    /// The timestamp at the start of a run.
    pub(crate) fn start(&self, encoder: &mut wgpu::CommandEncoder) {
        mark(encoder, self.writes(0, [true, false]));
    }

    /// The timestamp at the end of a run.
    pub(crate) fn end(&self, encoder: &mut wgpu::CommandEncoder) {
        mark(encoder, self.writes(0, [false, true]));
    }

    /// Timestamp `first` at the start of a pass, the next at its end; `first` is even, so that both
    /// are in one set.
    pub(crate) fn writes(
        &self,
        first: u32,
        [start, end]: [bool; 2],
    ) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        if !start && !end {
            return None;
        }
        let query_set = self.sets.get((first / PER_SET) as usize)?;
        let place = first % PER_SET;
        Some(wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: start.then_some(place),
            end_of_pass_write_index: end.then_some(place + 1),
        })
    }

    /// Copies the timestamps to the results.
    pub(crate) fn download(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        results: &wgpu::Buffer,
        at: u64,
    ) {
        for (number, set) in (0_u32..).zip(&self.sets) {
            let first = number * PER_SET;
            let count = (self.count - first).min(PER_SET);
            let place = u64::from(first) * u64::from(wgpu::QUERY_SIZE);
            encoder.resolve_query_set(set, 0..count, &self.resolved, place);
        }
        encoder.copy_buffer_to_buffer(&self.resolved, 0, results, at, self.bytes());
    }
}

/// A pass of nothing: timestamps belong to passes on every device, between them only on some.
fn mark(
    encoder: &mut wgpu::CommandEncoder,
    timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
) {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: None,
        timestamp_writes,
    });
}
