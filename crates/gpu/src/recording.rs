//! Recordings: a list of commands over named buffers, as data.

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::Pod;

use crate::buffer::Buffer;
use crate::device::Device;
use crate::kernel::Kernel;
use crate::problem::Problem;

/// A buffer of a recording, by its place in it.
#[derive(Debug)]
pub struct Slot<T> {
    any: AnySlot,
    element: PhantomData<fn() -> T>,
}

impl<T> Clone for Slot<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Slot<T> {}

impl<T> Slot<T> {
    /// The slot without its type, as the list of a dispatch takes it.
    #[must_use]
    pub fn any(self) -> AnySlot {
        self.any
    }

    /// Puts a buffer in this slot: for [`Device::prepare_with`](crate::Device::prepare_with).
    #[must_use]
    pub fn is(self, buffer: &Buffer<T>) -> Shared
    where
        T: Pod,
    {
        Shared {
            slot: self.any,
            device: buffer.device().clone(),
            name: buffer.name().to_owned(),
            buffer: buffer.raw().clone(),
            len: buffer.len() as u64,
        }
    }
}

/// A [`Slot`] of any type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct AnySlot {
    /// Of this declaration and no other, in whatever recording: a clone of a recording has the
    /// same buffers, and what is declared in one later is unknown to the other.
    id: u64,
    pub(crate) index: u32,
}

/// A number that no declaration has yet.
fn next_id() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// A buffer for a slot that was declared with [`Recording::shared`].
#[derive(Clone, Debug)]
pub struct Shared {
    pub(crate) slot: AnySlot,
    pub(crate) device: Device,
    pub(crate) name: String,
    pub(crate) buffer: wgpu::Buffer,
    pub(crate) len: u64,
}

/// A part of a recording whose kernels can report failures, by its bit in the status word.
///
/// A kernel that can fail binds [`Recording::status`] last and is given
/// `.constant("STAGE", stage)`; the part [`STATUS`](crate::STATUS) declares both and the function
/// `fail(element)`. A kernel with that part and without these is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stage {
    id: u64,
    pub(crate) bit: u8,
}

/// How much of a buffer is downloaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extent {
    Whole,
    /// From this byte to that.
    Part(u64, u64),
}

/// How many workgroups a dispatch has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Groups {
    Direct([u32; 3]),
    /// Three words in this slot, from this byte on.
    Indirect(AnySlot, u64),
}

#[derive(Clone, Debug)]
pub(crate) enum Command {
    Upload { to: AnySlot, data: Arc<[u8]> },
    Copy { from: AnySlot, to: AnySlot },
    Clear(AnySlot),
    Dispatch(Box<Dispatch>),
    Download(AnySlot, Extent),
}

#[derive(Clone, Debug)]
pub(crate) struct Dispatch {
    pub(crate) label: String,
    pub(crate) kernel: Kernel,
    pub(crate) buffers: Vec<AnySlot>,
    pub(crate) groups: Groups,
}

/// What is known of a buffer before there is one.
#[derive(Clone, Debug)]
pub(crate) struct Declaration {
    id: u64,
    pub(crate) name: String,
    pub(crate) element: &'static str,
    pub(crate) stride: u64,
    pub(crate) len: u64,
    pub(crate) content: Option<Arc<[u8]>>,
    pub(crate) shared: bool,
}

impl Declaration {
    /// Size \[byte\]. One that cannot be counted is refused by [`Recording::check`].
    pub(crate) fn bytes(&self) -> u64 {
        self.len.saturating_mul(self.stride)
    }
}

/// A list of commands over named buffers: data that is built, checked and printed without a GPU,
/// then [prepared](crate::Device::prepare) once and run any number of times.
///
/// Commands take effect in order, each after all before it. Building cannot fail; what does not fit
/// together is reported by [`Recording::check`], all at once.
///
/// Slots are good for the recording they come from and for clones of it that are made later.
#[derive(Clone, Debug)]
pub struct Recording {
    pub(crate) name: String,
    pub(crate) buffers: Vec<Declaration>,
    pub(crate) commands: Vec<Command>,
    /// Of each stage, its number and its name.
    pub(crate) stages: Vec<(u64, String)>,
    pub(crate) status: Option<Slot<u32>>,
    /// What did not fit together while it was built.
    pub(crate) problems: Vec<Problem>,
    scopes: Vec<String>,
}

