//! Programs: recordings with their buffers, pipelines and bind groups on a device.

use std::sync::{Arc, Mutex};

use bytemuck::Pod;

use crate::buffer::{allocate, write};
use crate::device::{Device, lock};
use crate::error::{Error, Problem, Shortfall};
use crate::recording::{AnySlot, Command, Dispatch, Groups, Recording, Shared, Slot};
use crate::slots::{fill, resource};
use crate::timing::{Clock, Timing};

/// A recording made ready on a device: run it any number of times.
///
/// After the first runs nothing of it is allocated again: buffers, pipelines and bind groups are
/// kept, and so is the memory that results are read from.
#[derive(Debug)]
pub struct Program {
    pub(crate) device: Device,
    pub(crate) layout: Arc<Layout>,
    /// Cleared before a run.
    pub(crate) status: Option<wgpu::Buffer>,
    pub(crate) steps: Vec<Step>,
    pub(crate) clock: Option<Clock>,
    buffers: Vec<wgpu::Buffer>,
    /// Memory for results that no run uses now.
    pub(crate) spare: Arc<Mutex<Vec<wgpu::Buffer>>>,
}

/// Where results lie in the memory they are read from.
#[derive(Debug)]
pub(crate) struct Layout {
    pub(crate) recording: Recording,
    /// Slot, first byte and size of each download.
    pub(crate) downloads: Vec<(AnySlot, u64, u64)>,
    /// First byte of the ticks.
    pub(crate) ticks: u64,
    /// All of it \[byte\].
    pub(crate) bytes: u64,
}

/// What a run encodes: dispatches that follow each other make one pass.
#[derive(Debug)]
pub(crate) enum Step {
    Pass(Vec<Bound>),
    Copy {
        from: wgpu::Buffer,
        to: wgpu::Buffer,
        bytes: u64,
    },
    Clear(wgpu::Buffer),
    Download {
        from: wgpu::Buffer,
        /// First byte of what is downloaded, and where it goes.
        first: u64,
        at: u64,
        bytes: u64,
    },
}

impl Step {
    pub(crate) fn is_download(&self) -> bool {
        matches!(self, Self::Download { .. })
    }
}

/// A dispatch with its buffers.
#[derive(Debug)]
pub(crate) struct Bound {
    pub(crate) label: String,
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) buffers: wgpu::BindGroup,
    pub(crate) groups: BoundGroups,
}

#[derive(Debug)]
pub(crate) enum BoundGroups {
    Direct([u32; 3]),
    Indirect(wgpu::Buffer, u64),
}

impl Program {
    pub(crate) fn new(
        device: &Device,
        recording: &Recording,
        shared: &[Shared],
    ) -> Result<Self, Error> {
        recording.check(&device.limits(), device.features())?;
        let mut recording = recording.clone();
        // A run ends with reading the failures.
        if let Some(status) = recording.status {
            recording.download(status);
        }
        let buffers = fill(device, &recording, shared)?;
        let status = recording.status.map(|slot| slot.any().index as usize);
        let mut builder = Builder {
            device,
            recording: &recording,
            buffers: &buffers,
            steps: Vec::new(),
        };
        let mut counting = recording.downloads().peekable();
        let mut downloads = Vec::new();
        let mut bytes = 0;
        for (number, command) in recording.commands.iter().enumerate() {
            if let Some((_, slot, part)) = counting.next_if(|(counts, ..)| *counts == number) {
                let size = part[1] - part[0];
                builder.download(slot, part[0], (bytes, size));
                downloads.push((slot, bytes, size));
                bytes += size;
            } else {
                builder.command(command)?;
            }
        }
        let steps = builder.steps;
        drop(counting);
        Ok(Self {
            status: status.map(|place| buffers[place].clone()),
            steps,
            device: device.clone(),
            layout: Arc::new(Layout {
                recording,
                downloads,
                ticks: bytes,
                bytes,
            }),
            clock: None,
            buffers,
            spare: Arc::default(),
        })
    }

    /// Takes the time of the following runs on the GPU: see [`Timing`].
    ///
    /// # Errors
    /// [`Error::NoTimestamps`] where the device has none; [`Error::Recording`] where results and
    /// times together are larger than a buffer can be; [`Error::OutOfMemory`],
    /// [`Error::DeviceLost`].
    pub fn take_times(&mut self, timing: Timing) -> Result<(), Error> {
        let clock = Clock::new(&self.device, timing, &self.steps)?;
        let layout = &self.layout;
        let bytes = layout.ticks + clock.as_ref().map_or(0, Clock::bytes);
        let available = self.device.limits().max_buffer_size;
        if bytes > available {
            return Err(Error::Recording {
                recording: layout.recording.name().to_owned(),
                problems: vec![Problem::Limit {
                    what: "what is downloaded, together with times,".to_owned(),
                    shortfall: Shortfall::Limit {
                        limit: "max_buffer_size",
                        needed: bytes,
                        available,
                    },
                }],
            });
        }
        self.layout = Arc::new(Layout {
            recording: layout.recording.clone(),
            downloads: layout.downloads.clone(),
            ticks: layout.ticks,
            bytes,
        });
        self.clock = clock;
        // Of another size, and runs that are under way give theirs back to the old list.
        self.spare = Arc::default();
        Ok(())
    }

