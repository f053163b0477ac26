//! Many poses, many bodies, and one mesh with itself.

use super::super::Meter;
use super::{Measured, note, timed};
use crate::measure::Timing;
use crate::row::Row;
use crate::scenario::tableware;
use crate::suite::gold_meshes::wrong_pairs;
use vertebra::collision::gpu::{Collider, Links, Query, SelfQuery};
use vertebra::glam::DVec3;
use vertebra::{Pose, Random};
use vertebra_gpu::Device;

/// Measures a row, on a processor that plays a GPU or on a real one.
type Run = fn(&Device, &Meter, bool) -> anyhow::Result<Option<Row>>;

pub(super) const ROWS: [(&str, Run); 4] = [
    ("collision-poses", poses),
    ("collision-links", links),
    ("collision-following", following),
    ("collision-self", itself),
];

/// Bodies of a chain.
const BODIES: usize = 8;

fn count(software: bool) -> usize {
    if software { 16 } else { 1024 }
}

/// Pairs of a cylinder and a sphere in many poses.
fn poses(device: &Device, meter: &Meter, software: bool) -> anyhow::Result<Option<Row>> {
    let (a, b) = (tableware::sphere()?, tableware::cylinder()?);
    let mut random = Random::new(1);
    let poses: Vec<Pose> = (0..count(software))
        .map(|_| Pose::new(random.rotation(), random.direction() * random.unit()))
        .collect();
    let cpu = vertebra::Query::new(&a, &b).threads(0);
    let expected = cpu.at_poses(&poses, |query| query.pairs())?;
    let (on_a, on_b) = (
        Collider::new(device, a.clone())?,
        Collider::new(device, b.clone())?,
    );
    let query = Query::new(&on_a, &on_b)?;
    let found = query.at_poses(&poses)?.pairs()?;
    let timing = timed(meter, || Ok(query.at_poses(&poses)?.pairs()?))?;
    let names = ("poses of a cylinder in a sphere", "collision-poses");
    let size = (poses.len() as u64, "poses");
    Ok(judged(timing, &found, &expected, "").row(device, names, size))
}

/// Lists that were found in this time, and how many of their pairs are too many, and too few.
fn judged(
    timing: Option<Timing>,
    found: &[Vec<[u32; 2]>],
    expected: &[Vec<[u32; 2]>],
    note: &str,
) -> Measured {
    let hits = found.iter().map(|pairs| pairs.len() as u64).sum();
    let mut wrong = (0, 0);
    for (found, expected) in found.iter().zip(expected) {
        let (too_many, too_few) = wrong_pairs(found, expected);
        wrong = (wrong.0 + too_many, wrong.1 + too_few);
    }
    Measured {
        timing,
        hits,
        wrong,
        note: note.to_owned(),
    }
}

/// A chain of balls in many shapes, its poses of `f32` numbers.
fn configurations(software: bool) -> Vec<Vec<Pose>> {
    let mut random = Random::new(2);
    let mut chain = |_| {
        let mut place = DVec3::ZERO;
        let mut next = |_| {
            place = (place + random.direction() * 1.5).as_vec3().as_dvec3();
            Pose::new(random.rotation().as_quat().as_dquat(), place)
        };
        (0..BODIES).map(&mut next).collect()
    };
    (0..count(software)).map(&mut chain).collect()
}

/// Pairs of a chain's links, which all are one mesh.
fn links(device: &Device, meter: &Meter, software: bool) -> anyhow::Result<Option<Row>> {
    let configurations = configurations(software);
    let (links, expected) = chain(device, &configurations)?;
    let found = links.at(&configurations)?.pairs()?.concat();
    let timing = timed(meter, || Ok(links.at(&configurations)?.pairs()?))?;
    let names = ("links of a chain", "collision-links");
    let size = (found.len() as u64, "pairs of links");
    Ok(judged(timing, &found, &expected, "").row(device, names, size))
}

/// The same with poses from a buffer on the device, and how many pairs of triangles there are.
fn following(device: &Device, meter: &Meter, software: bool) -> anyhow::Result<Option<Row>> {
    let configurations = configurations(software);
    let (links, expected) = chain(device, &configurations)?;
    let words = configurations.iter().flatten().flat_map(|pose| {
        let [x, y, z, w] = pose.rotation.as_quat().to_array();
        let [a, b, c] = pose.translation.as_vec3().to_array();
        [x, y, z, w, a, b, c, 0.0]
    });
    let poses = device.buffer_from("poses", &words.collect::<Vec<f32>>())?;
    let following = links.following(&poses)?;
    let found = following.now().pairs()?.concat();
    let timing = timed(meter, || Ok(following.now().any()?))?;
    let names = ("links of a chain", "collision-following");
    let size = (found.len() as u64, "pairs of links");
    let note = "whether they meet; errors of the pairs";
    Ok(judged(timing, &found, &expected, note).row(device, names, size))
}

/// The chain, and the pairs of each pair of links that the CPU finds.
fn chain(
    device: &Device,
    configurations: &[Vec<Pose>],
) -> anyhow::Result<(Links, Vec<Vec<[u32; 2]>>)> {
    let ball = tableware::uv_sphere(24, 12)?;
    let collider = vertebra::Collider::new(ball.clone());
    let bodies = [&collider; BODIES];
    let mut cpu = vertebra::Links::new(&bodies).threads(0);
    let mut gpu = Links::new(device, &[&ball; BODIES])?;
    for neighbour in 1..BODIES {
        cpu = cpu.ignore(neighbour - 1, neighbour)?;
        gpu = gpu.ignore(neighbour - 1, neighbour)?;
    }
    let expected = cpu.ask(configurations, |query| query.pairs())?;
    Ok((gpu, expected.concat()))
}

/// The pairs in which a mesh meets itself.
fn itself(device: &Device, meter: &Meter, software: bool) -> anyhow::Result<Option<Row>> {
    let (name, mesh) = if software {
        ("cylinder with itself", tableware::cylinder()?)
    } else {
        ("cup with itself", tableware::cup()?)
    };
    let expected = vertebra::SelfQuery::new(&mesh).threads(0).pairs();
    let triangles = mesh.len() as u64;
    let collider = Collider::new(device, mesh)?;
    let query = SelfQuery::new(&collider);
    let found = query.pairs()?;
    let measured = Measured {
        hits: found.len() as u64,
        wrong: wrong_pairs(&found, &expected),
        note: note(&query.statistics()?),
        timing: timed(meter, || Ok(query.pairs()?))?,
    };
    Ok(measured.row(device, (name, "collision-self"), (triangles, "triangles")))
}