impl Recording {
    /// An empty recording.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            buffers: Vec::new(),
            commands: Vec::new(),
            stages: Vec::new(),
            status: None,
            problems: Vec::new(),
            scopes: Vec::new(),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A buffer of `len` elements, zero when prepared; what a run leaves in it, the next run finds.
    pub fn buffer<T: Pod>(&mut self, name: &str, len: usize) -> Slot<T> {
        self.declare(name, len, None, false)
    }

    /// A buffer with this content when prepared.
    pub fn buffer_from<T: Pod>(&mut self, name: &str, content: &[T]) -> Slot<T> {
        let bytes = bytemuck::cast_slice(content).into();
        self.declare(name, content.len(), Some(bytes), false)
    }

    /// A place for a [`Buffer`] of `len` elements that is given when the recording is prepared.
    pub fn shared<T: Pod>(&mut self, name: &str, len: usize) -> Slot<T> {
        self.declare(name, len, None, true)
    }

    /// Copies data that is part of the recording to the start of a buffer.
    pub fn upload<T: Pod>(&mut self, to: Slot<T>, data: &[T]) {
        self.commands.push(Command::Upload {
            to: to.any,
            data: bytemuck::cast_slice(data).into(),
        });
    }

    /// Copies a buffer onto another of the same length.
    pub fn copy<T>(&mut self, from: Slot<T>, to: Slot<T>) {
        self.commands.push(Command::Copy {
            from: from.any,
            to: to.any,
        });
    }

    /// Fills a buffer with zeros.
    pub fn clear<T>(&mut self, slot: Slot<T>) {
        self.commands.push(Command::Clear(slot.any));
    }

    /// Runs a kernel with these buffers in the order of its bindings.
    pub fn dispatch(&mut self, kernel: &Kernel, buffers: &[AnySlot], groups: [u32; 3]) {
        self.push_dispatch(kernel, buffers, Groups::Direct(groups));
    }

    /// Runs a kernel with as many workgroups as three words of a buffer say, from the word `first`
    /// on. More than the device's limit are none.
    pub fn dispatch_indirect(
        &mut self,
        kernel: &Kernel,
        buffers: &[AnySlot],
        groups: Slot<u32>,
        first: usize,
    ) {
        self.push_dispatch(
            kernel,
            buffers,
            Groups::Indirect(groups.any, (first as u64).saturating_mul(4)),
        );
    }

    /// Makes the content that a buffer has here readable after the run. Of several downloads of a
    /// buffer the last counts.
    pub fn download<T>(&mut self, slot: Slot<T>) {
        (self.commands).push(Command::Download(slot.any, Extent::Whole));
    }

    /// The same of some of its elements: those are then what is read of it.
    pub fn download_part<T>(&mut self, slot: Slot<T>, elements: Range<usize>) {
        let at = |element: usize| (element as u64).saturating_mul(size_of::<T>() as u64);
        let part = Extent::Part(at(elements.start), at(elements.end.max(elements.start)));
        self.commands.push(Command::Download(slot.any, part));
    }

    /// Puts a name before the labels of the dispatches that `record` adds.
    pub fn scope<R>(&mut self, name: &str, record: impl FnOnce(&mut Self) -> R) -> R {
        self.scopes.push(name.to_owned());
        let result = record(self);
        self.scopes.pop();
        result
    }

    /// The stage of this name, 32 of them at most. See [`Stage`].
    pub fn stage(&mut self, name: &str) -> Stage {
        if let Some(bit) = self.stages.iter().position(|(_, stage)| stage == name) {
            let (id, bit) = (self.stages[bit].0, stage_bit(bit));
            return Stage { id, bit };
        }
        let (id, bit) = (next_id(), stage_bit(self.stages.len()));
        self.stages.push((id, name.to_owned()));
        Stage { id, bit }
    }

