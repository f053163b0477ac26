//! Where simulations run.

use crate::Error;
use core::fmt;

/// What a [`Simulation`](crate::Simulation) runs on: the processor, or a GPU.
///
/// Nothing falls back by itself: a GPU that is not there is an error, unless the caller says what then.
///
/// ```
/// use vertebra_assembly::generate;
/// use vertebra_dynamics::{Device, Simulation};
///
/// // A GPU if there is one; else the processor, which says why.
/// let device = Device::auto().unwrap_or_else(Device::cpu_instead);
/// if let Some(reason) = device.fallback() {
///     println!("on {device}: {reason}");
/// }
/// # let device = Device::cpu();
/// let model = generate::random_chain(64, &generate::Rod::default(), 7)?;
/// let mut simulation = Simulation::on(&device, model)?;
/// simulation.steps(1e-4, 10)?;
/// println!("{}", simulation.choice());
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Device {
    place: Place,
    where_faster: bool,
    fallback: Option<Error>,
}

#[derive(Clone, Debug)]
enum Place {
    Cpu,
    #[cfg(feature = "gpu")]
    Gpu(vertebra_gpu::Device),
}

impl Device {
    const fn at(place: Place) -> Self {
        Self {
            place,
            where_faster: false,
            fallback: None,
        }
    }

    /// The processor, with the threads of the current rayon pool (feature `rayon`).
    #[must_use]
    pub const fn cpu() -> Self {
        Self::at(Place::Cpu)
    }

    /// The processor because there is no other device; [`fallback`](Self::fallback) tells why. For
    /// `Device::auto().unwrap_or_else(Device::cpu_instead)`.
    #[must_use]
    pub fn cpu_instead(reason: Error) -> Self {
        Self {
            fallback: Some(reason),
            ..Self::cpu()
        }
    }

    /// The most capable GPU, or the one that the environment variable `VERTEBRA_ADAPTER` names.
    ///
    /// # Errors
    /// `Error::Gpu` where there is none, or it refuses; without the feature `gpu`,
    /// [`Error::GpuNotBuilt`].
    pub fn auto() -> Result<Self, Error> {
        #[cfg(feature = "gpu")]
        return Ok(Self::at(Place::Gpu(vertebra_gpu::Device::auto()?)));
        #[cfg(not(feature = "gpu"))]
        Err(Error::GpuNotBuilt)
    }

    /// The first GPU whose name contains `part`, in capitals or not; `software` is the processor through a
    /// driver that plays a GPU.
    ///
    /// # Errors
    /// As [`auto`](Self::auto); a missing one is told with those that are there.
    #[cfg_attr(
        not(feature = "gpu"),
        expect(unused_variables, reason = "there is no GPU to name")
    )]
    pub fn named(part: &str) -> Result<Self, Error> {
        #[cfg(feature = "gpu")]
        return Ok(Self::at(Place::Gpu(vertebra_gpu::Device::open(
            vertebra_gpu::Options {
                adapter: vertebra_gpu::AdapterChoice::parse(part),
                ..vertebra_gpu::Options::default()
            },
        )?)));
        #[cfg(not(feature = "gpu"))]
        Err(Error::GpuNotBuilt)
    }

    /// Lets each simulation run on the processor instead if that is expected to be faster for its model;
    /// [`Simulation::choice`](crate::Simulation::choice) says which it was and why.
    #[must_use]
    pub fn where_faster(mut self) -> Self {
        self.where_faster = true;
        self
    }

    /// Why this is the processor where another device was wanted; none if this is what was asked for.
    #[must_use]
    pub const fn fallback(&self) -> Option<&Error> {
        self.fallback.as_ref()
    }

    /// Whether it is a GPU.
    #[must_use]
    pub const fn is_gpu(&self) -> bool {
        !matches!(self.place, Place::Cpu)
    }

    /// Whether simulations may run on the processor all the same.
    #[cfg(feature = "gpu")]
    pub(crate) const fn is_where_faster(&self) -> bool {
        self.where_faster
    }

    /// The GPU, for programs of one's own beside simulations.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub const fn gpu(&self) -> Option<&vertebra_gpu::Device> {
        match &self.place {
            Place::Cpu => None,
            Place::Gpu(device) => Some(device),
        }
    }
}

#[cfg(feature = "gpu")]
impl From<vertebra_gpu::Device> for Device {
    fn from(device: vertebra_gpu::Device) -> Self {
        Self::at(Place::Gpu(device))
    }
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Place::Cpu => f.write_str("the CPU"),
            #[cfg(feature = "gpu")]
            Place::Gpu(device) => f.write_str(&device.description()),
        }
    }
}
