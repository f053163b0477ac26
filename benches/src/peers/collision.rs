//! All colliding pairs of triangles of two meshes: the scenarios of [`meshes`], and the reference
//! meshes, whose pairs were found by another program.

use super::Problem;
use super::contender::{Answer, Method, Own, OwnMethod};
use crate::export::posed_obj;
use crate::results::write_atomically;
use crate::row::Row;
use crate::scenario::meshes;
use crate::suite::gold_meshes::{self, wrong_pairs};
use std::path::Path;
use vertebra::{Collider, Pose, Query, TriangleMesh};

/// Name on the command line.
pub const NAME: &str = "collision";

/// Two meshes where they lie, and their pairs.
struct MeshPair {
    scenario: String,
    a: TriangleMesh,
    b: TriangleMesh,
    exact: Vec<[u32; 2]>,
}

/// The problems.
///
/// # Errors
/// If a mesh of ours is not valid, or moved.
pub fn problems() -> anyhow::Result<Vec<Box<dyn Problem>>> {
    let mut problems: Vec<Box<dyn Problem>> = Vec::new();
    for subject in meshes::subjects()? {
        anyhow::ensure!(
            subject.pose_b == Pose::IDENTITY,
            "{}: the peers take meshes where they lie",
            subject.scenario
        );
        problems.push(Box::new(MeshPair {
            exact: subject.reference()?.to_vec(),
            scenario: subject.scenario,
            a: subject.a,
            b: subject.b,
        }));
    }
    for case in gold_meshes::cases()? {
        problems.push(Box::new(MeshPair {
            scenario: format!("gold {}", case.name),
            a: case.a,
            b: case.b,
            exact: case.pairs,
        }));
    }
    Ok(problems)
}

fn method(name: &str, stage: &str, note: &str) -> Method {
    Method {
        name: name.to_owned(),
        precision: "-".to_owned(),
        stage: stage.to_owned(),
        note: note.to_owned(),
    }
}

impl Problem for MeshPair {
    fn scenario(&self) -> &str {
        &self.scenario
    }

    fn size(&self) -> (u64, &'static str) {
        (self.a.len() as u64 * self.b.len() as u64, "triangle pairs")
    }

    fn export(&self, folder: &Path) -> anyhow::Result<()> {
        for (name, mesh) in [("a.obj", &self.a), ("b.obj", &self.b)] {
            let text = posed_obj(mesh, &Pose::IDENTITY)?;
            write_atomically(&folder.join(name), text.as_bytes())?;
        }
        Ok(())
    }

    fn own(&self) -> anyhow::Result<Own<'_>> {
        let one_shot = || Ok(Query::new(&self.a, &self.b).pairs()?);
        let [a, b] = [&self.a, &self.b].map(|mesh| Collider::new(mesh.clone()));
        let (a_too, b_too) = (a.clone(), b.clone());
        Ok(Own::new(vec![
            OwnMethod {
                method: method(
                    "exact-pairs",
                    "total",
                    "sorted pairs of two meshes as loaded, one thread",
                ),
                problems: 1,
                call: Box::new(move || one_shot().map(drop)),
                answer: Box::new(move || one_shot().map(Answer::Pairs)),
            },
            OwnMethod {
                method: method(
                    "exact-pairs-resident",
                    "query",
                    "sorted pairs of two prepared meshes, one thread",
                ),
                problems: 1,
                call: Box::new(move || Ok(Query::new(&a, &b).pairs().map(drop)?)),
                answer: Box::new(move || Ok(Answer::Pairs(Query::new(&a_too, &b_too).pairs()?))),
            },
        ]))
    }

    fn judge(&self, answer: &Answer, row: Row) -> anyhow::Result<Row> {
        let Answer::Pairs(pairs) = answer else {
            anyhow::bail!("it answered with something else than pairs");
        };
        let mut pairs = pairs.clone();
        pairs.sort_unstable();
        let listed = pairs.len();
        pairs.dedup();
        anyhow::ensure!(pairs.len() == listed, "it listed a pair twice");
        let (false_pairs, missed_pairs) = wrong_pairs(&pairs, &self.exact);
        Ok(Row {
            hits: Some(pairs.len() as u64),
            false_pairs: Some(false_pairs),
            missed_pairs: Some(missed_pairs),
            ..row
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peers::contender::Contender;
    use crate::row::tests::row;

    #[test]
    fn wrong_pairs_are_counted_and_repeated_ones_refused() {
        let problems = problems().unwrap();
        assert_eq!(problems.len(), 6);
        for problem in &problems {
            let mut own = problem.own().unwrap();
            let Answer::Pairs(mut pairs) = own.answer(0).unwrap() else {
                panic!("no pairs");
            };
            let judge = |pairs: &[[u32; 2]]| {
                let row = row(problem.scenario(), "m", "-", 1, 1e-3);
                problem.judge(&Answer::Pairs(pairs.to_vec()), row)
            };
            let right = judge(&pairs).unwrap();
            assert_eq!((right.false_pairs, right.missed_pairs), (Some(0), Some(0)));
            let last = pairs.pop().unwrap();
            pairs.insert(0, [u32::MAX, last[1]]);
            let wrong = judge(&pairs).unwrap();
            assert_eq!((wrong.false_pairs, wrong.missed_pairs), (Some(1), Some(1)));
            pairs.push(pairs[1]);
            assert!(judge(&pairs).is_err());
            assert!(
                problem
                    .judge(&Answer::Accelerations(Vec::new()), right)
                    .is_err()
            );
        }
    }
}
