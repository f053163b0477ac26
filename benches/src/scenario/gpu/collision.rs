//! Triangle collision on the device: the source's pairs of meshes, spheres that cross in a ring, many poses and bodies,
//! pairs that are left to the host, and lists on which tests err.

mod contacts;
mod errors;
mod spheres;
mod tables;
mod together;

pub(super) use errors::wanted as wants_errors;
pub(super) use spheres::{Subject as Spheres, subjects as spheres};

use super::{Meter, sample};
use crate::measure::Timing;
use crate::row::Row;
use crate::scenario::{Measurement, Selection, error_table, meshes};
use anyhow::Context;
use std::time::Instant;
use vertebra::collision::gpu::{Query, Statistics};
use vertebra_gpu::Device;
use vertebra_gpu::wgpu::DeviceType;

/// What the rows are about.
pub(super) struct Subjects<'a> {
    pub(super) meshes: &'a [meshes::Subject],
    pub(super) spheres: &'a [Spheres],
    pub(super) errors: &'a [error_table::Subject],
}

/// The rows that are asked for.
pub(super) fn measurements<'a>(
    device: &'a Device,
    subjects: &Subjects<'a>,
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let software = device.info().device_type == DeviceType::Cpu;
    let mut list = tables::measurements(device, subjects.meshes, selection);
    list.extend(spheres::measurements(device, subjects.spheres, selection));
    list.extend(contacts::measurements(device, software, selection));
    list.extend(errors::measurements(device, subjects.errors, selection));
    for (name, run) in together::ROWS {
        if selection.wants(name) {
            list.push(Measurement::new(format!("gpu {name}"), move |meter| {
                run(device, meter, software)
            }));
        }
    }
    list
}

/// What a row measured.
struct Measured {
    timing: Option<Timing>,
    hits: u64,
    /// Pairs too many and too few.
    wrong: (u64, u64),
    note: String,
}

impl Measured {
    /// The row, unless it was interrupted.
    fn row(
        self,
        device: &Device,
        (scenario, method): (&str, &str),
        (size, unit): (u64, &str),
    ) -> Option<Row> {
        self.timing.map(|timing| Row {
            backend: "gpu".to_owned(),
            device: device.description(),
            hits: Some(self.hits),
            false_pairs: Some(self.wrong.0),
            missed_pairs: Some(self.wrong.1),
            note: self.note,
            ..Row::new(scenario, method, "f32", size, unit, &timing)
        })
    }
}

/// Times by the clock on the wall.
fn timed<T>(
    meter: &Meter,
    mut call: impl FnMut() -> anyhow::Result<T>,
) -> anyhow::Result<Option<Timing>> {
    sample(meter, || {
        let start = Instant::now();
        call()?;
        Ok(start.elapsed().as_secs_f64())
    })
}

/// Times of the search alone, from the first dispatch to the end of the last; by the clock on the wall where the device
/// has none.
fn timed_on_device(meter: &Meter, query: &Query) -> anyhow::Result<Option<Timing>> {
    if query.statistics()?.gpu_time.is_none() {
        return timed(meter, || Ok(query.pairs()?));
    }
    sample(meter, || {
        let time = query.statistics()?.gpu_time;
        time.context("the device takes times")
    })
}

/// What a query took, for a note.
fn note(statistics: &Statistics) -> String {
    let time = statistics.gpu_time.map_or_else(String::new, |time| {
        format!("; {:.1} us on the device", 1e6 * time)
    });
    format!(
        "{} pairs of blocks, begun {} levels up, {} pairs of triangles undecided{time}",
        statistics.block_pairs, statistics.levels, statistics.undecided
    )
}
