//! Classes, curves and distances of two meshes.

use super::{Subject, Verdict, named};
use crate::row::Row;
use crate::scenario::clipping::Overlap;
use crate::scenario::{Meter, closeness, meshes};
use crate::suite::gold_meshes::wrong_pairs;
use anyhow::{Context, ensure};
use std::collections::BTreeSet;
use vertebra::glam::DVec3;
use vertebra::{Collider, Curves, PairClass, Query};

/// Pairs no further apart than this are asked for \[m].
const DISTANCE: f64 = 2e-3;

/// Both meshes, as they are or prepared.
struct Meshes<'a> {
    subject: &'a meshes::Subject,
    colliders: Option<[Collider; 2]>,
}

impl<'a> Meshes<'a> {
    fn new(subject: &'a meshes::Subject, resident: bool) -> Self {
        let prepare = || [&subject.a, &subject.b].map(|mesh| Collider::new(mesh.clone()));
        Self {
            subject,
            colliders: resident.then(prepare),
        }
    }

    fn query(&self, threads: usize) -> anyhow::Result<Query<'_>> {
        let query = match &self.colliders {
            Some([a, b]) => Query::new(a, b).pose_b(self.subject.pose_b)?,
            None => self.subject.query()?,
        };
        Ok(query.threads(threads))
    }

    /// In what a pair meets, by clipping.
    fn overlap(&self, [i, j]: [u32; 2]) -> anyhow::Result<Overlap> {
        let triangles = [
            self.subject.a.triangle(i as usize),
            self.subject.b.triangle(j as usize),
        ];
        Overlap::of(&triangles).context("a triangle has no area")
    }

    fn row(
        &self,
        verdict: Verdict,
        method: (&str, usize),
        timing: Option<crate::measure::Timing>,
        note: &str,
    ) -> Option<Row> {
        let (name, threads) = method;
        verdict.row(
            (&self.subject.scenario, name, threads),
            (self.subject.size(), "triangle pairs"),
            timing,
            note.to_owned(),
        )
    }
}

/// Errors: pairs too many or of another class, and too few.
pub(super) fn classified(
    subject: &Subject,
    meter: &Meter,
    threads: usize,
    resident: bool,
) -> anyhow::Result<Option<Row>> {
    let meshes = Meshes::new(&subject.pair, resident);
    let query = meshes.query(threads)?;
    let found = query.classified()?;
    let pairs: Vec<[u32; 2]> = found.iter().map(|pair| [pair.a, pair.b]).collect();
    let mut verdict = Verdict::default();
    verdict.add(pairs.len(), wrong_pairs(&pairs, subject.pair.reference()?));
    for (pair, found) in pairs.iter().zip(&found) {
        // That pairs which do not meet are wrong is counted already.
        let class = meshes.overlap(*pair)?.class;
        verdict.false_pairs += u64::from(class.is_some_and(|class| class != found.class));
    }
    let timing = meter.time(|| query.classified())?;
    let name = named("exact-classified", resident);
    let note = "errors: pairs of another class than clipping in integers finds";
    Ok(meshes.row(verdict, (&name, threads), timing, note))
}

/// Errors: segments too many and too few; the largest distance of a point from the corner of an intersection that it
/// should be, over the largest coordinate.
pub(super) fn curves(
    subject: &Subject,
    meter: &Meter,
    threads: usize,
    resident: bool,
) -> anyhow::Result<Option<Row>> {
    let meshes = Meshes::new(&subject.pair, resident);
    let query = meshes.query(threads)?;
    let mut intersections = Vec::new();
    for pair in subject.pair.reference()? {
        let overlap = meshes.overlap(*pair)?;
        ensure!(
            overlap.class != Some(PairClass::Area),
            "triangles {pair:?} share an area: which of its sides are on a curve, clipping does not tell"
        );
        intersections.push(overlap.positions());
    }
    let verdict = judge_curves(&query.curves()?, &intersections);
    let timing = meter.time(|| query.curves())?;
    let name = named("exact-curves", resident);
    let note = "hits and errors count segments; forward: points, against clipping in integers";
    Ok(meshes.row(verdict, (&name, threads), timing, note))
}

