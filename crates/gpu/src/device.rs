//! Devices: an adapter opened with what is needed of it.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytemuck::Pod;

use crate::adapter::{AdapterChoice, choose};
use crate::buffer::Buffer;
use crate::error::{Error, Shortfall};
use crate::kernel::Kernel;
use crate::pipeline::Pipeline;
use crate::program::Program;
use crate::recording::{Recording, Shared as SharedSlot};

/// What is asked of a device.
#[derive(Clone, Debug)]
pub struct Options {
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Features without which the device is useless.
    pub required: wgpu::Features,
    /// Features to take where the adapter has them.
    pub wanted: wgpu::Features,
    /// Limits below which the device is useless.
    pub limits: wgpu::Limits,
    /// Whether to open the device with exactly these limits, to see that they suffice, instead of
    /// the best the adapter has.
    pub exact_limits: bool,
    /// Part of the device's memory budget beyond which allocations are refused \[percent\]; where the
    /// driver tells the budget.
    pub memory_percent: Option<u8>,
}

impl Default for Options {
    /// Any adapter with eight storage buffers a shader; f64, subgroups and timestamps where it has
    /// them.
    fn default() -> Self {
        Self {
            adapter: AdapterChoice::Auto,
            required: wgpu::Features::empty(),
            wanted: wgpu::Features::SHADER_F64
                | wgpu::Features::SUBGROUP
                | wgpu::Features::TIMESTAMP_QUERY,
            limits: wgpu::Limits {
                max_storage_buffers_per_shader_stage: 8,
                ..wgpu::Limits::downlevel_defaults()
            },
            exact_limits: false,
            memory_percent: None,
        }
    }
}

/// An open device. Clones are the same device.
#[derive(Clone, Debug)]
pub struct Device {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    options: Options,
    /// What the driver said when the device was lost.
    lost: Arc<Mutex<Option<String>>>,
    pipelines: Mutex<HashMap<Kernel, Pipeline>>,
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
        let memory = wgpu::MemoryBudgetThresholds {
            for_resource_creation: options.memory_percent,
            for_device_loss: None,
        };
        let adapter = choose(&options.adapter, memory)?;
        let info = adapter.get_info();
        let available = adapter.limits();
        let missing = missing(&options, adapter.features(), &available);
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
                options,
                lost,
                pipelines: Mutex::default(),
            }),
        })
    }

    /// Opens the same adapter again with the same options, after the device was lost. Buffers and
    /// programs are those of the device they were made on: prepare the recordings again.
    ///
    /// # Errors
    /// Those of [`Device::open`].
    pub fn reopen(&self) -> Result<Self, Error> {
        Self::open(self.shared.options.clone())
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

    /// The pipeline of a kernel, compiled at the first call.
    pub(crate) fn pipeline(&self, kernel: &Kernel) -> Result<Pipeline, Error> {
        if let Some(pipeline) = lock(&self.shared.pipelines).get(kernel) {
            return Ok(pipeline.clone());
        }
        let pipeline = Pipeline::compile(self, kernel)?;
        lock(&self.shared.pipelines).insert(kernel.clone(), pipeline.clone());
        Ok(pipeline)
    }

    /// Runs calls of wgpu and returns the first error they caused instead of panicking. `bytes` is
    /// what they allocate.
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
        error.map_or(Ok(result), |error| Err(typed(&error, what, bytes)))
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

/// Everything that falls short of what is asked.
fn missing(
    options: &Options,
    features: wgpu::Features,
    available: &wgpu::Limits,
) -> Vec<Shortfall> {
    let lacking = options.required - features;
    let mut missing: Vec<Shortfall> = lacking
        .iter_names()
        .map(|(name, _)| Shortfall::Feature(name.to_owned()))
        .collect();
    let note = |limit, needed, available| {
        missing.push(Shortfall::Limit {
            limit,
            needed,
            available,
        });
    };
    options
        .limits
        .check_limits_with_fail_fn(available, false, note);
    missing
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
    fn every_shortfall_is_named_at_once() {
        let options = Options {
            required: wgpu::Features::SHADER_F64 | wgpu::Features::SUBGROUP,
            limits: wgpu::Limits {
                max_compute_workgroup_size_x: 1024,
                max_storage_buffers_per_shader_stage: 12,
                ..wgpu::Limits::downlevel_defaults()
            },
            ..Options::default()
        };
        let adapter = wgpu::Limits::downlevel_defaults();
        let missing = missing(&options, wgpu::Features::SUBGROUP, &adapter);
        let error = Error::Unsupported {
            adapter: "Small GPU".to_owned(),
            missing,
        };
        assert_eq!(
            error.to_string(),
            "Small GPU lacks SHADER_F64; max_storage_buffers_per_shader_stage = 12 (it has 4); \
             max_compute_workgroup_size_x = 1024 (it has 256); ask for less, or choose another adapter"
        );
    }
}
