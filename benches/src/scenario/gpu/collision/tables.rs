//! The source's pairs of meshes.

use super::super::Meter;
use super::{Measured, note, timed, timed_on_device};
use crate::row::Row;
use crate::scenario::meshes::wrong_triangles;
use crate::scenario::{Measurement, Selection, meshes};
use crate::suite::gold_meshes::wrong_pairs;
use vertebra::collision::gpu::{Collider, MeshPair, Query};
use vertebra::glam::{DQuat, DVec3};
use vertebra::{Culling, Method, Pose};
use vertebra_gpu::Device;

/// Two meshes on a device, and a question about them.
struct Asked<'a> {
    device: &'a Device,
    meter: &'a Meter,
    subject: &'a meshes::Subject,
    a: Collider,
    b: Collider,
    query: Query,
}

/// How a row is asked.
type Run = fn(&mut Asked<'_>) -> anyhow::Result<Measured>;

const ROWS: [(&str, Culling, Run); 13] = [
    ("collision-pairs", Culling::Auto, pairs),
    ("collision-pairs-all", Culling::AllPairs, pairs),
    ("collision-pairs-tree", Culling::Bvh, pairs),
    ("collision-pairs-moving", Culling::Auto, moving),
    ("collision-pairs-upload", Culling::Auto, upload),
    ("collision-pairs-chosen", Culling::Auto, chosen),
    ("collision-count", Culling::Auto, count),
    ("collision-any", Culling::Auto, any),
    ("collision-mask", Culling::Auto, mask),
    ("collision-device", Culling::Auto, on_device),
    ("collision-device-all", Culling::AllPairs, on_device),
    ("collision-device-tree", Culling::Bvh, on_device),
    ("collision-moller", Culling::AllPairs, moller),
];

/// The rows that are asked for.
pub(super) fn measurements<'a>(
    device: &'a Device,
    subjects: &'a [meshes::Subject],
    selection: &Selection,
) -> Vec<Measurement<'a>> {
    let mut list = Vec::new();
    for subject in subjects {
        for (name, culling, run) in ROWS {
            if selection.wants(name) {
                let label = format!("gpu {}: {name}", subject.scenario);
                list.push(Measurement::new(label, move |meter| {
                    measure(device, meter, subject, (name, culling, run))
                }));
            }
        }
    }
    list
}

fn measure(
    device: &Device,
    meter: &Meter,
    subject: &meshes::Subject,
    (name, culling, run): (&str, Culling, Run),
) -> anyhow::Result<Option<Row>> {
    let a = Collider::new(device, subject.a.clone())?;
    let b = Collider::new(device, subject.b.clone())?;
    let query = Query::new(&a, &b)?.culling(culling);
    let mut asked = Asked {
        device,
        meter,
        subject,
        a,
        b,
        query,
    };
    let measured = run(&mut asked)?;
    let names = (subject.scenario.as_str(), name);
    let row = measured.row(device, names, (subject.size(), "triangle pairs"));
    // The source's time is with its transfers.
    let published = subject
        .published
        .filter(|_| name == "collision-pairs-upload");
    Ok(row.map(|row| Row {
        reference_time_s: published.map(|published| published.gpu_s),
        ..row
    }))
}

/// Meshes on the device, where they stand; the sorted list on the host.
fn pairs(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let query = &asked.query;
    let found = query.pairs()?;
    Ok(Measured {
        hits: found.len() as u64,
        wrong: wrong_pairs(&found, asked.subject.reference()?),
        note: note(&query.statistics()?),
        timing: timed(asked.meter, || Ok(query.pairs()?))?,
    })
}

/// Meshes on the device, of which B moves from call to call; the sorted list on the host.
fn moving(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let pose = |step: u32| {
        let angle = 1e-3 * f64::from(step % 64);
        let rotation = DQuat::from_rotation_y(angle);
        Pose::new(rotation, DVec3::new(angle, -angle, 0.5 * angle))
    };
    let (mut wrong, mut undecided, mut hits) = ((0, 0), 0, 0);
    let mut query = Query::new(&asked.a, &asked.b)?;
    for step in [1, 17, 40] {
        query = query.pose_b(pose(step))?;
        let exact = vertebra::Query::new(&asked.subject.a, &asked.subject.b).pose_b(pose(step))?;
        let found = query.pairs()?;
        let (too_many, too_few) = wrong_pairs(&found, &exact.threads(0).pairs()?);
        wrong = (wrong.0 + too_many, wrong.1 + too_few);
        hits = found.len() as u64;
        undecided = query.statistics()?.undecided;
    }
    let (mut step, mut query) = (0, Some(query));
    let timing = timed(asked.meter, || {
        step += 1;
        let moved = query.take().map(|query| query.pose_b(pose(step)));
        query = moved.transpose()?;
        Ok(query.as_ref().map(Query::pairs).transpose()?)
    })?;
    Ok(Measured {
        timing,
        hits,
        wrong,
        note: format!("errors over three poses; {undecided} pairs undecided"),
    })
}

