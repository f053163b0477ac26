//! On the processor, or on a device.

use std::fmt;

use vertebra_gpu::Device;
use vertebra_gpu::wgpu::DeviceType;

use super::cost;
use super::error::Error;

/// What computes an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Processor {
    /// The threads of the host.
    Cpu,
    /// A device.
    Gpu,
}

impl fmt::Display for Processor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cpu => "CPU",
            Self::Gpu => "GPU",
        })
    }
}

/// Why a processor was chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// It was asked for.
    Asked,
    /// There is no device.
    NoDevice,
    /// The device is a processor that plays one.
    SoftwareDevice,
    /// It is expected to be faster.
    Faster,
}

/// What a [`MeshPair`](super::MeshPair) has picked, and why: printed, a sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// What computes.
    pub processor: Processor,
    /// Why.
    pub reason: Reason,
    /// Threads of the host that take part, if it computes.
    pub threads: usize,
    /// Expected time of a question on the host \[s].
    pub cpu_s: f64,
    /// Expected time of a question on a device \[s].
    pub gpu_s: f64,
}

impl Choice {
    /// For meshes of so many triangles, on so many threads.
    pub(super) fn new(
        device: Option<&Device>,
        triangles: [usize; 2],
        threads: usize,
        asked: Option<Processor>,
    ) -> Result<Self, Error> {
        let (threads, cpu_s) = cost::on_cpu(triangles, threads);
        let gpu_s = cost::on_gpu(triangles);
        let software = |device: &Device| device.info().device_type == DeviceType::Cpu;
        let (processor, reason) = match (asked, device) {
            (Some(Processor::Gpu), None) => return Err(Error::NoDevice),
            (Some(processor), _) => (processor, Reason::Asked),
            (None, None) => (Processor::Cpu, Reason::NoDevice),
            (None, Some(device)) if software(device) => (Processor::Cpu, Reason::SoftwareDevice),
            (None, Some(_)) if gpu_s < cpu_s => (Processor::Gpu, Reason::Faster),
            (None, Some(_)) => (Processor::Cpu, Reason::Faster),
        };
        Ok(Self {
            processor,
            reason,
            threads,
            cpu_s,
            gpu_s,
        })
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let why = match self.reason {
            Reason::Asked => "as asked",
            Reason::NoDevice => "for want of a device",
            Reason::SoftwareDevice => "since the device is a processor too",
            Reason::Faster => "expected to be faster",
        };
        let Self { threads, .. } = self;
        write!(
            f,
            "on the {}, {why}: CPU on {threads} thread{} {:.3} ms, GPU {:.3} ms",
            self.processor,
            if *threads == 1 { "" } else { "s" },
            1e3 * self.cpu_s,
            1e3 * self.gpu_s
        )
    }
}
