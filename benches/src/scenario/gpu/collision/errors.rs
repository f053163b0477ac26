//! The lists of pairs on which tests err, on the device: every first triangle of a list against every second, of which
//! those that are a pair of the list are held against integer arithmetic.

use super::super::Meter;
use super::{Measured, timed_on_device};
use crate::row::Row;
use crate::scenario::error_table::Subject;
use crate::scenario::{Measurement, Selection};
use vertebra::collision::gpu::{Collider, Query};
use vertebra::glam::Vec3;
use vertebra::{Culling, Method, TriangleMesh};
use vertebra_gpu::Device;

const ROWS: [(&str, Method); 2] = [
    ("collision-error-exact", Method::Exact),
    ("collision-error-moller", Method::MOLLER),
];

/// Whether any of the rows is asked for.
pub(in super::super) fn wanted(selection: &Selection) -> bool {
    ROWS.iter().any(|(name, _)| selection.wants(name))
}

/// The rows that are asked for.
pub(super) fn measurements<'a>(
    device: &'a Device,
    subjects: &'a [Subject],
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let mut list = Vec::new();
    for subject in subjects {
        for (name, method) in ROWS.into_iter().filter(|(name, _)| selection.wants(name)) {
            let label = format!("gpu {}: {name}", subject.scenario);
            list.push(Measurement::new(label, move |meter| {
                measure(device, meter, subject, (name, method))
            }));
        }
    }
    list
}

fn measure(
    device: &Device,
    meter: &Meter,
    subject: &Subject,
    (name, method): (&str, Method),
) -> anyhow::Result<Option<Row>> {
    let (pairs, meet) = subject.judged_pairs();
    let soup = |of: usize| {
        let corners: Vec<Vec3> = pairs.iter().flat_map(|pair| pair[of]).collect();
        let triangles = (0..u32::try_from(pairs.len())?).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        Ok::<_, anyhow::Error>(TriangleMesh::new(corners, triangles.collect())?)
    };
    let (a, b) = (
        Collider::new(device, soup(0)?)?,
        Collider::new(device, soup(1)?)?,
    );
    let query = Query::new(&a, &b)?
        .culling(Culling::AllPairs)
        .method(method)?;
    let found = query.pairs()?;
    let mut wrong = (0, 0);
    for (i, meet) in (0..).zip(meet) {
        let hit = found.binary_search(&[i, i]).is_ok();
        wrong.0 += u64::from(hit && !meet);
        wrong.1 += u64::from(!hit && *meet);
    }
    let statistics = query.statistics()?;
    let timing = timed_on_device(meter, &query)?;
    let all = pairs.len() as f64 * pairs.len() as f64;
    let rate = timing.as_ref().map_or(0.0, |timing| all / timing.median_s);
    let measured = Measured {
        timing,
        hits: found.len() as u64,
        wrong,
        note: format!(
            "all {all:.1e} pairs of both columns, {rate:.2e} a second; {} undecided ({:.2} % of hits), {} of them decided on \
             the host in {:.3} ms; errors of the {} pairs of the list",
            statistics.undecided,
            100.0 * statistics.undecided as f64 / (found.len().max(1)) as f64,
            statistics.on_host,
            1e3 * statistics.settle_time.unwrap_or(0.0),
            pairs.len()
        ),
    };
    let size = (pairs.len() as u64, "candidate pairs");
    Ok(measured.row(device, (&subject.scenario, name), size))
}
