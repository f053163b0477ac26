//! Meshes whose intersecting pairs are known from exact arithmetic.

use super::{Figure, Outcome};
use vertebra::{Query, TriangleMesh};

/// One pair of meshes and its list.
pub struct Case {
    /// What meets what.
    pub name: &'static str,
    /// The first mesh.
    pub a: TriangleMesh,
    /// The second mesh, where it lies.
    pub b: TriangleMesh,
    /// Every intersecting pair, sorted.
    pub pairs: Vec<[u32; 2]>,
}

/// The three reference pairs.
///
/// # Errors
/// If a file is not what it should be.
pub fn cases() -> anyhow::Result<Vec<Case>> {
    let cup: &[u8] = include_bytes!("../../gold/meshes/cup.obj");
    [
        (
            "sphere x cylinder",
            include_bytes!("../../gold/meshes/sphere.obj").as_slice(),
            include_bytes!("../../gold/meshes/cylinder.obj").as_slice(),
            include_str!("../../gold/meshes/pairs_sphere_cylinder.txt"),
        ),
        (
            "cup x bowl",
            cup,
            include_bytes!("../../gold/meshes/bowl.obj").as_slice(),
            include_str!("../../gold/meshes/pairs_cup_bowl.txt"),
        ),
        (
            "cup x spoon",
            cup,
            include_bytes!("../../gold/meshes/spoon.obj").as_slice(),
            include_str!("../../gold/meshes/pairs_cup_spoon.txt"),
        ),
    ]
    .into_iter()
    .map(|(name, a, b, list)| {
        Ok(Case {
            name,
            a: TriangleMesh::from_obj(a)?,
            b: TriangleMesh::from_obj(b)?,
            pairs: read_pairs(list)?,
        })
    })
    .collect()
}

fn read_pairs(list: &str) -> anyhow::Result<Vec<[u32; 2]>> {
    let mut pairs = Vec::new();
    for line in list.lines() {
        let (a, b) = line
            .split_once(' ')
            .ok_or_else(|| anyhow::anyhow!("not a pair: `{line}`"))?;
        pairs.push([a.trim().parse()?, b.trim().parse()?]);
    }
    pairs.sort_unstable();
    Ok(pairs)
}

/// Wrong pairs of the exact method: none, for one thread and for all.
///
/// # Errors
/// If a mesh cannot be read or queried.
pub fn pairs() -> Outcome {
    let mut figures = Vec::new();
    for case in cases()? {
        for threads in [1, 2, 0] {
            let found = Query::new(&case.a, &case.b).threads(threads).pairs()?;
            let (false_pairs, missed_pairs) = wrong_pairs(&found, &case.pairs);
            #[expect(clippy::cast_precision_loss, reason = "a count that must be 0")]
            let wrong = (false_pairs + missed_pairs) as f64;
            let name = format!("{} with {threads} threads", case.name);
            figures.push(Figure::new(name, wrong, 0.0));
        }
    }
    Ok(figures)
}

/// How many of the sorted `found` are not in the sorted `exact`, and how many of `exact` are not in
/// `found`.
#[must_use]
pub fn wrong_pairs(found: &[[u32; 2]], exact: &[[u32; 2]]) -> (u64, u64) {
    let absent = |from: &[[u32; 2]], list: &[[u32; 2]]| {
        let count = from
            .iter()
            .filter(|p| list.binary_search(p).is_err())
            .count();
        count as u64
    };
    (absent(found, exact), absent(exact, found))
}
