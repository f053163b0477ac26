//! One mesh with itself, and its inside.

use super::{Subject, Verdict, named};
use crate::row::Row;
use crate::scenario::clipping::Overlap;
use crate::scenario::{Meter, closeness, reference};
use crate::suite::gold_meshes::wrong_pairs;
use anyhow::Context;
use vertebra::collision::RelativePose;
use vertebra::glam::{DVec3, Vec3};
use vertebra::{Collider, Location, Random, SelfQuery, Solid, TriangleMesh};

/// Points that are located.
const POINTS: usize = 300;

impl Subject {
    /// The pairs in which the mesh meets itself.
    fn own_pairs(&self) -> anyhow::Result<&[[u32; 2]]> {
        if self.own_pairs.get().is_none() {
            drop(self.own_pairs.set(pairs_with_itself(&self.own)?));
        }
        self.own_pairs
            .get()
            .map(Vec::as_slice)
            .context("it was made above")
    }
}

/// Pairs, the lesser index first, of triangles that meet beyond the corners they share.
fn pairs_with_itself(mesh: &TriangleMesh) -> anyhow::Result<Vec<[u32; 2]>> {
    let mut pairs = Vec::new();
    for pair in reference::pairs(mesh, mesh, &RelativePose::IDENTITY) {
        let [one, other] = pair.map(|t| mesh.triangle(t as usize));
        let common: Vec<Vec3> = one.into_iter().filter(|p| other.contains(p)).collect();
        if pair[0] < pair[1] {
            let beyond = common.is_empty()
                || Overlap::of(&[one, other])
                    .context("a triangle has no area")?
                    .exceeds(&common);
            if beyond {
                pairs.push(pair);
            }
        }
    }
    Ok(pairs)
}

/// Errors: pairs too many and too few.
pub(super) fn self_pairs(
    subject: &Subject,
    meter: &Meter,
    threads: usize,
    resident: bool,
) -> anyhow::Result<Option<Row>> {
    let collider = resident.then(|| Collider::new(subject.own.clone()));
    let query = match &collider {
        Some(collider) => SelfQuery::new(collider),
        None => SelfQuery::new(&subject.own),
    };
    let query = query.threads(threads);
    let found = query.pairs();
    let mut verdict = Verdict::default();
    verdict.add(found.len(), wrong_pairs(&found, subject.own_pairs()?));
    let timing = meter.time(|| Ok::<_, anyhow::Error>(query.pairs()))?;
    Ok(verdict.row(
        (
            &format!("queries: {} with itself", subject.own_name),
            &named("self-pairs", resident),
            threads,
        ),
        (subject.own.len() as u64, "triangles"),
        timing,
        "errors: against a sweep, neighbours by clipping in integers".to_owned(),
    ))
}

/// Errors: points said to be inside that are outside, and the other way round.
pub(super) fn inside(
    subject: &Subject,
    meter: &Meter,
    resident: bool,
) -> anyhow::Result<Option<Row>> {
    let mesh = &subject.pair.a;
    let vertices = mesh.vertices().iter().map(|v| v.as_dvec3());
    let (low, high) = vertices.fold((DVec3::MAX, DVec3::MIN), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let mut random = Random::new(subject.seed);
    let points: Vec<DVec3> = (0..POINTS)
        .map(|_| {
            let share = DVec3::new(random.unit(), random.unit(), random.unit());
            low + (high - low) * share
        })
        .collect();
    let prepared = Solid::new(mesh)?;
    let mut verdict = Verdict::default();
    for point in &points {
        let inside = prepared.locate(*point)? == Location::Inside;
        // Parts of the mesh overlap, and its inside is where an odd number of them is.
        let exact = closeness::winding(mesh, *point).abs().round() % 2.0 == 1.0;
        verdict.add(
            usize::from(inside),
            (u64::from(inside && !exact), u64::from(!inside && exact)),
        );
    }
    let locate = |solid: &Solid<'_>| {
        let locations = points.iter().map(|point| solid.locate(*point));
        locations.collect::<Result<Vec<_>, _>>()
    };
    let timing = if resident {
        meter.time(|| locate(&prepared))?
    } else {
        meter.time(|| locate(&Solid::new(mesh)?))?
    };
    Ok(verdict.row(
        ("queries: points in the cup", &named("inside", resident), 1),
        (POINTS as u64, "points"),
        timing,
        format!(
            "{} triangles; hits and errors count points, against winding numbers",
            mesh.len()
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fold_onto_a_neighbour_is_a_pair_and_a_neighbour_is_none() -> anyhow::Result<()> {
        let mut corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)];
        let triangles = vec![[0, 1, 2], [3, 2, 1]];
        let flat = TriangleMesh::new(corners.clone(), triangles.clone())?;
        assert!(pairs_with_itself(&flat)?.is_empty());
        corners[3] = Vec3::splat(0.25).with_z(0.0);
        let folded = TriangleMesh::new(corners, triangles)?;
        assert_eq!(pairs_with_itself(&folded)?, [[0, 1]]);
        Ok(())
    }
}
