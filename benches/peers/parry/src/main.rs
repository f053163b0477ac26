//! parry3d: leaf pairs of two hierarchies, then its intersection test (GJK) of two triangles; in
//! both of its precisions.

mod serve;

use serve::{Method, Obj, Result, serve};
use std::process::ExitCode;

/// The methods in one precision.
macro_rules! methods {
    ($parry:ident, $real:ty, $precision:literal, $a:expr, $b:expr) => {{
        use $parry::math::{Pose, Vector};
        use $parry::query::intersection_test;
        use $parry::shape::TriMesh;

        let build = |obj: &Obj| {
            let vertices = obj.vertices.iter().map(|v| {
                let [x, y, z] = v.map(|x| x as $real);
                Vector::new(x, y, z)
            });
            TriMesh::new(vertices.collect(), obj.triangles.clone())
        };
        let query = |a: &TriMesh, b: &TriMesh| {
            let pairs = a.bvh().leaf_pairs(b.bvh(), |x, y| x.intersects(y));
            let place = Pose::IDENTITY;
            let meet = |&(i, j): &(u32, u32)| {
                let (t, u) = (a.triangle(i), b.triangle(j));
                intersection_test(&place, &t, &place, &u).is_ok_and(|found| found.intersecting)
            };
            pairs.filter(meet).map(|(i, j)| [i, j]).collect::<Vec<_>>()
        };
        let (a, b): (Obj, Obj) = ($a.clone(), $b.clone());
        let (built_a, built_b) = (build(&a)?, build(&b)?);
        let note = "leaf pairs of two hierarchies, then intersection_test of two triangles (GJK)";
        [
            Method {
                name: "parry-total",
                precision: $precision,
                stage: "total",
                note,
                call: Box::new(move || Ok(query(&build(&a)?, &build(&b)?))),
            },
            Method {
                name: "parry-query",
                precision: $precision,
                stage: "query",
                note,
                call: Box::new(move || Ok(query(&built_a, &built_b))),
            },
        ]
    }};
}

fn main() -> ExitCode {
    let outcome = match std::env::args().nth(1) {
        Some(folder) => compare(&folder),
        None => Err("give it a folder with a.obj and b.obj".into()),
    };
    outcome.map_or_else(
        |error| {
            eprintln!("parry3d: {error}");
            ExitCode::FAILURE
        },
        |()| ExitCode::SUCCESS,
    )
}

fn compare(folder: &str) -> Result<()> {
    let [a, b] = ["a", "b"].map(|side| Obj::read(&format!("{folder}/{side}.obj")));
    let (a, b) = (a?, b?);
    let mut methods = Vec::new();
    methods.extend(methods!(parry3d_f64, f64, "f64", a, b));
    methods.extend(methods!(parry3d, f32, "f32", a, b));
    serve("parry3d 0.31.1", &mut methods)
}
