//! Devices: an adapter opened with what is needed of it.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytemuck::Pod;

use crate::adapter::{Identity, choose, find};
use crate::buffer::Buffer;
use crate::error::Error;
use crate::kernel::Kernel;
use crate::options::Options;
use crate::pipeline::Pipeline;
use crate::program::Program;
use crate::recording::{Recording, Shared as SharedSlot};
use crate::staging::Staging;

/// An open device. Clones are the same device.
///
/// It keeps every kernel that it has compiled until the last clone is dropped, programs included:
/// whoever makes ever new kernels at run time opens a device for them.
#[derive(Clone, Debug)]
pub struct Device {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    identity: Identity,
    options: Options,
    /// What the driver said when the device was lost.
    lost: Arc<Mutex<Option<String>>>,
    /// Never forgotten: a kernel is compiled once, whatever programs come and go.
    pipelines: Mutex<HashMap<Kernel, Pipeline>>,
    staging: Staging,
}

impl Device {
    /// Opens the best adapter there is, or the one [`ADAPTER_VARIABLE`](crate::ADAPTER_VARIABLE)
    /// names, with the default [`Options`].
    ///
    /// # Errors
    /// Those of [`Device::open`].
    pub fn auto() -> Result<Self, Error> {
        Self::open(Options::default())
    }

    /// Opens a device.
    ///
    /// # Errors
    /// [`Error::NoAdapter`]; [`Error::Unsupported`] with every feature and limit that falls short;
    /// [`Error::Refused`] by the driver.
    pub fn open(options: Options) -> Result<Self, Error> {
        let (adapter, identity) = choose(&options.adapter, options.memory())?;
        Self::of(&adapter, identity, options)
    }

    fn of(adapter: &wgpu::Adapter, identity: Identity, options: Options) -> Result<Self, Error> {
        let info = adapter.get_info();
        let available = adapter.limits();
        let missing = options.missing(adapter.features(), &available);
        if !missing.is_empty() {
            return Err(Error::Unsupported {
                adapter: info.name,
                missing,
            });
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("vertebra"),
            required_features: options.required | (options.wanted & adapter.features()),
            required_limits: if options.exact_limits {
                options.limits.clone()
            } else {
                available
            },
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
                Error::Refused {
                    adapter: info.name.clone(),
                    message: error.to_string(),
                }
            })?;
        let lost = Arc::new(Mutex::new(None));
        let note = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, message| {
            let reason = format!("{reason:?}. {message}").to_lowercase();
            *lock(&note) = Some(reason.trim_end_matches(['.', ' ']).to_owned());
        });
        // What no call waits for, such as a failure while dropping, must not end the process.
        device.on_uncaptured_error(Arc::new(|error| log::error!("{error}")));
        Ok(Self {
            shared: Arc::new(Shared {
                device,
                queue,
                info,
                identity,
                options,
                lost,
                pipelines: Mutex::default(),
                staging: Staging::default(),
            }),
        })
    }

    /// Opens the same adapter again with the same options, after the device was lost. Buffers and
    /// programs are those of the device they were made on: prepare the recordings again.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] where that adapter is gone, even if there are others;
    /// [`Error::Unsupported`], [`Error::Refused`].
    pub fn reopen(&self) -> Result<Self, Error> {
        self.reopen_with(self.shared.options.clone())
    }

    /// [`Device::reopen`] with other options; of these the choice of an adapter counts for nothing.
    ///
    /// # Errors
    /// Those of [`Device::reopen`].
    pub fn reopen_with(&self, options: Options) -> Result<Self, Error> {
        let identity = &self.shared.identity;
        let adapter = find(identity, options.memory())?;
        Self::of(&adapter, identity.clone(), options)
    }

    /// Whether both are one device, whose buffers can be used together.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.shared, &other.shared)
    }

    /// Name, kind and driver of the adapter.
    #[must_use]
    pub fn info(&self) -> &wgpu::AdapterInfo {
        &self.shared.info
    }

    /// Name, driver and interface in one line.
    #[must_use]
    pub fn description(&self) -> String {
        let info = self.info();
        let driver = [&info.driver, &info.driver_info]
            .map(|text| text.as_str())
            .join(" ");
        format!("{} ({:?}, {})", info.name, info.backend, driver.trim())
    }

    /// Features the device was opened with.
    #[must_use]
    pub fn features(&self) -> wgpu::Features {
        self.shared.device.features()
    }

    /// Limits the device was opened with.
    #[must_use]
    pub fn limits(&self) -> wgpu::Limits {
        self.shared.device.limits()
    }

    /// The device and queue of wgpu, for what this crate does not do.
    #[must_use]
    pub fn raw(&self) -> (&wgpu::Device, &wgpu::Queue) {
        (&self.shared.device, &self.shared.queue)
    }

    /// A buffer of zeros that several programs can share. `len` is in elements.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::Recording`] beyond the device's limits,
    /// [`Error::DeviceLost`].
    pub fn buffer<T: Pod>(&self, name: &str, len: usize) -> Result<Buffer<T>, Error> {
        Buffer::new(self, name, len)
    }

    /// A buffer with this content that several programs can share.
    ///
    /// # Errors
    /// Those of [`Device::buffer`].
    pub fn buffer_from<T: Pod>(&self, name: &str, content: &[T]) -> Result<Buffer<T>, Error> {
        let buffer = Buffer::new(self, name, content.len())?;
        buffer.write(content)?;
        Ok(buffer)
    }

    /// Checks a recording, allocates its buffers, and compiles the pipelines that are not yet.
    ///
    /// # Errors
    /// [`Error::Recording`] with all that is wrong with it, [`Error::Shader`],
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn prepare(&self, recording: &Recording) -> Result<Program, Error> {
        Program::new(self, recording, &[])
    }

    /// [`Device::prepare`] with buffers in place of the recording's shared ones.
    ///
    /// # Errors
    /// Those of [`Device::prepare`].
    pub fn prepare_with(
        &self,
        recording: &Recording,
        shared: &[SharedSlot],
    ) -> Result<Program, Error> {
        Program::new(self, recording, shared)
    }

    /// The pipeline of a kernel of this recording, compiled at the first call.
    pub(crate) fn pipeline(&self, recording: &str, kernel: &Kernel) -> Result<Pipeline, Error> {
        if let Some(pipeline) = lock(&self.shared.pipelines).get(kernel) {
            return Ok(pipeline.clone());
        }
        let pipeline = Pipeline::compile(self, recording, kernel)?;
        lock(&self.shared.pipelines).insert(kernel.clone(), pipeline.clone());
        Ok(pipeline)
    }

    /// Memory through which content reaches it.
    pub(crate) fn staging(&self) -> &Staging {
        &self.shared.staging
    }

    /// Runs calls of wgpu and returns an error that they caused instead of panicking. `bytes` is what
    /// they allocate.
    ///
    /// Of several errors the first of its kind is kept, and of kinds an internal one before a full
    /// memory before a mistake: the latter are what becomes of calls after the former. That the
    /// device is lost comes before all.
    pub(crate) fn checked<R>(
        &self,
        what: &str,
        bytes: u64,
        calls: impl FnOnce(&wgpu::Device, &wgpu::Queue) -> R,
    ) -> Result<R, Error> {
        self.alive()?;
        let device = &self.shared.device;
        let scopes = [
            wgpu::ErrorFilter::Internal,
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Validation,
        ]
        .map(|filter| device.push_error_scope(filter));
        let result = calls(device, &self.shared.queue);
        let mut error = None;
        for scope in scopes.into_iter().rev() {
            error = pollster::block_on(scope.pop()).or(error);
        }
        self.alive()?;
        error.map_or(Ok(result), |error| {
            Err(self.explained(typed(&error, what, bytes)))
        })
    }

    /// Lets wgpu see what the device has done.
    pub(crate) fn poll(&self, what: &str, how: wgpu::PollType) -> Result<(), Error> {
        let polled = guarded(|| self.shared.device.poll(how));
        if let Err(message) = &polled {
            lock(&self.shared.lost).get_or_insert_with(|| message.clone());
        }
        self.alive()?;
        match polled {
            Ok(Err(error)) => Err(Error::Driver {
                what: what.to_owned(),
                message: error.to_string(),
            }),
            _ => Ok(()),
        }
    }

    /// What is behind an error: a device that was destroyed refuses calls as if they were mistakes,
    /// and says what became of it only once its work is done and it is asked.
    pub(crate) fn explained(&self, error: Error) -> Error {
        let Error::Driver { what, .. } = &error else {
            return error;
        };
        match self.poll(what, wgpu::PollType::wait_indefinitely()) {
            Err(lost @ Error::DeviceLost { .. }) => lost,
            _ => error,
        }
    }

    /// An error if the device is lost.
    pub(crate) fn alive(&self) -> Result<(), Error> {
        match &*lock(&self.shared.lost) {
            None => Ok(()),
            Some(message) => Err(Error::DeviceLost {
                message: message.clone(),
            }),
        }
    }
}

