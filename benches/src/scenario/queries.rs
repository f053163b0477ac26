//! The scenario group `collision-queries`: what can be asked about meshes beyond which triangles meet, each answer held
//! against a judge apart. Where a judge sweeps, or finds distance 0, it has the exact test of two triangles in common
//! with the query, as [`super::reference`] says; and nothing else.
//!
//! | row | question | judge |
//! |---|---|---|
//! | `exact-classified` | in what do triangles meet | clipping in integers |
//! | `exact-curves` | where surfaces meet | corners of the intersections, by clipping in integers |
//! | `exact-within` | pairs within a distance, and how far | distances of edges and corners in f64, without hierarchy |
//! | `self-pairs` | where does a mesh meet itself | a sweep, and for neighbours clipping in integers |
//! | `inside` | are points inside | winding numbers from solid angles |
//! | `poses`, `links` | pairs in many poses, of many bodies | a sweep for each |
//! | `refit`, `rebuild` | none: vertices moved | pairs found afterwards, against a sweep |

mod many;
mod moved;
mod one_mesh;
mod two_meshes;

use super::{Measurement, Meter, Selection, meshes, tableware};
use crate::measure::Timing;
use crate::row::Row;
use std::sync::OnceLock;
use vertebra::{Pose, TriangleMesh};

/// Name of the group of scenarios.
pub const NAME: &str = "collision-queries";

/// Meshes, and what judges made of them once a row needed it.
#[derive(Debug)]
pub struct Subject {
    /// A cup and a spoon that cross.
    pair: meshes::Subject,
    /// A mesh that meets itself.
    own: TriangleMesh,
    own_name: &'static str,
    own_pairs: OnceLock<Vec<[u32; 2]>>,
    sphere: TriangleMesh,
    cylinder: TriangleMesh,
    seed: u64,
}

/// Measures a row on some threads; gives none when interrupted.
type Run = fn(&Subject, &Meter, usize) -> anyhow::Result<Option<Row>>;

/// Whether a row is measured on every number of threads asked for, or takes one.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Threads {
    Shared,
    One,
}

/// Every row.
const METHODS: [(&str, Threads, Run); 14] = [
    ("exact-classified", Threads::Shared, |s, meter, threads| {
        two_meshes::classified(s, meter, threads, false)
    }),
    (
        "exact-classified-resident",
        Threads::Shared,
        |s, meter, threads| two_meshes::classified(s, meter, threads, true),
    ),
    ("exact-curves", Threads::Shared, |s, meter, threads| {
        two_meshes::curves(s, meter, threads, false)
    }),
    (
        "exact-curves-resident",
        Threads::Shared,
        |s, meter, threads| two_meshes::curves(s, meter, threads, true),
    ),
    ("exact-within", Threads::Shared, |s, meter, threads| {
        two_meshes::within(s, meter, threads, false)
    }),
    (
        "exact-within-resident",
        Threads::Shared,
        |s, meter, threads| two_meshes::within(s, meter, threads, true),
    ),
    ("self-pairs", Threads::Shared, |s, meter, threads| {
        one_mesh::self_pairs(s, meter, threads, false)
    }),
    (
        "self-pairs-resident",
        Threads::Shared,
        |s, meter, threads| one_mesh::self_pairs(s, meter, threads, true),
    ),
    ("inside", Threads::One, |s, meter, _| {
        one_mesh::inside(s, meter, false)
    }),
    ("inside-resident", Threads::One, |s, meter, _| {
        one_mesh::inside(s, meter, true)
    }),
    ("poses", Threads::Shared, many::poses),
    ("links", Threads::Shared, many::links),
    ("refit", Threads::One, |s, meter, _| moved::refit(s, meter)),
    ("rebuild", Threads::One, |s, meter, _| {
        moved::rebuild(s, meter)
    }),
];

