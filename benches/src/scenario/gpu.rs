//! The scenario `gpu`: what dispatches cost, how fast the primitives are, and triangle collision, by timestamps on the
//! device; every result is compared with the CPU's.

mod bare;
pub(crate) mod chains;
mod collision;
pub(crate) mod loops;
mod rows;

use super::{Measurement, Meter, Selection, error_table, meshes};
use crate::measure::Timing;
use crate::row::Row;
use crate::suite::gpu;
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::DeviceType;
use vertebra_shaders::{Rows, Sort};

/// Name of the scenario in the rows.
pub const NAME: &str = "gpu";

/// Number of elements of the primitives.
const LENGTH: usize = 10_000_000;
/// The same where the device is a processor, or the run is quick.
const SHORT_LENGTH: usize = 1_000_000;

/// A device that is measured.
pub struct Subject {
    device: Device,
    meshes: Vec<meshes::Subject>,
    spheres: Vec<collision::Spheres>,
    /// Lists on which tests err, once they are asked for.
    errors: OnceLock<Vec<error_table::Subject>>,
}

impl Subject {
    /// The device, if it is to be measured: any when the scenario is named, else only a real GPU.
    ///
    /// # Errors
    /// If the scenario is named and there is no device.
    pub fn find(named: bool) -> anyhow::Result<Option<Self>> {
        let device = match gpu::device() {
            Ok(device) => device,
            Err(error) if named => return Err(error.into()),
            Err(_) => return Ok(None),
        };
        let real = device.info().device_type != DeviceType::Cpu;
        let meshes = meshes::subjects()?;
        Ok((named || real).then_some(Self {
            device,
            meshes,
            spheres: collision::spheres(),
            errors: OnceLock::new(),
        }))
    }

    /// The lists on which tests err, if a row about them is asked for.
    fn errors(&self, selection: &Selection) -> &[error_table::Subject] {
        if !collision::wants_errors(selection) {
            return &[];
        }
        // The meshes of the lists are valid.
        let lists = || error_table::subjects(selection).unwrap_or_default();
        self.errors.get_or_init(lists)
    }

    /// The device.
    #[must_use]
    pub const fn device(&self) -> &Device {
        &self.device
    }

    /// The rows that are asked for.
    #[must_use]
    pub fn measurements(&self, selection: &Selection) -> Vec<Measurement<'_>> {
        let software = self.device.info().device_type == DeviceType::Cpu;
        let lengths = if selection.sizes.is_empty() {
            let short = software || selection.quick;
            vec![if short { SHORT_LENGTH } else { LENGTH }]
        } else {
            selection.sizes.clone()
        };
        let mut list = Vec::new();
        for method in ["dispatch-20", "dispatch-20-bare"] {
            for wall in [false, true] {
                if selection.wants(method) {
                    list.push(Measurement::new(
                        format!("gpu {method}{}", if wall { " with waiting" } else { "" }),
                        move |meter| rows::dispatches(&self.device, meter, method, wall),
                    ));
                }
            }
        }
        // Only when asked for: what the choice of `Sort::on` rests on.
        let shapes = !selection.methods.is_empty() && selection.wants("shapes");
        for length in lengths {
            for items in Sort::ITEMS.into_iter().filter(|_| shapes) {
                let sort = Sort::new(Rows::on(&self.device), items);
                if sort.fits(&self.device) {
                    let method = format!("sort-pairs-items-{items}");
                    list.push(Measurement::new(format!("gpu {method}"), move |meter| {
                        rows::sort(&self.device, meter, length, &method, &sort)
                    }));
                }
            }
            for (method, measure) in rows::PRIMITIVES {
                if selection.wants(method) {
                    let label = format!("gpu {method} {length}");
                    let run = move |meter: &Meter| measure(&self.device, meter, length);
                    list.push(Measurement::new(label, run));
                }
            }
        }
        let subjects = collision::Subjects {
            meshes: &self.meshes,
            spheres: &self.spheres,
            errors: self.errors(selection),
        };
        list.extend(collision::measurements(&self.device, &subjects, selection));
        list
    }
}

/// How long a device is kept busy before it is measured: while the host prepares data, an idle GPU
/// lowers its clock, and needs a fifth of a second of work to raise it again (H100).
const WARM_UP: Duration = Duration::from_secs(1);

/// Samples a time that `run` returns \[s\], after warming up; none when interrupted.
pub(super) fn sample(
    meter: &Meter,
    mut run: impl FnMut() -> anyhow::Result<f64>,
) -> anyhow::Result<Option<Timing>> {
    let start = Instant::now();
    while start.elapsed() < WARM_UP && !meter.interrupt.requested() {
        run()?;
    }
    let (start, budget) = (Instant::now(), &meter.budget);
    let mut samples = Vec::new();
    while samples.len() < budget.min_samples
        || (samples.len() < budget.max_samples && start.elapsed() < budget.max_time)
    {
        if meter.interrupt.requested() {
            return Ok(None);
        }
        samples.push(run()?);
    }
    Ok(Timing::from_samples(samples))
}

/// A row of this device.
fn row(device: &Device, method: &str, size: usize, unit: &str, timing: &Timing) -> Row {
    Row {
        backend: "gpu".to_owned(),
        device: device.description(),
        ..Row::new(NAME, method, "-", size as u64, unit, timing)
    }
}
