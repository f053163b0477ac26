//! Many poses of two meshes, and many bodies that move.

use super::{Subject, Verdict};
use crate::row::Row;
use crate::scenario::{Meter, reference, tableware};
use crate::suite::gold_meshes::wrong_pairs;
use vertebra::collision::RelativePose;
use vertebra::glam::DVec3;
use vertebra::{Collider, Links, Pose, Query, Random};

/// Poses of the cylinder.
const POSES: usize = 64;

/// Bodies of the chain.
const BODIES: usize = 8;

/// Shapes of the chain.
const CONFIGURATIONS: usize = 16;

/// Errors: pairs too many and too few, over all poses.
pub(super) fn poses(
    subject: &Subject,
    meter: &Meter,
    threads: usize,
) -> anyhow::Result<Option<Row>> {
    let mut random = Random::new(subject.seed);
    let poses: Vec<Pose> = (0..POSES)
        .map(|_| Pose::new(random.rotation(), random.direction() * random.unit()))
        .collect();
    let [a, b] = [&subject.sphere, &subject.cylinder].map(|mesh| Collider::new(mesh.clone()));
    let query = Query::new(&a, &b).threads(threads);
    let answer = || query.at_poses(&poses, |query| query.pairs());
    let mut verdict = Verdict::default();
    for (pose, found) in poses.iter().zip(answer()?) {
        let pose = RelativePose::between(&Pose::IDENTITY, pose)?;
        let exact = reference::pairs(a.mesh(), b.mesh(), &pose);
        verdict.add(found.len(), wrong_pairs(&found, &exact));
    }
    let timing = meter.time(answer)?;
    Ok(verdict.row(
        ("queries: poses of a cylinder in a sphere", "poses", threads),
        (POSES as u64, "poses"),
        timing,
        format!(
            "pairs of {} x {} triangles in each pose, prepared meshes",
            a.mesh().len(),
            b.mesh().len()
        ),
    ))
}

/// Errors: pairs of triangles too many and too few, over all configurations and pairs of bodies.
pub(super) fn links(
    subject: &Subject,
    meter: &Meter,
    threads: usize,
) -> anyhow::Result<Option<Row>> {
    let body = Collider::new(tableware::uv_sphere(24, 12)?);
    let bodies = vec![body; BODIES];
    let mut links = Links::new(&bodies).threads(threads);
    for neighbour in 1..BODIES {
        links = links.ignore(neighbour - 1, neighbour)?;
    }
    let mut random = Random::new(subject.seed);
    let configurations: Vec<Vec<Pose>> = (0..CONFIGURATIONS)
        .map(|_| {
            let mut place = DVec3::ZERO;
            let mut next = || {
                place += random.direction() * 1.5;
                Pose::new(random.rotation(), place)
            };
            (0..BODIES).map(|_| next()).collect()
        })
        .collect();
    let answer = || links.ask(&configurations, |query| query.pairs());
    let mut verdict = Verdict::default();
    for (poses, answers) in configurations.iter().zip(answer()?) {
        for ([one, other], found) in links.pairs().into_iter().zip(answers) {
            let pose = RelativePose::between(&poses[one], &poses[other])?;
            let exact = reference::pairs(bodies[one].mesh(), bodies[other].mesh(), &pose);
            verdict.add(found.len(), wrong_pairs(&found, &exact));
        }
    }
    let timing = meter.time(answer)?;
    let pairs = links.pairs().len() * CONFIGURATIONS;
    Ok(verdict.row(
        ("queries: links of a chain", "links", threads),
        (pairs as u64, "pairs of links"),
        timing,
        format!(
            "{CONFIGURATIONS} configurations of {BODIES} spheres of {} triangles; hits and errors count pairs of triangles",
            bodies[0].mesh().len()
        ),
    ))
}