impl Subject {
    /// The meshes.
    ///
    /// # Errors
    /// None in practice: the generated meshes are valid.
    pub fn new(selection: &Selection) -> anyhow::Result<Self> {
        let (sphere, cylinder) = (tableware::sphere()?, tableware::cylinder()?);
        // The cup's handle passes through its wall. Judging its neighbours takes seconds.
        let (own, own_name) = if selection.quick {
            (joined(&sphere, &cylinder)?, "sphere with cylinder")
        } else {
            (tableware::cup()?, "cup")
        };
        Ok(Self {
            pair: meshes::Subject::new(
                "queries: cup x spoon",
                tableware::cup()?,
                tableware::spoon()?,
                Pose::IDENTITY,
            ),
            own,
            own_name,
            own_pairs: OnceLock::new(),
            sphere,
            cylinder,
            seed: selection.seed,
        })
    }

    /// The rows asked for.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let mut list = Vec::new();
        for (place, threads) in selection.threads().into_iter().enumerate() {
            for (name, shared, run) in METHODS {
                let threads = match shared {
                    Threads::Shared => threads,
                    Threads::One if place == 0 => 1,
                    Threads::One => continue,
                };
                if selection.wants(name) {
                    let label = format!("queries: {name} on {threads} threads");
                    list.push(Measurement::new(label, move |meter| {
                        run(self, meter, threads)
                    }));
                }
            }
        }
        list
    }
}

/// What a judge counted.
#[derive(Clone, Copy, Debug, Default)]
struct Verdict {
    hits: u64,
    false_pairs: u64,
    missed_pairs: u64,
    forward: Option<f64>,
}

impl Verdict {
    /// The row, if it was timed.
    fn row(
        self,
        (scenario, method, threads): (&str, &str, usize),
        (size, unit): (u64, &str),
        timing: Option<Timing>,
        note: String,
    ) -> Option<Row> {
        timing.map(|timing| Row {
            threads,
            hits: Some(self.hits),
            false_pairs: Some(self.false_pairs),
            missed_pairs: Some(self.missed_pairs),
            error_forward: self.forward,
            note,
            ..Row::new(scenario, method, "-", size, unit, &timing)
        })
    }

    /// Adds what another judged.
    fn add(&mut self, hits: usize, (false_pairs, missed_pairs): (u64, u64)) {
        self.hits += hits as u64;
        self.false_pairs += false_pairs;
        self.missed_pairs += missed_pairs;
    }
}

/// The name of a row, with how its meshes come.
fn named(name: &str, resident: bool) -> String {
    let ending = if resident { "-resident" } else { "" };
    format!("{name}{ending}")
}

/// One mesh of two.
fn joined(a: &TriangleMesh, b: &TriangleMesh) -> anyhow::Result<TriangleMesh> {
    let vertices = [a.vertices(), b.vertices()].concat();
    let first = u32::try_from(a.vertices().len())?;
    let moved = b.triangles().iter().map(|t| t.map(|v| v + first));
    let triangles = a.triangles().iter().copied().chain(moved).collect();
    Ok(TriangleMesh::new(vertices, triangles)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interrupt::Interrupt;
    use crate::measure::Budget;

    /// Every question is answered as its judge answers it, and every row has found something.
    #[test]
    fn no_answer_is_wrong() -> anyhow::Result<()> {
        let selection = Selection {
            methods: Vec::new(),
            precisions: Vec::new(),
            sizes: Vec::new(),
            threads: vec![2],
            seed: 1,
            quick: true,
        };
        let meter = Meter {
            budget: Budget {
                min_samples: 3,
                max_samples: 3,
                max_time: std::time::Duration::ZERO,
            },
            interrupt: Interrupt::default(),
        };
        let subject = Subject::new(&selection)?;
        for measurement in subject.measurements(&selection) {
            let row = measurement.run(&meter)?.unwrap();
            row.validate()?;
            assert_eq!(row.wrong_pairs(), Some(0), "{row:?}");
            assert!(row.hits > Some(20), "{row:?}");
            assert!(row.error_forward.is_none_or(|e| e < 1e-14), "{row:?}");
        }
        Ok(())
    }
}
