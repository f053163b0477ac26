//! Runs: one command buffer each, submitted without waiting, read when it is done.

use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex};

use crate::device::{Device, lock};
use crate::error::{Error, Failure};
use crate::output::Output;
use crate::program::{Bound, BoundGroups, Layout, Program, Step};
use crate::timing::{Clock, Timing};

/// Reading has not been granted yet, is granted, is refused.
const WAITING: u8 = 0;
const MAPPED: u8 = 1;
const REFUSED: u8 = 2;

impl Program {
    /// Submits a run and returns at once. Runs take effect in the order of their submission;
    /// several may be under way, each with results of its own.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn run(&self) -> Result<Pending, Error> {
        let results = Results {
            buffer: self.staging()?,
            spare: Arc::clone(&self.spare),
        };
        let state = Arc::new(AtomicU8::new(WAITING));
        let name = self.layout.recording.name();
        let submission = self
            .device
            .checked(name, self.layout.bytes, |device, queue| {
                let label = Some(name);
                let mut encoder =
                    device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
                self.encode(&mut encoder, results.buffer.as_ref());
                let submission = queue.submit([encoder.finish()]);
                if let Some(buffer) = &results.buffer {
                    let state = Arc::clone(&state);
                    buffer.map_async(wgpu::MapMode::Read, .., move |mapped| {
                        let outcome = if mapped.is_ok() { MAPPED } else { REFUSED };
                        state.store(outcome, Ordering::Release);
                    });
                }
                submission
            })?;
        Ok(Pending {
            device: self.device.clone(),
            layout: Arc::clone(&self.layout),
            timing: self.clock.as_ref().map_or(Timing::Off, |c| c.timing),
            labels: self.clock.as_ref().map(|clock| Arc::clone(&clock.labels)),
            submission,
            state,
            results,
        })
    }

    /// The only place that encodes passes.
    fn encode(&self, encoder: &mut wgpu::CommandEncoder, results: Option<&wgpu::Buffer>) {
        let is_pass = |step: &Step| matches!(step, Step::Pass(_));
        let first = self.steps.iter().position(is_pass);
        let last = self.steps.iter().rposition(is_pass);
        let mut timed = 0;
        for (number, step) in self.steps.iter().enumerate() {
            match step {
                Step::Pass(dispatches) => match &self.clock {
                    Some(clock) if clock.timing == Timing::Dispatches => {
                        for dispatch in dispatches {
                            let times = (timed < clock.count())
                                .then(|| clock.writes(Some(timed), Some(timed + 1)))
                                .flatten();
                            timed += 2;
                            encode_pass(encoder, std::slice::from_ref(dispatch), times);
                        }
                    }
                    clock => {
                        let start = (first == Some(number)).then_some(0);
                        let end = (last == Some(number)).then_some(1);
                        let times = clock.as_ref().and_then(|clock| clock.writes(start, end));
                        encode_pass(encoder, dispatches, times);
                    }
                },
                Step::Copy { from, to, bytes } => {
                    encoder.copy_buffer_to_buffer(from, 0, to, 0, *bytes);
                }
                Step::Clear(buffer) => encoder.clear_buffer(buffer, 0, None),
                Step::Download { from, at, bytes } => {
                    if let Some(results) = results {
                        encoder.copy_buffer_to_buffer(from, 0, results, *at, *bytes);
                    }
                }
            }
        }
        if let (Some(clock), Some(results)) = (&self.clock, results) {
            self.encode_clock(encoder, clock, results);
        }
    }

    fn encode_clock(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &Clock,
        results: &wgpu::Buffer,
    ) {
        let resolved = &clock.resolved;
        encoder.resolve_query_set(&clock.queries, 0..clock.count(), resolved, 0);
        let at = self.layout.ticks;
        encoder.copy_buffer_to_buffer(resolved, 0, results, at, clock.bytes());
    }
}

fn encode_pass(
    encoder: &mut wgpu::CommandEncoder,
    dispatches: &[Bound],
    timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
) {
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: None,
        timestamp_writes,
    });
    for dispatch in dispatches {
        pass.set_pipeline(&dispatch.pipeline);
        pass.set_bind_group(0, &dispatch.buffers, &[]);
        match &dispatch.groups {
            BoundGroups::Direct([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
            BoundGroups::Indirect(buffer, offset) => {
                pass.dispatch_workgroups_indirect(buffer, *offset);
            }
        }
    }
}

/// Memory with the results of a run, which is given back when it is dropped.
#[derive(Debug)]
pub(crate) struct Results {
    pub(crate) buffer: Option<wgpu::Buffer>,
    spare: Arc<Mutex<Vec<wgpu::Buffer>>>,
}

impl Drop for Results {
    fn drop(&mut self) {
        if let Some(buffer) = self.buffer.take() {
            buffer.unmap();
            lock(&self.spare).push(buffer);
        }
    }
}

/// A run that was submitted and may not be done.
#[derive(Debug)]
#[must_use = "results are read by waiting for the run"]
pub struct Pending {
    device: Device,
    layout: Arc<Layout>,
    timing: Timing,
    labels: Option<Arc<[String]>>,
    submission: wgpu::SubmissionIndex,
    state: Arc<AtomicU8>,
    results: Results,
}

impl Pending {
    /// Whether the results can be read without waiting.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn is_done(&self) -> Result<bool, Error> {
        self.poll(wgpu::PollType::Poll)?;
        let mapped = self.state.load(Ordering::Acquire) != WAITING;
        Ok(mapped || self.results.buffer.is_none())
    }

    /// Waits for the run and returns what it downloads.
    ///
    /// # Errors
    /// [`Error::Failed`] when a stage reported a failure, [`Error::DeviceLost`].
    pub fn wait(self) -> Result<Output, Error> {
        let recording = self.layout.recording.name().to_owned();
        let (output, failures) = self.wait_for_all()?;
        if failures.is_empty() {
            Ok(output)
        } else {
            Err(Error::Failed {
                recording,
                failures,
            })
        }
    }

    /// Waits for the run and returns what it downloads even where stages failed, to find out why.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn wait_for_all(self) -> Result<(Output, Vec<Failure>), Error> {
        self.poll(wgpu::PollType::Wait {
            submission_index: Some(self.submission.clone()),
            timeout: None,
        })?;
        let refused = |message: &str| Error::Driver {
            what: format!("reading the results of `{}`", self.layout.recording.name()),
            message: message.to_owned(),
        };
        if self.results.buffer.is_some() {
            match self.state.load(Ordering::Acquire) {
                MAPPED => {}
                WAITING => return Err(refused("the device did not wait")),
                _ => return Err(refused("the memory could not be mapped")),
            }
        }
        let output = Output::new(
            self.layout,
            self.results,
            self.timing,
            self.labels,
            self.device.raw().1.get_timestamp_period(),
        )?;
        let failures = output.failures();
        Ok((output, failures))
    }

    fn poll(&self, how: wgpu::PollType) -> Result<(), Error> {
        let polled = self.device.raw().0.poll(how);
        self.device.alive()?;
        polled.map(drop).map_err(|error| Error::Driver {
            what: format!("waiting for `{}`", self.layout.recording.name()),
            message: error.to_string(),
        })
    }
}
