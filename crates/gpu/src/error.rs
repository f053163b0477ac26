//! What can go wrong, and what to do about it.

use thiserror::Error;

/// Why nothing came of a call. The caller's data is as it was, and unless the device is lost the
/// next call works; after [`Error::DeviceLost`], [`Device::reopen`](crate::Device::reopen) gives
/// another.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// No adapter, or none like the one asked for.
    #[error(
        "no GPU adapter{wanted}; found: {found}. Install the driver of your GPU, or a software one (on Debian and Ubuntu `apt install mesa-vulkan-drivers libvulkan1`); VERTEBRA_ADAPTER chooses among several"
    )]
    NoAdapter {
        /// What was asked for, with a leading space; empty for any.
        wanted: String,
        /// Those there are.
        found: String,
    },
    /// The adapter lacks something. All of it is named.
    #[error("{adapter} lacks {}; ask for less, or choose another adapter", list(.missing))]
    Unsupported {
        /// Name of the adapter.
        adapter: String,
        /// Every feature and limit that falls short.
        missing: Vec<Shortfall>,
    },
    /// The driver refused to open the device.
    #[error("{adapter} cannot be opened: {message}")]
    Refused {
        /// Name of the adapter.
        adapter: String,
        /// What the driver says.
        message: String,
    },
    /// A recording that does not fit together. All that is wrong with it is named.
    #[error("recording `{recording}`: {}", list(.problems))]
    Recording {
        /// Name of the recording.
        recording: String,
        /// Everything wrong with it.
        problems: Vec<Problem>,
    },
    /// A shader that does not compile, or does not match its kernel's description.
    #[error("kernel `{kernel}` is not valid:\n{message}")]
    Shader {
        /// Name of the kernel.
        kernel: String,
        /// What the compiler says, with the line.
        message: String,
    },
    /// The device's memory is full.
    #[error(
        "no memory for {what} ({bytes} bytes) on the device: release buffers, or make the problem smaller"
    )]
    OutOfMemory {
        /// For what.
        what: String,
        /// How much was asked for \[byte\].
        bytes: u64,
    },
    /// The device is gone: reset, unplugged, or destroyed.
    #[error("the device was lost ({message}); open it again with Device::reopen")]
    DeviceLost {
        /// What the driver says.
        message: String,
    },
    /// A mistake of this library that the driver noticed.
    #[error("{what}: the driver refused a call: {message}")]
    Driver {
        /// During what.
        what: String,
        /// What the driver says.
        message: String,
    },
    /// Kernels reported that they failed.
    #[error("recording `{recording}` failed: {}", list(.failures))]
    Failed {
        /// Name of the recording.
        recording: String,
        /// The stages that failed, first of them first.
        failures: Vec<Failure>,
    },
    /// Data whose length is not the buffer's.
    #[error("`{buffer}` holds {expected} elements, {given} were given")]
    Length {
        /// Name of the buffer.
        buffer: String,
        /// Its length.
        expected: u64,
        /// Length of the data.
        given: u64,
    },
    /// A buffer of another recording, or one that this recording does not download.
    #[error("`{buffer}`: {reason}")]
    WrongBuffer {
        /// Name of the buffer.
        buffer: String,
        /// What is wrong.
        reason: &'static str,
    },
    /// Times were asked of a device that cannot take them.
    #[error("{adapter} has no timestamps (TIMESTAMP_QUERY): measure by the wall clock")]
    NoTimestamps {
        /// Name of the adapter.
        adapter: String,
    },
}

/// A feature or limit that falls short.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shortfall {
    /// A feature that is missing.
    Feature(String),
    /// A limit that is too low, or too high where less is better.
    Limit {
        /// Name of the limit.
        limit: &'static str,
        /// What is needed.
        needed: u64,
        /// What there is.
        available: u64,
    },
}

impl std::fmt::Display for Shortfall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Feature(name) => write!(f, "{name}"),
            Self::Limit {
                limit,
                needed,
                available,
            } => write!(f, "{limit} = {needed} (it has {available})"),
        }
    }
}

/// Something wrong with a recording.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Problem {
    /// A limit of the device.
    #[error("{what} needs {}", Shortfall::to_string(.shortfall))]
    Limit {
        /// Command or buffer.
        what: String,
        /// The limit.
        shortfall: Shortfall,
    },
    /// A kernel that uses a feature the device was not opened with.
    #[error("{command} uses {features}, with which the device was not opened")]
    Feature {
        /// The dispatch.
        command: String,
        /// The features.
        features: String,
    },
    /// A dispatch with too many or too few buffers.
    #[error("{command} has {expected} bindings, {given} buffers were given")]
    BindingCount {
        /// The dispatch.
        command: String,
        /// Bindings of the kernel.
        expected: usize,
        /// Buffers given.
        given: usize,
    },
    /// A buffer whose elements are of another size than the kernel's.
    #[error(
        "{command}: binding `{binding}` has elements of {expected} bytes, buffer `{buffer}` of {given}"
    )]
    Stride {
        /// The dispatch.
        command: String,
        /// Name of the binding.
        binding: &'static str,
        /// Name of the buffer.
        buffer: String,
        /// Bytes of an element in the kernel.
        expected: u64,
        /// Bytes of an element of the buffer.
        given: u64,
    },
    /// A buffer that one dispatch writes and uses a second time.
    #[error("{command} writes buffer `{buffer}` and uses it a second time; give it a copy")]
    Alias {
        /// The dispatch.
        command: String,
        /// Name of the buffer.
        buffer: String,
    },
    /// A buffer of another recording.
    #[error("{command} uses a buffer of another recording")]
    Foreign {
        /// The command.
        command: String,
    },
    /// Data or a copy that does not fit.
    #[error("{command}: `{buffer}` has {available} bytes, not {needed}")]
    Size {
        /// The command.
        command: String,
        /// Name of the buffer.
        buffer: String,
        /// Bytes the command needs.
        needed: u64,
        /// Bytes the buffer has.
        available: u64,
    },
    /// Two buffers of one computation with unequal lengths.
    #[error(
        "{what}: `{first}` has {first_len} elements and `{second}` has {second_len}; they must have equally many"
    )]
    Lengths {
        /// The computation.
        what: String,
        /// Name of the one buffer.
        first: String,
        /// Its elements.
        first_len: u64,
        /// Name of the other buffer.
        second: String,
        /// Its elements.
        second_len: u64,
    },
    /// Elements that are not a whole number of words.
    #[error("buffer `{buffer}` has elements of {bytes} bytes; they must be multiples of 4")]
    Element {
        /// Name of the buffer.
        buffer: String,
        /// Bytes of an element.
        bytes: u64,
    },
    /// A buffer that comes from elsewhere and was not given, or not as declared.
    #[error("shared buffer `{buffer}`: {reason}")]
    Shared {
        /// Name of the buffer.
        buffer: String,
        /// What is wrong.
        reason: &'static str,
    },
    /// More stages than a status word has bits.
    #[error("{stages} stages, a status word has 32 bits")]
    Stages {
        /// Number of stages.
        stages: usize,
    },
}

/// A stage that reported a failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Name of the stage.
    pub stage: String,
    /// The first element that failed in it.
    pub element: u32,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "stage `{}` at element {}", self.stage, self.element)
    }
}

fn list<T: ToString>(parts: &[T]) -> String {
    let parts: Vec<String> = parts.iter().map(T::to_string).collect();
    parts.join("; ")
}