    /// Replaces the content of a buffer before the next run, as [`Buffer::write`](crate::Buffer::write)
    /// does.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one element for each; [`Error::WrongBuffer`] of another
    /// recording; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn write<T: Pod>(&self, slot: Slot<T>, content: &[T]) -> Result<(), Error> {
        let declaration = self.layout.recording.declaration(slot.any());
        let (Some(declaration), Some(buffer)) = (declaration, self.raw(slot)) else {
            return Err(Error::WrongBuffer {
                buffer: "slot".to_owned(),
                reason: "it belongs to another recording",
            });
        };
        let len = usize::try_from(declaration.len).unwrap_or(usize::MAX);
        write(&self.device, &declaration.name, buffer, len, content)
    }

    /// The buffer of wgpu in a slot; none of another recording's.
    #[must_use]
    pub fn raw<T>(&self, slot: Slot<T>) -> Option<&wgpu::Buffer> {
        self.layout.recording.declaration(slot.any())?;
        self.buffers.get(slot.any().index as usize)
    }

    /// Commands of a run.
    pub(crate) fn commands(&self) -> u64 {
        let of = |step: &Step| match step {
            Step::Pass(dispatches) => dispatches.len() as u64,
            _ => 1,
        };
        self.steps.iter().map(of).sum()
    }

    /// The device it was prepared on.
    #[must_use]
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Memory that results are read from: one that is free, or a new one.
    pub(crate) fn staging(&self) -> Result<Option<wgpu::Buffer>, Error> {
        if self.layout.bytes == 0 {
            return Ok(None);
        }
        if let Some(buffer) = lock(&self.spare).pop() {
            return Ok(Some(buffer));
        }
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        allocate(&self.device, "results", self.layout.bytes, usage).map(Some)
    }
}

struct Builder<'a> {
    device: &'a Device,
    recording: &'a Recording,
    buffers: &'a [wgpu::Buffer],
    steps: Vec<Step>,
}

impl Builder<'_> {
    fn command(&mut self, command: &Command) -> Result<(), Error> {
        let step = match command {
            Command::Dispatch(dispatch) => {
                let bound = self.bind(dispatch)?;
                if let Some(Step::Pass(pass)) = self.steps.last_mut() {
                    pass.push(bound);
                    return Ok(());
                }
                Step::Pass(vec![bound])
            }
            Command::Upload { to, data } => {
                let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
                let from = allocate(self.device, "upload", data.len() as u64, usage)?;
                write(self.device, "upload", &from, data.len(), data)?;
                Step::Copy {
                    from,
                    to: self.buffer(*to),
                    bytes: data.len() as u64,
                }
            }
            Command::Copy { from, to } => Step::Copy {
                from: self.buffer(*from),
                to: self.buffer(*to),
                bytes: self.bytes(*from),
            },
            Command::Clear(slot) => Step::Clear(self.buffer(*slot)),
            // One that does not count: there is another of the same buffer later.
            Command::Download(..) => return Ok(()),
        };
        self.steps.push(step);
        Ok(())
    }

    /// From its first byte on to a place for so many.
    fn download(&mut self, slot: AnySlot, first: u64, (at, bytes): (u64, u64)) {
        self.steps.push(Step::Download {
            from: self.buffer(slot),
            first,
            at,
            bytes,
        });
    }

    fn bind(&self, dispatch: &Dispatch) -> Result<Bound, Error> {
        let name = self.recording.name();
        let compiled = self.device.pipeline(name, &dispatch.kernel)?;
        let entries: Vec<_> = (0..)
            .zip(&dispatch.buffers)
            .map(|(binding, slot)| wgpu::BindGroupEntry {
                binding,
                resource: resource(self.recording, self.buffers, *slot),
            })
            .collect();
        let buffers = self.device.checked(&dispatch.label, 0, |device, _| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(&dispatch.label),
                layout: &compiled.layout,
                entries: &entries,
            })
        })?;
        Ok(Bound {
            label: dispatch.label.clone(),
            pipeline: compiled.pipeline,
            buffers,
            groups: match dispatch.groups {
                Groups::Direct(groups) => BoundGroups::Direct(groups),
                Groups::Indirect(slot, offset) => BoundGroups::Indirect(self.buffer(slot), offset),
            },
        })
    }

    fn bytes(&self, slot: AnySlot) -> u64 {
        let declaration = self.recording.declaration(slot);
        declaration.map_or(0, |declaration| declaration.bytes())
    }

    fn buffer(&self, slot: AnySlot) -> wgpu::Buffer {
        self.buffers[slot.index as usize].clone()
    }
}
