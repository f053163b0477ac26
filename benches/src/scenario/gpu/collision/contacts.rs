//! Pairs that only touch, of which single precision can tell none: what deciding them exactly costs, for few and for many.
//! Where they stand the device may do it in integers; posed by a quarter turn, which changes nothing, the host must.

use super::super::Meter;
use super::{Measured, note, timed};
use crate::row::Row;
use crate::scenario::{Measurement, Selection};
use crate::suite::gold_meshes::wrong_pairs;
use vertebra::collision::gpu::{Collider, Query};
use vertebra::glam::{DQuat, Vec3};
use vertebra::{Pose, Random, TriangleMesh};
use vertebra_gpu::Device;

/// The rows, and whether B is posed.
const ROWS: [(&str, bool); 2] = [
    ("collision-contacts", false),
    ("collision-contacts-posed", true),
];

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
    let mut list = Vec::new();
    for size in SIZES {
        for (name, posed) in ROWS {
            if selection.wants(name) && !(software && size > SOFTWARE_LIMIT) {
                let label = format!("gpu contacts of {size} pairs: {name}");
                list.push(Measurement::new(label, move |meter| {
                    measure(device, meter, size, (name, posed))
                }));
            }
        }
    }
    list
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
        #[expect(clippy::cast_possible_truncation, reason = "a small integer")]
        let mut step = || (random.unit() * 256.0).floor() as f32 / 1024.0;
        let mut corner = || cell + Vec3::new(step(), step(), step());
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

/// The sorted list on the host, of meshes on the device.
fn measure(
    device: &Device,
    meter: &Meter,
    size: usize,
    (name, posed): (&str, bool),
) -> anyhow::Result<Option<Row>> {
    let [a, mut b] = touching(size)?;
    let exact = vertebra::Query::new(&a, &b).threads(0).pairs()?;
    let mut pose = Pose::IDENTITY;
    if posed {
        pose.rotation = DQuat::from_xyzw(0.0, 0.0, 1.0, 1.0).normalize();
        let back = b.vertices().iter().map(|v| Vec3::new(v.y, -v.x, v.z));
        b.set_vertices(back.collect())?;
    }
    let (on_a, on_b) = (Collider::new(device, a)?, Collider::new(device, b)?);
    let query = Query::new(&on_a, &on_b)?.pose_b(pose)?;
    let found = query.pairs()?;
    let statistics = query.statistics()?;
    let measured = Measured {
        timing: timed(meter, || Ok(query.pairs()?))?,
        hits: found.len() as u64,
        wrong: wrong_pairs(&found, &exact),
        note: format!(
            "{}, {} of them decided on the host in {:.1} us",
            note(&statistics),
            statistics.on_host,
            1e6 * statistics.settle_time.unwrap_or(0.0)
        ),
    };
    let size = (size as u64, "touching pairs");
    Ok(measured.row(device, ("contacts", name), size))
}