fn judge_curves(curves: &Curves, intersections: &[Vec<DVec3>]) -> Verdict {
    let points: Vec<DVec3> = curves.points().iter().map(|p| p.position).collect();
    let largest = |length: f64, p: &DVec3| length.max(p.abs().max_element());
    let extent = points.iter().fold(f64::MIN_POSITIVE, largest);
    let (mut furthest, mut segments) = (0.0_f64, BTreeSet::new());
    for corners in intersections {
        let mut ends = Vec::new();
        for corner in corners {
            let apart = |(i, p): (usize, &DVec3)| (i, (*p - *corner).length());
            let near = points.iter().enumerate().map(apart);
            let nearest = near.min_by(|one, other| one.1.total_cmp(&other.1));
            let (index, distance) = nearest.unwrap_or((usize::MAX, extent));
            furthest = furthest.max(distance);
            ends.push(index);
        }
        if let [one, other] = ends[..] {
            segments.insert([one.min(other), one.max(other)]);
        }
    }
    let mut found = BTreeSet::new();
    for curve in curves.curves() {
        let next = curve.points.iter().cycle().skip(1);
        let count = curve.points.len() - usize::from(!curve.closed);
        for (&one, &other) in curve.points.iter().zip(next).take(count) {
            let (one, other) = (one as usize, other as usize);
            found.insert([one.min(other), one.max(other)]);
        }
    }
    Verdict {
        hits: found.len() as u64,
        false_pairs: found.difference(&segments).count() as u64,
        missed_pairs: segments.difference(&found).count() as u64,
        forward: Some(furthest / extent),
    }
}

/// Errors: pairs too many and too few, but for those at the very distance; the largest amount by which a distance is
/// beyond its bounds, over the largest coordinate.
pub(super) fn within(
    subject: &Subject,
    meter: &Meter,
    threads: usize,
    resident: bool,
) -> anyhow::Result<Option<Row>> {
    let meshes = Meshes::new(&subject.pair, resident);
    let query = meshes.query(threads)?;
    let found = query.within(DISTANCE)?;
    let vertices = subject
        .pair
        .a
        .vertices()
        .iter()
        .chain(subject.pair.b.vertices());
    let extent = vertices.fold(0.0_f32, |length, p| length.max(p.abs().max_element()));
    let slack = closeness::ROUNDING * f64::from(extent);
    let (a, b) = (&subject.pair.a, &subject.pair.b);
    let close = closeness::within(a, b, query.relative_pose(), DISTANCE + slack);
    let mut verdict = Verdict {
        hits: found.len() as u64,
        ..Verdict::default()
    };
    let mut beyond = 0.0_f64;
    for pair in &found {
        match close.binary_search_by_key(&[pair.a, pair.b], |(pair, _)| *pair) {
            Ok(index) => {
                let distance = close[index].1;
                let outside = (pair.distance.lower - distance).max(distance - pair.distance.upper);
                beyond = beyond.max(outside);
            }
            Err(_) => verdict.false_pairs += 1,
        }
    }
    for (pair, distance) in &close {
        let missed = found
            .binary_search_by_key(pair, |pair| [pair.a, pair.b])
            .is_err();
        verdict.missed_pairs += u64::from(missed && *distance < DISTANCE - slack);
    }
    verdict.forward = Some(beyond / f64::from(extent));
    let timing = meter.time(|| query.within(DISTANCE))?;
    let name = named("exact-within", resident);
    let note = format!(
        "pairs within {} mm; forward: distances beyond their bounds",
        DISTANCE * 1e3
    );
    Ok(meshes.row(verdict, (&name, threads), timing, &note))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra::TriangleMesh;
    use vertebra::glam::Vec3;

    #[test]
    fn a_segment_too_many_or_too_few_and_a_point_aside_are_seen() -> anyhow::Result<()> {
        let floor = TriangleMesh::new(
            vec![Vec3::NEG_X * 4.0, Vec3::X * 4.0, Vec3::Y * 4.0],
            vec![[0, 1, 2]],
        )?;
        let wall = TriangleMesh::new(
            vec![
                Vec3::new(0.0, 1.0, -1.0),
                Vec3::new(0.5, 1.0, 1.0),
                Vec3::new(-0.5, 1.0, 1.0),
            ],
            vec![[0, 1, 2]],
        )?;
        let curves = Query::new(&floor, &wall).curves()?;
        let exact = vec![DVec3::new(0.25, 1.0, 0.0), DVec3::new(-0.25, 1.0, 0.0)];
        let right = judge_curves(&curves, std::slice::from_ref(&exact));
        assert_eq!(
            (right.hits, right.false_pairs, right.missed_pairs),
            (1, 0, 0)
        );
        assert_eq!(right.forward, Some(0.0));
        let too_many = judge_curves(&curves, &[]);
        assert_eq!((too_many.false_pairs, too_many.missed_pairs), (1, 0));
        let aside = vec![exact[0] + DVec3::Z * 0.125, exact[1]];
        assert_eq!(judge_curves(&curves, &[aside]).forward, Some(0.125));
        let none = judge_curves(&Curves::default(), &[exact]);
        assert_eq!(none.forward, Some(1.0));
        Ok(())
    }
}
