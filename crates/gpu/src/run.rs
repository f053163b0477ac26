//! Runs: one command buffer each, submitted without waiting, read when it is done.

use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::device::{Device, lock};
use crate::encode::Run;
use crate::error::{Error, Failure};
use crate::output::Output;
use crate::program::{Layout, Program};
use crate::timing::Timing;

/// Reading has not been granted yet, is granted, is refused.
const WAITING: u8 = 0;
const MAPPED: u8 = 1;
const REFUSED: u8 = 2;

/// Most commands of a submission: each is encoded, and a driver may give up on a device that is busy
/// for seconds.
const MOST_COMMANDS: u64 = 1 << 22;

impl Program {
    /// Submits a run and returns at once. Runs take effect in the order of their submission;
    /// several may be under way, each with results of its own.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn run(&self) -> Result<Pending, Error> {
        self.run_times(1)
    }

    /// Submits so many runs in one, which is cheaper than one by one. What the last repetition
    /// downloads is read; failures are those of all, of each stage the smallest element. Of no
    /// repetition the buffers are read as they are.
    ///
    /// # Errors
    /// Those of [`Program::run`]; [`Error::Repetitions`] of more than 2^22 commands in all.
    pub fn run_times(&self, repetitions: u32) -> Result<Pending, Error> {
        let most = MOST_COMMANDS / self.commands().max(1);
        if u64::from(repetitions) > most {
            return Err(Error::Repetitions {
                recording: self.layout.recording.name().to_owned(),
                repetitions,
                most,
            });
        }
        let results = Results {
            buffer: self.staging()?,
            spare: Arc::clone(&self.spare),
        };
        let state = Arc::new(AtomicU8::new(WAITING));
        let name = self.layout.recording.name();
        // Timestamps that are not written cannot be read.
        let clock = self.clock.as_ref().filter(|_| repetitions > 0);
        let submission = self
            .device
            .checked(name, self.layout.bytes, |device, queue| {
                let label = Some(name);
                let mut encoder =
                    device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
                let mut run = Run {
                    encoder: &mut encoder,
                    status: self.status.as_ref(),
                    steps: &self.steps,
                    clock,
                    results: results.buffer.as_ref(),
                    ticks: self.layout.ticks,
                };
                run.encode(repetitions);
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
            timing: clock.map_or(Timing::Off, |clock| clock.timing),
            labels: clock.map(|clock| Arc::clone(&clock.labels)),
            submission,
            state,
            results,
        })
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
    /// [`Error::Failed`] when a stage reported a failure, [`Error::DeviceLost`]; [`Error::Driver`] if
    /// the results cannot be read, or are not granted within 10 s after the run.
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
    /// Those of [`Pending::wait`] but [`Error::Failed`].
    pub fn wait_for_all(self) -> Result<(Output, Vec<Failure>), Error> {
        self.poll(wgpu::PollType::Wait {
            submission_index: Some(self.submission.clone()),
            timeout: None,
        })?;
        self.wait_for_callback();
        let refused = |message: &str| {
            self.device.explained(Error::Driver {
                what: format!("reading the results of `{}`", self.layout.recording.name()),
                message: message.to_owned(),
            })
        };
        if self.results.buffer.is_some() {
            match self.state.load(Ordering::Acquire) {
                MAPPED => {}
                WAITING => return Err(refused("the device did not wait")),
                _ => return Err(refused("the memory could not be mapped")),
            }
        }
        let device = self.device;
        let output = Output::new(
            self.layout,
            self.results,
            self.timing,
            self.labels,
            device.raw().1.get_timestamp_period(),
        )
        .map_err(|error| device.explained(error))?;
        let failures = output.failures();
        Ok((output, failures))
    }

    /// Another thread that waits for the device at the same time may have taken this run's callback
    /// from wgpu and be about to call it.
    fn wait_for_callback(&self) {
        // A run takes less than a millisecond, so that sleeping comes late; 10 s in all.
        const ROUNDS: u32 = 1000;
        const SLEEPS: u32 = 10_000;
        // A thread of a browser cannot sleep, and there is no other.
        if self.results.buffer.is_none() || cfg!(target_arch = "wasm32") {
            return;
        }
        for round in 0..ROUNDS + SLEEPS {
            if self.state.load(Ordering::Acquire) != WAITING {
                return;
            }
            if round < ROUNDS {
                std::thread::yield_now();
            } else {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    fn poll(&self, how: wgpu::PollType) -> Result<(), Error> {
        let what = format!("waiting for `{}`", self.layout.recording.name());
        let polled = self.device.poll(&what, how);
        // A run that a lost device took is none that can be waited for.
        polled.map_err(|error| self.device.explained(error))
    }
}