    /// The status word and the first failing element of each stage, zero before a run; read after
    /// it without being downloaded.
    pub fn status(&mut self) -> Slot<u32> {
        if let Some(status) = self.status {
            return status;
        }
        let status = self.buffer("status", STATUS_WORDS);
        self.status = Some(status);
        status
    }

    /// Number of dispatches.
    #[must_use]
    pub fn dispatches(&self) -> usize {
        let is_dispatch = |command: &&Command| matches!(command, Command::Dispatch(_));
        self.commands.iter().filter(is_dispatch).count()
    }

    /// Number of elements of a buffer; none of another recording's.
    #[must_use]
    pub fn len<T>(&self, slot: Slot<T>) -> Option<usize> {
        let declaration = self.declaration(slot.any)?;
        usize::try_from(declaration.len).ok()
    }

    pub(crate) fn declaration(&self, slot: AnySlot) -> Option<&Declaration> {
        let declaration = self.buffers.get(slot.index as usize);
        declaration.filter(|declaration| declaration.id == slot.id)
    }

    /// Whether a stage is one of this recording's.
    pub(crate) fn has_stage(&self, stage: Stage) -> bool {
        let declared = self.stages.get(usize::from(stage.bit));
        declared.is_some_and(|(id, _)| *id == stage.id)
    }

    /// Number, buffer, and first and last byte of the downloads that count.
    pub(crate) fn downloads(&self) -> impl Iterator<Item = (usize, AnySlot, [u64; 2])> {
        let commands = self.commands.iter().enumerate();
        commands.filter_map(|(number, command)| match command {
            Command::Download(slot, extent) => {
                let again = |c: &Command| matches!(c, Command::Download(later, _) if later == slot);
                let counts = !self.commands[number + 1..].iter().any(again);
                let bytes = match *extent {
                    Extent::Whole => [0, self.declaration(*slot).map_or(0, Declaration::bytes)],
                    Extent::Part(start, end) => [start, end],
                };
                counts.then_some((number, *slot, bytes))
            }
            _ => None,
        })
    }

    fn push_dispatch(&mut self, kernel: &Kernel, buffers: &[AnySlot], groups: Groups) {
        let label = self.label(kernel.name());
        self.commands.push(Command::Dispatch(Box::new(Dispatch {
            label,
            kernel: kernel.clone(),
            buffers: buffers.to_vec(),
            groups,
        })));
    }

    /// What is recorded now.
    pub(crate) fn scope_name(&self) -> String {
        if self.scopes.is_empty() {
            return self.name.clone();
        }
        self.scopes.join(".")
    }

    /// Scopes and name, with dots between.
    fn label(&self, name: &str) -> String {
        let scopes = self.scopes.iter().map(String::as_str);
        scopes.chain([name]).collect::<Vec<_>>().join(".")
    }

    fn declare<T: Pod>(
        &mut self,
        name: &str,
        len: usize,
        content: Option<Arc<[u8]>>,
        shared: bool,
    ) -> Slot<T> {
        let name = self.label(name);
        let id = next_id();
        let index = u32::try_from(self.buffers.len()).unwrap_or(u32::MAX);
        self.buffers.push(Declaration {
            id,
            name,
            element: std::any::type_name::<T>(),
            stride: size_of::<T>() as u64,
            len: len as u64,
            content,
            shared,
        });
        Slot {
            any: AnySlot { id, index },
            element: PhantomData,
        }
    }
}

/// Beyond the 32nd stage the recording is refused, so that the bit is never used.
fn stage_bit(place: usize) -> u8 {
    u8::try_from(place).unwrap_or(u8::MAX)
}

/// The word of bits, then for each stage the complement of its first failing element.
pub(crate) const STATUS_WORDS: usize = 33;