/// Vertices of both meshes uploaded, boxes fitted; the sorted list on the host.
fn upload(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let (subject, query) = (asked.subject, &asked.query);
    let wrong = wrong_pairs(&query.pairs()?, subject.reference()?);
    let test = query.statistics()?.gpu_time;
    let resident = timed(asked.meter, || Ok(query.pairs()?))?;
    let mut hits = 0;
    let timing = timed(asked.meter, || {
        asked.a.set_vertices(subject.a.vertices().to_vec())?;
        asked.b.set_vertices(subject.b.vertices().to_vec())?;
        hits = query.pairs()?.len() as u64;
        Ok(())
    })?;
    let microseconds =
        |time: Option<f64>| time.map_or_else(|| "?".to_owned(), |t| format!("{:.1}", 1e6 * t));
    Ok(Measured {
        timing,
        hits,
        wrong,
        note: format!(
            "vertices uploaded in each call; without that {} us, of which the test takes {} us on the device",
            microseconds(resident.map(|timing| timing.median_s)),
            microseconds(test)
        ),
    })
}

/// Wherever the cost model has it done.
fn chosen(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let (a, b) = (asked.subject.a.clone(), asked.subject.b.clone());
    let pair = MeshPair::new(Some(asked.device), a, b, None)?;
    let found = pair.pairs()?;
    Ok(Measured {
        hits: found.len() as u64,
        wrong: wrong_pairs(&found, asked.subject.reference()?),
        note: pair.choice().to_string(),
        timing: timed(asked.meter, || Ok(pair.pairs()?))?,
    })
}

fn count(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let query = &asked.query;
    let (found, exact) = (query.count()?, asked.subject.reference()?.len() as u64);
    Ok(Measured {
        hits: found,
        wrong: (found.saturating_sub(exact), exact.saturating_sub(found)),
        note: String::new(),
        timing: timed(asked.meter, || Ok(query.count()?))?,
    })
}

fn any(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let query = &asked.query;
    let (found, exact) = (query.any()?, !asked.subject.reference()?.is_empty());
    Ok(Measured {
        hits: u64::from(found),
        wrong: (u64::from(found && !exact), u64::from(exact && !found)),
        note: String::new(),
        timing: timed(asked.meter, || Ok(query.any()?))?,
    })
}

fn mask(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let query = &asked.query;
    let (a, b) = query.mask()?;
    Ok(Measured {
        hits: a.iter().chain(&b).filter(|hit| **hit).count() as u64,
        wrong: wrong_triangles(&a, &b, asked.subject.reference()?),
        note: "hits and errors count triangles".to_owned(),
        timing: timed(asked.meter, || Ok(query.mask()?))?,
    })
}

/// The test alone.
fn on_device(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let query = &asked.query;
    let found = query.pairs()?;
    let statistics = query.statistics()?;
    let timing = timed_on_device(asked.meter, query)?;
    let rate = |timing: &crate::measure::Timing| asked.subject.size() as f64 / timing.median_s;
    Ok(Measured {
        hits: found.len() as u64,
        wrong: wrong_pairs(&found, asked.subject.reference()?),
        note: format!(
            "{}; {:.2e} pairs/s",
            note(&statistics),
            timing.as_ref().map_or(0.0, rate)
        ),
        timing,
    })
}

/// The source's test, every triangle against every other, on the device alone.
fn moller(asked: &mut Asked<'_>) -> anyhow::Result<Measured> {
    let query = Query::new(&asked.a, &asked.b)?.method(Method::MOLLER)?;
    let found = query.pairs()?;
    let on_cpu = asked.subject.query()?.method(Method::MOLLER);
    let (only_here, only_there) = wrong_pairs(&found, &on_cpu.threads(0).pairs()?);
    Ok(Measured {
        hits: found.len() as u64,
        wrong: wrong_pairs(&found, asked.subject.reference()?),
        note: format!("{only_here} pairs that the CPU's has not, and {only_there} fewer"),
        timing: timed_on_device(asked.meter, &query)?,
    })
}
