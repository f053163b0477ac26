//! A mesh that changes its shape: its hierarchy refitted, or built again.

use super::{Subject, Verdict};
use crate::measure::Timing;
use crate::row::Row;
use crate::scenario::{Meter, reference};
use crate::suite::gold_meshes::wrong_pairs;
use vertebra::collision::RelativePose;
use vertebra::glam::Vec3;
use vertebra::{Collider, Query};

/// How far the spoon is bent \[1/m].
const CURVATURE: f32 = 0.5;

/// The spoon's vertices, bent as a beam is: by the square of where they are along it.
fn bent(spoon: &[Vec3]) -> Vec<Vec3> {
    let bend = |v: &Vec3| Vec3::new(v.x, v.y, v.z + CURVATURE * v.x * v.x);
    spoon.iter().map(bend).collect()
}

/// Vertices moved back and forth. Errors: the pairs that a query finds afterwards.
pub(super) fn refit(subject: &Subject, meter: &Meter) -> anyhow::Result<Option<Row>> {
    let spoon = &subject.pair.b;
    let mut collider = Collider::new(spoon.clone());
    let shapes = [spoon.vertices().to_vec(), bent(spoon.vertices())];
    let mut turns = shapes.iter().cycle();
    let timing = meter.time(|| match turns.next() {
        Some(shape) => collider.set_vertices(shape.clone()),
        None => Ok(()),
    })?;
    collider.set_vertices(bent(spoon.vertices()))?;
    let note = format!(
        "with a copy of {} vertices; a query costs {:.2} of what it did",
        spoon.vertices().len(),
        collider.degradation()
    );
    row(subject, "refit", &collider, timing, note)
}

/// Errors: the pairs that a query finds afterwards.
pub(super) fn rebuild(subject: &Subject, meter: &Meter) -> anyhow::Result<Option<Row>> {
    let mut collider = Collider::new(subject.pair.b.clone());
    collider.set_vertices(bent(subject.pair.b.vertices()))?;
    let timing = meter.time(|| {
        collider.rebuild();
        Ok::<(), anyhow::Error>(())
    })?;
    row(subject, "rebuild", &collider, timing, String::new())
}

fn row(
    subject: &Subject,
    method: &str,
    spoon: &Collider,
    timing: Option<Timing>,
    note: String,
) -> anyhow::Result<Option<Row>> {
    let cup = &subject.pair.a;
    let found = Query::new(cup, spoon).pairs()?;
    let exact = reference::pairs(cup, spoon.mesh(), &RelativePose::IDENTITY);
    let mut verdict = Verdict::default();
    verdict.add(found.len(), wrong_pairs(&found, &exact));
    Ok(verdict.row(
        ("queries: a spoon that bends", method, 1),
        (spoon.mesh().len() as u64, "triangles"),
        timing,
        note,
    ))
}