/// What a call of wgpu returns, or the message with which it panicked: waiting for a device that
/// the driver gives up panics instead of failing. wgpu holds no lock at that point.
fn guarded<R>(call: impl FnOnce() -> R) -> Result<R, String> {
    catch_unwind(AssertUnwindSafe(call)).map_err(|payload| {
        let text = payload.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| payload.downcast_ref::<&str>().copied());
        // The last line is the cause.
        let cause = text.and_then(|text| text.lines().rfind(|line| !line.trim().is_empty()));
        cause.unwrap_or("no reason given").trim().to_owned()
    })
}

/// An error of wgpu in the words of this crate.
fn typed(error: &wgpu::Error, what: &str, bytes: u64) -> Error {
    let what = what.to_owned();
    match error {
        wgpu::Error::OutOfMemory { .. } => Error::OutOfMemory { what, bytes },
        other => Error::Driver {
            what,
            message: other.to_string(),
        },
    }
}

/// The content of a lock. A thread that panicked left it whole: nothing is changed in steps.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_memory_is_told_from_a_mistake() {
        let source = || "cause".into();
        let full = wgpu::Error::OutOfMemory { source: source() };
        let text = typed(&full, "buffer `x`", 64).to_string();
        assert!(
            text.starts_with("no memory for buffer `x` (64 bytes)"),
            "{text}"
        );
        let mistake = wgpu::Error::Validation {
            source: source(),
            description: "too long".to_owned(),
        };
        let text = typed(&mistake, "upload", 0).to_string();
        assert_eq!(text, "upload: the driver refused a call: too long");
    }

    #[test]
    fn a_panic_while_waiting_is_a_message() {
        assert_eq!(guarded(|| 3), Ok(3));
        // As wgpu words it.
        let lost = guarded(|| {
            panic!(
                "Error in Device::poll: Validation Error\n\nCaused by:\n  {}\n",
                "Parent device is lost"
            );
        });
        assert_eq!(lost, Err::<(), _>("Parent device is lost".to_owned()));
        assert_eq!(guarded(|| panic!("gone")), Err::<(), _>("gone".to_owned()));
    }
}
