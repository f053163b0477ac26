//! What can go wrong, and what to do about it.

use thiserror::Error;

pub use crate::problem::Problem;

/// Why nothing came of a call. Unless the device is lost the next call works; after
/// [`Error::DeviceLost`], [`Device::reopen`](crate::Device::reopen) gives another.
///
/// All but two leave the content of buffers as it was: a run that [failed](Error::Failed) has left
/// in them what it computed until its end, and those of a lost device are gone.
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
    /// A shader that does not compile. One that differs from its kernel is a [`Problem::Kernel`].
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
    /// More repetitions than one submission can hold.
    #[error(
        "{repetitions} repetitions of `{recording}` are too many for one submission: submit at most {most} at a time"
    )]
    Repetitions {
        /// Name of the recording.
        recording: String,
        /// How many were asked for.
        repetitions: u32,
        /// How many of them there may be.
        most: u64,
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
    /// A slot of another recording, or one that this recording does not download.
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
