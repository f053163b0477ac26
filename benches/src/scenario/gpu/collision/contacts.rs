//! Pairs that only touch, all of which the device leaves to the host: what deciding them costs, for few and for many.

use super::super::{Meter, sample};
use super::{Measured, note};
use crate::row::Row;
use crate::scenario::{Measurement, Selection};
use crate::suite::gold_meshes::wrong_pairs;
use anyhow::Context;
use vertebra::collision::gpu::{Collider, Query};
use vertebra::glam::Vec3;
use vertebra::{Random, TriangleMesh};
use vertebra_gpu::Device;

/// Name of the row.
const NAME: &str = "collision-undecided";

/// Numbers of pairs.
const SIZES: [usize; 4] = [10, 1000, 30_000, 1_000_000];

/// Pairs that a processor is asked about at most.
const SOFTWARE_LIMIT: usize = 1000;

/// The rows that are asked for.
pub(super) fn measurements<'a>(
    device: &'a Device,
    software: bool,
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let sizes = SIZES
        .into_iter()
        .filter(|size| selection.wants(NAME) && !(software && *size > SOFTWARE_LIMIT));
    let row = |size| {
        let label = format!("gpu contacts of {size} pairs: {NAME}");
        Measurement::new(label, move |meter: &Meter| measure(device, meter, size))
    };
    sizes.map(row).collect()
}

/// Two meshes of triangles far from each other, but for pairs with a corner of one in the other.
fn touching(count: usize) -> anyhow::Result<[TriangleMesh; 2]> {
    let mut random = Random::new(1);
    let mut corners = [Vec::new(), Vec::new()];
    for i in 0..count {
        let cell = Vec3::new(
            (i % 128) as f32,
            (i / 128 % 128) as f32,
            (i / 16_384) as f32,
        );
        // Multiples of 2^-10, so that the sum of two corners is halved without rounding.
        let mut corner = || {
            let step = || (random.unit() * 256.0).floor() as f32 / 1024.0;
            cell + Vec3::from([(); 3].map({
                let mut step = step;
                move |()| step()
            }))
        };
        let [p, q, r, s, t] = [(); 5].map(|()| corner());
        corners[0].extend([p, q, r]);
        corners[1].extend([0.5 * (p + q), s, t]);
    }
    let triangles = (0..u32::try_from(count)?).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    let triangles: Vec<[u32; 3]> = triangles.collect();
    let [a, b] = corners;
    Ok([
        TriangleMesh::new(a, triangles.clone())?,
        TriangleMesh::new(b, triangles)?,
    ])
}

/// Time in which the host decides them.
fn measure(device: &Device, meter: &Meter, size: usize) -> anyhow::Result<Option<Row>> {
    let [a, b] = touching(size)?;
    let exact = vertebra::Query::new(&a, &b).threads(0).pairs()?;
    let (on_a, on_b) = (Collider::new(device, a)?, Collider::new(device, b)?);
    let query = Query::new(&on_a, &on_b)?;
    let found = query.pairs()?;
    let statistics = query.statistics()?;
    let measured = Measured {
        timing: sample(meter, || {
            let time = query.statistics()?.settle_time;
            time.context("a host has a clock")
        })?,
        hits: found.len() as u64,
        wrong: wrong_pairs(&found, &exact),
        note: format!(
            "{}; the time is that of the undecided pairs on the host",
            note(&statistics)
        ),
    };
    let size = (statistics.undecided, "undecided pairs");
    Ok(measured.row(device, ("contacts", NAME), size))
}
