//! Recordings: a list of commands over named buffers, as data.

use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::Pod;

use crate::buffer::Buffer;
use crate::error::Problem;
use crate::kernel::Kernel;

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
            buffer: buffer.raw().clone(),
            bytes: buffer.len() as u64 * size_of::<T>() as u64,
        }
    }
}

/// A [`Slot`] of any type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct AnySlot {
    pub(crate) recording: u32,
    pub(crate) index: u32,
}

/// A buffer for a slot that was declared with [`Recording::shared`].
#[derive(Clone, Debug)]
pub struct Shared {
    pub(crate) slot: AnySlot,
    pub(crate) buffer: wgpu::Buffer,
    pub(crate) bytes: u64,
}

/// A part of a recording whose kernels can report failures, by its bit in the status word.
///
/// A kernel that can fail binds [`Recording::status`] last and is given
/// `.constant("STAGE", stage)`; the part [`STATUS`](crate::STATUS) declares both and the function
/// `fail(element)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stage(pub(crate) u8);

impl From<Stage> for f64 {
    fn from(stage: Stage) -> Self {
        Self::from(stage.0)
    }
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
    Dispatch(Dispatch),
    Download(AnySlot),
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
    pub(crate) name: String,
    pub(crate) element: &'static str,
    pub(crate) stride: u64,
    pub(crate) len: u64,
    pub(crate) content: Option<Arc<[u8]>>,
    pub(crate) shared: bool,
}

impl Declaration {
    pub(crate) fn bytes(&self) -> u64 {
        self.len * self.stride
    }
}

/// A list of commands over named buffers: data that is built, checked and printed without a GPU,
/// then [prepared](crate::Device::prepare) once and run any number of times.
///
/// Commands take effect in order, each after all before it. Building cannot fail; what does not fit
/// together is reported by [`Recording::check`], all at once.
#[derive(Clone, Debug)]
pub struct Recording {
    pub(crate) id: u32,
    pub(crate) name: String,
    pub(crate) buffers: Vec<Declaration>,
    pub(crate) commands: Vec<Command>,
    pub(crate) stages: Vec<String>,
    pub(crate) status: Option<Slot<u32>>,
    /// What did not fit together while it was built.
    pub(crate) problems: Vec<Problem>,
    scopes: Vec<String>,
}

impl Recording {
    /// An empty recording.
    #[must_use]
    pub fn new(name: &str) -> Self {
        // Tells slots of one recording from those of another.
        static NEXT: AtomicU32 = AtomicU32::new(0);
        Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
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
            Groups::Indirect(groups.any, 4 * first as u64),
        );
    }

    /// Makes the content that a buffer has here readable after the run.
    pub fn download<T>(&mut self, slot: Slot<T>) {
        self.commands.push(Command::Download(slot.any));
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
        let found = self.stages.iter().position(|stage| stage == name);
        let place = found.unwrap_or_else(|| {
            self.stages.push(name.to_owned());
            self.stages.len() - 1
        });
        // Beyond the 32nd the recording is refused, so that the bit is never used.
        Stage(u8::try_from(place).unwrap_or(u8::MAX))
    }

    /// Refuses the recording unless two buffers have equally many elements: for functions that
    /// record a computation on both.
    pub fn require_same_len<A, B>(&mut self, first: Slot<A>, second: Slot<B>) {
        let found = (self.declaration(first.any), self.declaration(second.any));
        // A buffer of another recording is refused where it is used.
        if let (Some(a), Some(b)) = found
            && a.len != b.len
        {
            let problem = Problem::Lengths {
                what: self.scope_name(),
                first: a.name.clone(),
                first_len: a.len,
                second: b.name.clone(),
                second_len: b.len,
            };
            self.problems.push(problem);
        }
    }

    /// Refuses the recording unless a buffer has so many elements or more.
    pub fn require_len<T>(&mut self, slot: Slot<T>, least: u64) {
        if let Some(found) = self.declaration(slot.any)
            && found.len < least
        {
            let problem = Problem::Size {
                command: self.scope_name(),
                buffer: found.name.clone(),
                needed: least * found.stride,
                available: found.bytes(),
            };
            self.problems.push(problem);
        }
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
        let own = slot.recording == self.id;
        own.then(|| self.buffers.get(slot.index as usize))?
    }

    fn push_dispatch(&mut self, kernel: &Kernel, buffers: &[AnySlot], groups: Groups) {
        let label = self.label(kernel.name());
        self.commands.push(Command::Dispatch(Dispatch {
            label,
            kernel: kernel.clone(),
            buffers: buffers.to_vec(),
            groups,
        }));
    }

    /// What is recorded now.
    fn scope_name(&self) -> String {
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
        let index = u32::try_from(self.buffers.len()).unwrap_or(u32::MAX);
        self.buffers.push(Declaration {
            name,
            element: std::any::type_name::<T>(),
            stride: size_of::<T>() as u64,
            len: len as u64,
            content,
            shared,
        });
        Slot {
            any: AnySlot {
                recording: self.id,
                index,
            },
            element: PhantomData,
        }
    }
}

/// The word of bits, then for each stage the complement of its first failing element.
pub(crate) const STATUS_WORDS: usize = 33;
