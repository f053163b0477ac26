//! What can be wrong with a recording.

use thiserror::Error;

use crate::error::Shortfall;

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
    /// A kernel that can fail, whose failures would be lost.
    #[error("{command} can fail, but {reason}")]
    Stage {
        /// The dispatch.
        command: String,
        /// What is wrong.
        reason: &'static str,
    },
    /// A command that would overwrite the failures that kernels report.
    #[error(
        "{command} writes `{buffer}`, in which kernels report failures: it is cleared before each run, and nothing else may write it"
    )]
    Status {
        /// The command.
        command: String,
        /// Name of the buffer.
        buffer: String,
    },
    /// A kernel whose shader differs from what is declared of it.
    #[error("kernel `{kernel}`: {what} is declared as {declared}, its WGSL has {found}")]
    Kernel {
        /// Name of the kernel.
        kernel: String,
        /// What differs.
        what: String,
        /// What the kernel declares.
        declared: String,
        /// What its shader has.
        found: String,
    },
    /// A buffer of more bytes than can be counted.
    #[error("buffer `{buffer}`: {len} elements of {stride} bytes are 2^64 bytes or more")]
    Overflow {
        /// Name of the buffer.
        buffer: String,
        /// Number of elements.
        len: u64,
        /// Bytes of an element.
        stride: u64,
    },
    /// Data that does not fit.
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
    #[error("buffer `{buffer}` has elements of {bytes} bytes; they must be 4, 8, 12, ...")]
    Element {
        /// Name of the buffer.
        buffer: String,
        /// Bytes of an element.
        bytes: u64,
    },
    /// A buffer that comes from elsewhere and was not given, not as declared, or twice.
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
