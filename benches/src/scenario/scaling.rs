//! The scenario group `collision-scaling`: two spheres crossing in a ring, up to 5 million triangles
//! each; building hierarchies, and querying built ones.

use super::{Measurement, Meter, Selection, reference, tableware};
use crate::row::Row;
use crate::suite::gold_meshes::wrong_pairs;
use anyhow::Context;
use std::sync::OnceLock;
use vertebra::collision::RelativePose;
use vertebra::glam::DVec3;
use vertebra::{Collider, Pose, Query, TriangleMesh};

/// Name of the group of scenarios.
pub const NAME: &str = "collision-scaling";

/// Steps around and down the spheres: 2 around (down - 1) triangles, 50 000 to 5 million.
const STEPS: [(usize, usize); 3] = [(224, 113), (708, 354), (2236, 1119)];

/// Triangles beyond which a quick run measures none.
const QUICK_LIMIT: u64 = 200_000;

/// Where the second sphere stands, 1.5 radii away and along no axis \[m].
const ASIDE: DVec3 = DVec3::new(0.37, 0.61, 1.32);

/// Two spheres of one size.
#[derive(Debug)]
pub struct Subject {
    around: usize,
    down: usize,
    /// Made once a row needs them: they take a while, and memory.
    made: OnceLock<Made>,
}

#[derive(Debug)]
struct Made {
    sphere: TriangleMesh,
    pairs: Vec<[u32; 2]>,
}

/// The sizes.
#[must_use]
pub fn subjects(selection: &Selection) -> Vec<Subject> {
    STEPS
        .into_iter()
        .map(|(around, down)| Subject {
            around,
            down,
            made: OnceLock::new(),
        })
        .filter(|subject| !selection.quick || subject.size() <= QUICK_LIMIT)
        .collect()
}

/// Measures a row on some threads; gives none when interrupted.
type Run = fn(&Subject, &Meter, usize) -> anyhow::Result<Option<Row>>;

impl Subject {
    /// Triangles of both spheres.
    fn size(&self) -> u64 {
        4 * self.around as u64 * (self.down as u64 - 1)
    }

    /// The sphere, and the pairs found apart from any query.
    fn made(&self) -> anyhow::Result<&Made> {
        if self.made.get().is_none() {
            let sphere = tableware::uv_sphere(self.around, self.down)?;
            let pose = RelativePose::between(&Pose::IDENTITY, &Pose::from_translation(ASIDE))?;
            let pairs = reference::pairs(&sphere, &sphere, &pose);
            drop(self.made.set(Made { sphere, pairs }));
        }
        self.made.get().context("it was made above")
    }

    /// The rows asked for.
    #[must_use]
    pub fn measurements<'a>(&'a self, selection: &Selection) -> Vec<Measurement<'a>> {
        let kinds: [(&str, Run); 2] = [
            ("build", Self::build),
            ("exact-pairs-resident", Self::query),
        ];
        let mut list = Vec::new();
        for threads in selection.threads() {
            for (name, run) in kinds {
                if selection.wants(name) {
                    let label = format!(
                        "crossing spheres, {} triangles: {name} on {threads} threads",
                        self.size()
                    );
                    list.push(Measurement::new(label, move |meter| {
                        run(self, meter, threads)
                    }));
                }
            }
        }
        list
    }

    /// Both hierarchies. Errors: the pairs that a query finds with them.
    fn build(&self, meter: &Meter, threads: usize) -> anyhow::Result<Option<Row>> {
        let sphere = &self.made()?.sphere;
        // A collider owns its mesh, whose copy is not what is measured: it is handed on.
        let mut meshes = vec![sphere.clone(), sphere.clone()];
        let build = |mesh: TriangleMesh| Collider::on_threads(mesh, threads);
        let timing = meter.time(|| {
            let colliders = meshes.drain(..).map(build);
            meshes = colliders.map(Collider::into_mesh).collect();
            Ok::<(), anyhow::Error>(())
        })?;
        let [a, b] = [sphere, sphere].map(|mesh| build(mesh.clone()));
        self.row("build", threads, timing, &a, &b)
    }

    /// Pairs of prepared meshes, sorted.
    fn query(&self, meter: &Meter, threads: usize) -> anyhow::Result<Option<Row>> {
        let sphere = &self.made()?.sphere;
        let [a, b] = [sphere, sphere].map(|mesh| Collider::on_threads(mesh.clone(), 0));
        let query = Query::new(&a, &b).pose_b(Pose::from_translation(ASIDE))?;
        let query = query.threads(threads);
        let timing = meter.time(|| query.pairs())?;
        self.row("exact-pairs-resident", threads, timing, &a, &b)
    }

    fn row(
        &self,
        method: &str,
        threads: usize,
        timing: Option<crate::measure::Timing>,
        a: &Collider,
        b: &Collider,
    ) -> anyhow::Result<Option<Row>> {
        let query = Query::new(a, b).pose_b(Pose::from_translation(ASIDE))?;
        let found = query.threads(threads).pairs()?;
        let (false_pairs, missed_pairs) = wrong_pairs(&found, &self.made()?.pairs);
        Ok(timing.map(|timing| Row {
            threads,
            hits: Some(found.len() as u64),
            false_pairs: Some(false_pairs),
            missed_pairs: Some(missed_pairs),
            ..Row::new(
                "crossing spheres",
                method,
                "-",
                self.size(),
                "triangles",
                &timing,
            )
        }))
    }
}
