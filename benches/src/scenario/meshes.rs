//! The source's scenario `collision`: all colliding pairs of triangles of two meshes.

use super::published::{self, MeshTimes};
use super::{Measurement, Meter, Selection, reference, tableware};
use crate::row::Row;
use crate::suite::gold_meshes::wrong_pairs;
use std::sync::OnceLock;
use vertebra::collision::{RelativePose, Statistics};
use vertebra::{Collider, Culling, Method, Pose, Precision, Query, TriangleMesh};

/// Name of the group of scenarios.
pub const NAME: &str = "collision";

/// Two meshes to be tested against each other.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Name of the scenario in the rows.
    pub scenario: String,
    /// The first mesh.
    pub a: TriangleMesh,
    /// The second mesh.
    pub b: TriangleMesh,
    /// Where the second mesh stands.
    pub pose_b: Pose,
    /// What the source published for it.
    pub published: Option<MeshTimes>,
    /// The pairs that rows are held against, once one needs them.
    reference: OnceLock<Vec<[u32; 2]>>,
}

/// The three pairs of the source.
///
/// # Errors
/// None in practice: the generated meshes are valid.
pub fn subjects() -> anyhow::Result<Vec<Subject>> {
    let subject = |scenario: &str, a, b, published| Subject {
        published: Some(published),
        ..Subject::new(scenario, a, b, Pose::IDENTITY)
    };
    let cup = tableware::cup()?;
    Ok(vec![
        subject(
            "sphere x cylinder",
            tableware::sphere()?,
            tableware::cylinder()?,
            published::SPHERE_CYLINDER,
        ),
        subject(
            "cup x bowl",
            cup.clone(),
            tableware::bowl()?,
            published::CUP_BOWL,
        ),
        subject(
            "cup x spoon",
            cup,
            tableware::spoon()?,
            published::CUP_SPOON,
        ),
    ])
}

/// Pairs of triangles beyond which a quick run does not test them all one by one: seconds a call.
const QUICK_LIMIT: u64 = 250_000_000;

/// What a query is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    Any,
    Count,
    Mask,
    Pairs,
}

/// How a query is set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Setup {
    /// As a user has two meshes: with everything that must be built.
    OneShot,
    /// Meshes prepared beforehand.
    Resident,
    /// Every triangle against every other.
    AllPairs,
}

