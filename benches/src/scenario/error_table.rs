//! The scenario group `collision-error`: tests of two triangles held against integer arithmetic, on
//! pairs that meshes make of them and on pairs where tests err. Speed, always beside error.

use super::error_inputs::{self, TrianglePair};
use super::separating_axes::{Truth, triangles_meet};
use super::{Measurement, Meter, Selection};
use crate::row::Row;
use std::sync::OnceLock;
use vertebra::Precision;
use vertebra::collision::exact::triangles_intersect;
use vertebra::collision::moller::{DEFAULT_EPSILON, PlanedTriangle};
use vertebra::glam::Vec3;

/// Name of the group of scenarios.
pub const NAME: &str = "collision-error";

/// A list of pairs.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Name of the scenario in the rows.
    pub scenario: String,
    pairs: Vec<TrianglePair>,
    /// What integers say of them, once a row needs it.
    judged: OnceLock<Judged>,
}

/// The pairs of which integers can tell, and what they tell.
#[derive(Clone, Debug, Default)]
struct Judged {
    pairs: Vec<TrianglePair>,
    meet: Vec<bool>,
    coplanar: usize,
    zero_area: usize,
}

/// A test of two triangles.
type Test = fn(&TrianglePair) -> bool;

/// The tests: name, precision, test. None prepares anything ahead.
const TESTS: [(&str, Option<Precision>, Test); 5] = [
    ("exact", None, |[a, b]| {
        triangles_intersect(&a.map(Vec3::as_dvec3), &b.map(Vec3::as_dvec3))
    }),
    ("moller", Some(Precision::F32), |pair| {
        let [a, b] = pair.map(PlanedTriangle::new);
        a.intersects(&b, DEFAULT_EPSILON)
    }),
    ("moller0", Some(Precision::F32), |pair| {
        let [a, b] = pair.map(PlanedTriangle::new);
        a.intersects(&b, 0.0)
    }),
    ("separating-axes", Some(Precision::F32), |pair| {
        let [a, b] = pair.map(|t| t.map(|p| p.to_array()));
        triangles_meet(&a, &b)
    }),
    ("separating-axes", Some(Precision::F64), |pair| {
        let [a, b] = pair.map(|t| t.map(|p| p.as_dvec3().to_array()));
        triangles_meet(&a, &b)
    }),
];

/// The lists.
///
/// # Errors
/// None in practice: the meshes are valid.
pub fn subjects(selection: &Selection) -> anyhow::Result<Vec<Subject>> {
    let subject = |(name, pairs)| Subject {
        scenario: format!("error: {name}"),
        pairs,
        judged: OnceLock::new(),
    };
    Ok(error_inputs::lists(selection.seed)?
        .into_iter()
        .map(subject)
        .collect())
}

impl Subject {
    fn judged(&self) -> &Judged {
        self.judged.get_or_init(|| {
            let mut judged = Judged::default();
            for pair in &self.pairs {
                let meet = match Truth::of(pair) {
                    Truth::ZeroArea => {
                        judged.zero_area += 1;
                        continue;
                    }
                    Truth::Coplanar(meet) => {
                        judged.coplanar += 1;
                        meet
                    }
                    Truth::General(meet) => meet,
                };
                judged.pairs.push(*pair);
                judged.meet.push(meet);
            }
            judged
        })
    }

    /// The pairs of which integers can tell, and whether each meets.
    pub(super) fn judged_pairs(&self) -> (&[TrianglePair], &[bool]) {
        let Judged { pairs, meet, .. } = self.judged();
        (pairs, meet)
    }

    /// The rows asked for.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let wanted = |(name, precision, _): &(&str, Option<Precision>, Test)| {
            selection.wants(name) && precision.is_none_or(|p| selection.precisions().contains(&p))
        };
        TESTS
            .into_iter()
            .filter(wanted)
            .map(|(name, precision, test)| {
                let precision = precision.map_or("-".to_owned(), |p| p.to_string());
                let label = format!("{}: {name} {precision}", self.scenario);
                Measurement::new(label, move |meter| {
                    self.measure(meter, name, &precision, test)
                })
            })
            .collect()
    }

    fn measure(
        &self,
        meter: &Meter,
        name: &str,
        precision: &str,
        test: Test,
    ) -> anyhow::Result<Option<Row>> {
        let Judged {
            pairs,
            meet,
            coplanar,
            zero_area,
        } = self.judged();
        let (mut hits, mut false_pairs, mut missed_pairs) = (0, 0, 0);
        for (pair, meet) in pairs.iter().zip(meet) {
            let found = test(pair);
            hits += u64::from(found);
            false_pairs += u64::from(found && !meet);
            missed_pairs += u64::from(!found && *meet);
        }
        let timing = meter.time(|| {
            let hits = pairs.iter().filter(|pair| test(pair)).count();
            Ok::<usize, anyhow::Error>(hits)
        })?;
        Ok(timing.map(|timing| Row {
            hits: Some(hits),
            false_pairs: Some(false_pairs),
            missed_pairs: Some(missed_pairs),
            note: format!(
                "{} of {} pairs meet, {coplanar} share a plane; {zero_area} with a triangle of zero area are left out",
                meet.iter().filter(|meet| **meet).count(),
                pairs.len()
            ),
            ..Row::new(
                &self.scenario,
                name,
                precision,
                pairs.len() as u64,
                "candidate pairs",
                &timing,
            )
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the group is there to show, and that its judge can tell right from wrong.
    #[test]
    fn the_exact_test_is_right_everywhere_and_each_other_errs_somewhere() -> anyhow::Result<()> {
        let selection = Selection {
            methods: Vec::new(),
            precisions: Vec::new(),
            sizes: Vec::new(),
            threads: Vec::new(),
            seed: 1,
            quick: true,
        };
        let mut wrong = [0; TESTS.len()];
        for subject in subjects(&selection)? {
            let judged = subject.judged();
            assert!(judged.pairs.len() > 300, "{}", subject.scenario);
            for ((_, _, test), wrong) in TESTS.iter().zip(&mut wrong) {
                for (pair, meet) in judged.pairs.iter().zip(&judged.meet) {
                    *wrong += usize::from(test(pair) != *meet);
                }
            }
        }
        let [exact, others @ ..] = wrong;
        assert_eq!(exact, 0);
        assert!(others.iter().all(|wrong| *wrong > 0), "{others:?}");
        Ok(())
    }
}
