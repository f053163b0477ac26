//! Programs: recordings with their buffers, pipelines and bind groups on a device.

use std::sync::{Arc, Mutex};

use bytemuck::Pod;

use crate::buffer::{USES, allocate, write};
use crate::device::{Device, lock};
use crate::error::{Error, Problem};
use crate::recording::{AnySlot, Command, Dispatch, Groups, Recording, Shared, Slot};
use crate::timing::{Clock, Timing};

/// A recording made ready on a device: run it any number of times.
///
/// After the first runs nothing of it is allocated again: buffers, pipelines and bind groups are
/// kept, and so is the memory that results are read from.
#[derive(Debug)]
pub struct Program {
    pub(crate) device: Device,
    pub(crate) layout: Arc<Layout>,
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
    /// Slot and first byte of each download.
    pub(crate) downloads: Vec<(AnySlot, u64)>,
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
        at: u64,
        bytes: u64,
    },
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
        // A run begins without failures and ends with reading them.
        if let Some(status) = recording.status {
            recording.commands.insert(0, Command::Clear(status.any()));
            recording.download(status);
        }
        let buffers = buffers(device, &recording, shared)?;
        let mut layout = Layout {
            recording,
            downloads: Vec::new(),
            ticks: 0,
            bytes: 0,
        };
        let mut builder = Builder {
            device,
            buffers: &buffers,
            steps: Vec::new(),
        };
        for command in &layout.recording.commands {
            if let Command::Download(slot) = command {
                layout.downloads.push((*slot, layout.bytes));
            }
            builder.command(&layout.recording, command, &mut layout.bytes)?;
        }
        layout.ticks = layout.bytes;
        Ok(Self {
            steps: builder.steps,
            device: device.clone(),
            layout: Arc::new(layout),
            clock: None,
            buffers,
            spare: Arc::default(),
        })
    }

    /// Takes the time of the following runs on the GPU: around the whole, or also of each dispatch.
    ///
    /// # Errors
    /// [`Error::NoTimestamps`] where the device has none; [`Error::OutOfMemory`],
    /// [`Error::DeviceLost`].
    pub fn take_times(&mut self, timing: Timing) -> Result<(), Error> {
        let clock = Clock::new(&self.device, timing, &self.steps)?;
        let ticks = clock.as_ref().map_or(0, Clock::bytes);
        let layout = &self.layout;
        self.layout = Arc::new(Layout {
            recording: layout.recording.clone(),
            downloads: layout.downloads.clone(),
            ticks: layout.ticks,
            bytes: layout.ticks + ticks,
        });
        self.clock = clock;
        // Of another size, and runs that are under way give theirs back to the old list.
        self.spare = Arc::default();
        Ok(())
    }

    /// Replaces the content of a buffer before the next run.
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

/// The buffers of a recording: made, or given.
fn buffers(
    device: &Device,
    recording: &Recording,
    shared: &[Shared],
) -> Result<Vec<wgpu::Buffer>, Error> {
    let mut indirect = vec![false; recording.buffers.len()];
    let mut strides = vec![0_u64; recording.buffers.len()];
    for command in &recording.commands {
        if let Command::Dispatch(dispatch) = command {
            for (slot, binding) in dispatch.buffers.iter().zip(dispatch.kernel.bindings()) {
                strides[slot.index as usize] = binding.stride.into();
            }
            if let Groups::Indirect(slot, _) = dispatch.groups {
                indirect[slot.index as usize] = true;
            }
        }
    }
    let mut problems = Vec::new();
    let mut buffers = Vec::with_capacity(recording.buffers.len());
    for (number, declaration) in (0..).zip(&recording.buffers) {
        let slot = AnySlot {
            recording: recording.id,
            index: number,
        };
        let given = shared.iter().find(|given| given.slot == slot);
        let place = number as usize;
        let mut wrong = |reason| {
            problems.push(Problem::Shared {
                buffer: declaration.name.clone(),
                reason,
            });
        };
        match given {
            Some(_) if !declaration.shared => wrong("it was not declared as shared"),
            Some(given) if given.bytes != declaration.bytes() => {
                wrong("the buffer given has another length");
            }
            Some(_) if indirect[place] => {
                wrong("numbers of workgroups must lie in the recording's own buffers");
            }
            Some(given) => buffers.push(given.buffer.clone()),
            None if declaration.shared => wrong("no buffer was given for it"),
            None => {
                let mut usage = USES;
                // Only where needed: it costs a bind group each.
                usage.set(wgpu::BufferUsages::INDIRECT, indirect[place]);
                let bytes = declaration.bytes().max(strides[place]);
                let buffer = allocate(device, &declaration.name, bytes, usage)?;
                if let Some(content) = &declaration.content {
                    write(device, &declaration.name, &buffer, content.len(), content)?;
                }
                buffers.push(buffer);
            }
        }
    }
    if problems.is_empty() {
        return Ok(buffers);
    }
    Err(Error::Recording {
        recording: recording.name.clone(),
        problems,
    })
}

struct Builder<'a> {
    device: &'a Device,
    buffers: &'a [wgpu::Buffer],
    steps: Vec<Step>,
}

impl Builder<'_> {
    fn command(
        &mut self,
        recording: &Recording,
        command: &Command,
        end: &mut u64,
    ) -> Result<(), Error> {
        let bytes = |slot: &AnySlot| recording.declaration(*slot).map_or(0, |d| d.bytes());
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
                bytes: bytes(from),
            },
            Command::Clear(slot) => Step::Clear(self.buffer(*slot)),
            Command::Download(slot) => {
                let at = *end;
                *end += bytes(slot);
                Step::Download {
                    from: self.buffer(*slot),
                    at,
                    bytes: bytes(slot),
                }
            }
        };
        self.steps.push(step);
        Ok(())
    }

    fn bind(&self, dispatch: &Dispatch) -> Result<Bound, Error> {
        let compiled = self.device.pipeline(&dispatch.kernel)?;
        let entries: Vec<_> = (0..)
            .zip(&dispatch.buffers)
            .map(|(binding, slot)| wgpu::BindGroupEntry {
                binding,
                resource: self.buffers[slot.index as usize].as_entire_binding(),
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

    fn buffer(&self, slot: AnySlot) -> wgpu::Buffer {
        self.buffers[slot.index as usize].clone()
    }
}