/// A row: name, test, question, setup.
type RowKind = (&'static str, Method, Question, Setup);

/// Every row.
const METHODS: [RowKind; 11] = [
    ("exact-any", Method::Exact, Question::Any, Setup::OneShot),
    (
        "exact-count",
        Method::Exact,
        Question::Count,
        Setup::OneShot,
    ),
    ("exact-mask", Method::Exact, Question::Mask, Setup::OneShot),
    (
        "exact-pairs",
        Method::Exact,
        Question::Pairs,
        Setup::OneShot,
    ),
    (
        "exact-any-resident",
        Method::Exact,
        Question::Any,
        Setup::Resident,
    ),
    (
        "exact-count-resident",
        Method::Exact,
        Question::Count,
        Setup::Resident,
    ),
    (
        "exact-mask-resident",
        Method::Exact,
        Question::Mask,
        Setup::Resident,
    ),
    (
        "exact-pairs-resident",
        Method::Exact,
        Question::Pairs,
        Setup::Resident,
    ),
    (
        "exact-pairs-all",
        Method::Exact,
        Question::Pairs,
        Setup::AllPairs,
    ),
    (
        "moller-pairs",
        Method::MOLLER,
        Question::Pairs,
        Setup::AllPairs,
    ),
    (
        "moller0-pairs",
        Method::Moller { epsilon: 0.0 },
        Question::Pairs,
        Setup::AllPairs,
    ),
];

impl Subject {
    /// Two meshes, the second posed, for which nothing was published.
    #[must_use]
    pub fn new(scenario: &str, a: TriangleMesh, b: TriangleMesh, pose_b: Pose) -> Self {
        Self {
            scenario: scenario.to_owned(),
            a,
            b,
            pose_b,
            published: None,
            reference: OnceLock::new(),
        }
    }

    /// A query over the two meshes as they stand.
    ///
    /// # Errors
    /// If the pose is not valid.
    pub fn query(&self) -> anyhow::Result<Query<'_>> {
        Ok(Query::new(&self.a, &self.b).pose_b(self.pose_b)?)
    }

    /// The colliding pairs, sorted, found apart from any query.
    pub(crate) fn reference(&self) -> anyhow::Result<&[[u32; 2]]> {
        let pose = RelativePose::between(&Pose::IDENTITY, &self.pose_b)?;
        let pairs = || reference::pairs(&self.a, &self.b, &pose);
        Ok(self.reference.get_or_init(pairs))
    }

    /// The rows asked for.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        for threads in selection.threads() {
            for kind in METHODS {
                let (name, method, _, setup) = kind;
                // The baseline computes in f32; the exact test has no one precision.
                let in_precision =
                    method == Method::Exact || selection.precisions().contains(&Precision::F32);
                let slow = setup == Setup::AllPairs && self.size() > QUICK_LIMIT;
                if in_precision && selection.wants(name) && !(selection.quick && slow) {
                    let label = format!("{}: {name} on {threads} threads", self.scenario);
                    list.push(Measurement::new(label, move |meter| {
                        self.measure(meter, kind, threads)
                    }));
                }
            }
        }
        list
    }

    /// Number of pairs of triangles.
    #[must_use]
    pub fn size(&self) -> u64 {
        self.a.len() as u64 * self.b.len() as u64
    }

    /// Errors: pairs too many and too few against the reference.
    fn measure(
        &self,
        meter: &Meter,
        (name, method, question, setup): RowKind,
        threads: usize,
    ) -> anyhow::Result<Option<Row>> {
        let exact = self.reference()?;
        let colliders = (setup == Setup::Resident)
            .then(|| [&self.a, &self.b].map(|mesh| Collider::new(mesh.clone())));
        let query = match &colliders {
            Some([a, b]) => Query::new(a, b).pose_b(self.pose_b)?,
            None => self.query()?,
        };
        let culling = match setup {
            Setup::AllPairs => Culling::AllPairs,
            Setup::OneShot | Setup::Resident => Culling::Auto,
        };
        let query = query.method(method).culling(culling).threads(threads);
        let (timing, hits, wrong) = match question {
            Question::Any => {
                let found = query.any()?;
                // Of a yes or no, one answer can be wrong.
                let wrong = (
                    u64::from(found && exact.is_empty()),
                    u64::from(!found && !exact.is_empty()),
                );
                (meter.time(|| query.any())?, u64::from(found), wrong)
            }
            Question::Count => {
                let count = query.count()?;
                let expected = exact.len() as u64;
                let wrong = (
                    count.saturating_sub(expected),
                    expected.saturating_sub(count),
                );
                (meter.time(|| query.count())?, count, wrong)
            }
            Question::Mask => {
                let (a, b) = query.mask()?;
                let wrong = wrong_triangles(&a, &b, exact);
                let hits = a.iter().chain(&b).filter(|hit| **hit).count() as u64;
                (meter.time(|| query.mask())?, hits, wrong)
            }
            Question::Pairs => {
                let found = query.pairs()?;
                let wrong = wrong_pairs(&found, exact);
                (meter.time(|| query.pairs())?, found.len() as u64, wrong)
            }
        };
        let (precision, stages) = if method == Method::Exact {
            ("-", stages(&query.statistics()?))
        } else {
            ("f32", String::new())
        };
        Ok(timing.map(|timing| Row {
            threads,
            false_pairs: Some(wrong.0),
            missed_pairs: Some(wrong.1),
            hits: Some(hits),
            reference_time_s: match (question, self.published) {
                (Question::Pairs, Some(published)) => Some(published.gpu_s),
                _ => None,
            },
            note: self.note(question) + &stages,
            ..Row::new(
                &self.scenario,
                name,
                precision,
                self.size(),
                "triangle pairs",
                &timing,
            )
        }))
    }

    fn note(&self, question: Question) -> String {
        match (question, self.published) {
            (Question::Pairs, Some(published)) => format!(
                "{} x {} triangles; published: GPU {} ms, one CPU thread {} ms",
                self.a.len(),
                self.b.len(),
                published.gpu_s * 1e3,
                published.cpu_s * 1e3
            ),
            (Question::Mask, _) => "hits and errors count triangles".to_owned(),
            _ => format!("{} x {} triangles", self.a.len(), self.b.len()),
        }
    }
}

/// What the stages of the exact test decided, for a note.
fn stages(statistics: &Statistics) -> String {
    let share = |count: u64| 100.0 * count as f64 / (statistics.pairs.max(1)) as f64;
    format!(
        "; {} pairs of boxes overlap, of which {:.1} % are apart by a plane, {:.1} % decided on the line of two planes, \
         {:.1} % in two dimensions; in {:.2} % a sign needed more than the f64 filter",
        statistics.pairs,
        share(statistics.apart_by_first_plane + statistics.apart_by_second_plane),
        share(statistics.on_line),
        share(statistics.degenerate),
        share(statistics.beyond_filter),
    )
}

/// Triangles marked that meet none, and triangles not marked that meet some.
pub(super) fn wrong_triangles(a: &[bool], b: &[bool], exact: &[[u32; 2]]) -> (u64, u64) {
    let mut truth = (vec![false; a.len()], vec![false; b.len()]);
    for [i, j] in exact {
        truth.0[*i as usize] = true;
        truth.1[*j as usize] = true;
    }
    let marks = a.iter().chain(b).zip(truth.0.iter().chain(&truth.1));
    let mut wrong = (0, 0);
    for (found, exact) in marks {
        wrong.0 += u64::from(*found && !exact);
        wrong.1 += u64::from(!found && *exact);
    }
    wrong
}
