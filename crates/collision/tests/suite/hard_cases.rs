//! What must hold for whole meshes and for every small triangle: exhaustively, under maps, under subdivision.

use std::collections::BTreeSet;

use crate::support::{
    ORDERS, Random, Triangle, exploded, gold_mesh, hulls_meet, oracle, step_f32, wide,
};
use glam::{DVec3, Vec3};
use vertebra_collision::exact::triangles_intersect;
use vertebra_collision::{Collider, MeshError, Query, SelfQuery, TriangleMesh};

/// All triangles with corners in {0, 1, 2}³, corners in any fixed order, of zero area or not.
fn lattice_triangles() -> Vec<[usize; 3]> {
    let corners = (0..27).flat_map(|i| (i..27).flat_map(move |j| (j..27).map(move |k| [i, j, k])));
    corners.collect()
}

fn lattice_point(index: usize) -> [i128; 3] {
    [index / 9, index / 3 % 3, index % 3].map(|x| x as i128)
}

/// The least image of a triangle under the 48 symmetries of the cube.
fn least_image(triangle: [usize; 3]) -> [usize; 3] {
    let images = ORDERS.iter().flat_map(|order| {
        (0..8).map(move |flips| {
            let mut image = triangle.map(|index| {
                let p = lattice_point(index);
                let q = [0, 1, 2].map(|k| {
                    let x = p[order[k]];
                    if flips >> k & 1 == 1 { 2 - x } else { x }
                });
                (q[0] * 9 + q[1] * 3 + q[2]) as usize
            });
            image.sort_unstable();
            image
        })
    });
    images.min().unwrap()
}

/// One of each kind of triangle under symmetry, against all triangles: every pair there is, up to symmetry (under which
/// the answers do not change: `invariant_under_exact_maps`).
#[test]
fn all_pairs_on_the_small_lattice() {
    let all = lattice_triangles();
    assert_eq!(all.len(), 27 * 28 * 29 / 6);
    let kinds: BTreeSet<_> = all.iter().map(|&t| least_image(t)).collect();
    let mut hits = 0;
    for &kind in &kinds {
        let a = kind.map(lattice_point);
        for &other in &all {
            let b = other.map(lattice_point);
            let points = |t: [[i128; 3]; 3]| t.map(|p| DVec3::from(p.map(|x| x as f64)));
            let expected = hulls_meet(a, b);
            assert_eq!(
                triangles_intersect(&points(a), &points(b)),
                expected,
                "{a:?} {b:?}"
            );
            hits += usize::from(expected);
        }
    }
    assert!(
        kinds.len() > 90 && hits > kinds.len() * 1000,
        "{} {hits}",
        kinds.len()
    );
}

/// Parallel planes up to four steps of f32 apart, and planes at angles down to 2^-24.
#[test]
fn nearly_coplanar() {
    let mut random = Random::new(91);
    let mut hits = [0; 2];
    let mut check = |kind: usize, a: Triangle, b: Triangle| {
        let expected = oracle(&a, &b);
        assert_eq!(triangles_intersect(&a, &b), expected, "{a:?} {b:?}");
        assert_eq!(triangles_intersect(&b, &a), expected, "{b:?} {a:?}");
        hits[kind] += usize::from(expected);
    };
    for steps in 0..=4 {
        for _ in 0..100 {
            let flat = |random: &mut Random| -> Triangle {
                [(); 3].map(|()| {
                    DVec3::new(
                        random.unit() as f32 as f64,
                        random.unit() as f32 as f64,
                        1.0,
                    )
                })
            };
            let (a, b) = (flat(&mut random), flat(&mut random));
            check(0, a, b.map(|p| DVec3::new(p.x, p.y, step_f32(p.z, steps))));
        }
    }
    for exponent in 10..=24 {
        let slope = 2.0_f64.powi(-exponent);
        for _ in 0..50 {
            let mut flat = || -> Triangle { [(); 3].map(|()| random.lattice(-8, 8) / 8.0) };
            let (a, b) = (flat(), flat());
            let tilted = |p: DVec3, slope: f64| DVec3::new(p.x, p.y, 0.25 + p.x * slope);
            check(1, a.map(|p| tilted(p, 0.0)), b.map(|p| tilted(p, slope)));
        }
    }
    assert!(hits[0] > 30 && hits[0] < 100, "{hits:?}");
    assert!(hits[1] > 100 && hits[1] < 15 * 50, "{hits:?}");
}

/// Growing a triangle about a point of it never loses a hit.
#[test]
fn growing_keeps_hits() {
    let mut random = Random::new(92);
    let mut hits = 0;
    for _ in 0..3000 {
        let (a, b) = (
            random.lattice_triangle(-3, 3),
            random.lattice_triangle(-3, 3),
        );
        let mut met = false;
        for size in 1..5 {
            // A corner stays; multiples of lattice vectors are exact.
            let grown = a.map(|p| a[0] + (p - a[0]) * f64::from(size));
            let meets = triangles_intersect(&grown, &b);
            assert!(meets || !met, "{a:?} {b:?} {size}");
            met = meets;
            hits += usize::from(meets);
        }
    }
    assert!(hits > 1000);
}

/// A soup on a lattice of even numbers, so that halving is exact.
fn even_soup(random: &mut Random, count: u32) -> TriangleMesh {
    let vertices = (0..3 * count).map(|_| random.lattice(0, 6).as_vec3() * 2.0);
    let vertices = vertices.collect();
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(vertices, triangles.collect()).unwrap()
}

/// Each triangle as four, in a row.
fn subdivided(mesh: &TriangleMesh) -> TriangleMesh {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..mesh.len() {
        let [p, q, r] = mesh.triangle(i);
        let first = vertices.len() as u32;
        vertices.extend([p, q, r, (p + q) / 2.0, (q + r) / 2.0, (r + p) / 2.0]);
        let parts = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];
        triangles.extend(parts.map(|part| part.map(|corner| first + corner)));
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

#[test]
fn subdividing_meshes_changes_no_pair() {
    let mut random = Random::new(93);
    let (a, b) = (even_soup(&mut random, 120), even_soup(&mut random, 150));
    let pairs = Query::new(&a, &b).pairs().unwrap();
    assert!(pairs.len() > 300);
    let (fine_a, fine_b) = (subdivided(&a), subdivided(&b));
    for (a, b, parts) in [
        (&fine_a, &b, [4, 1]),
        (&a, &fine_b, [1, 4]),
        (&fine_a, &fine_b, [4, 4]),
    ] {
        let fine = Query::new(a, b).pairs().unwrap();
        let parents: BTreeSet<_> = fine
            .iter()
            .map(|&[i, j]| [i / parts[0], j / parts[1]])
            .collect();
        assert!(parents.iter().eq(&pairs), "{parts:?}");
    }
}

#[test]
fn exact_maps_of_meshes_change_no_answer() {
    let mut random = Random::new(94);
    let (a, b) = (even_soup(&mut random, 150), even_soup(&mut random, 120));
    let query = Query::new(&a, &b);
    let (classified, pairs_of_one) = (query.classified().unwrap(), SelfQuery::new(&a).pairs());
    let maps: [&dyn Fn(Vec3) -> Vec3; 5] = [
        &|p| p * 2.0_f32.powi(-140),
        &|p| p * 2.0_f32.powi(120),
        &|p| p + Vec3::new(1e6, -16_777_000.0, 64.0),
        &|p| Vec3::new(p.y, -p.z, p.x),
        &|p| p * Vec3::new(-1.0, -1.0, 0.5),
    ];
    for map in maps {
        let mapped = |mesh: &TriangleMesh| {
            let vertices = mesh.vertices().iter().map(|&v| map(v)).collect();
            TriangleMesh::new(vertices, mesh.triangles().to_vec()).unwrap()
        };
        let (a, b) = (mapped(&a), mapped(&b));
        assert_eq!(Query::new(&a, &b).classified().unwrap(), classified);
        assert_eq!(SelfQuery::new(&a).pairs(), pairs_of_one);
    }
}

/// A triangle cut into sixteen that lie in its plane up to rounding: codes with tolerances or plain f64 report pairs.
#[test]
fn a_subdivided_triangle_does_not_meet_itself() {
    for name in ["sphere", "cylinder"] {
        let mesh = subdivided(&subdivided(&gold_mesh(name)));
        // Midpoints are rounded, so neighbours may overlap by an ulp: exact arithmetic decides which.
        let corners = wide(&mesh);
        let found = SelfQuery::new(&exploded(&mesh)).pairs();
        for [i, j] in found {
            assert!(oracle(&corners[i as usize], &corners[j as usize]));
        }
        // Those with no common corner are all there.
        let first = &corners[..80];
        let pairs = SelfQuery::new(&mesh).pairs();
        for (i, a) in first.iter().enumerate() {
            for (j, b) in first.iter().enumerate().skip(i + 1) {
                if a.iter().all(|p| !b.contains(p)) {
                    let listed = pairs.binary_search(&[i as u32, j as u32]).is_ok();
                    assert_eq!(listed, oracle(a, b), "{i} {j}");
                }
            }
        }
    }
}

#[test]
fn meshes_of_no_and_of_one_triangle() {
    assert_eq!(TriangleMesh::new(vec![], vec![]), Err(MeshError::Empty));
    let one = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let collider = Collider::new(one.clone());
    assert_eq!(Query::new(&one, &collider).pairs().unwrap(), [[0, 0]]);
    assert_eq!(SelfQuery::new(&one).count(), 0);
    let mut other = Collider::new(gold_mesh("sphere"));
    other.replace(one.clone());
    assert_eq!(other.mesh(), &one);
    assert_eq!(other.degradation(), 1.0);
    assert_eq!(Query::new(&other, &one).count().unwrap(), 1);
}

/// A plane cuts every triangle of a terrain of ten million. It takes some seconds and 1.5 GB.
#[test]
fn ten_million_triangles() {
    let size = 2236_u32;
    let side = size + 1;
    let vertices = (0..side * side).map(|i| {
        let (x, y) = (i % side, i / side);
        Vec3::new(x as f32, y as f32, ((x + y) % 2) as f32)
    });
    let triangles = (0..size * size).flat_map(|i| {
        let corner = i / size * side + i % size;
        [
            [corner, corner + 1, corner + side],
            [corner + 1, corner + side, corner + side + 1],
        ]
    });
    let terrain = TriangleMesh::new(vertices.collect(), triangles.collect()).unwrap();
    assert_eq!(terrain.len(), 9_999_392);
    let plane = |z: f32| {
        let corners = [[-9e3, -9e3], [2e4, -9e3], [-9e3, 2e4]].map(|[x, y]| Vec3::new(x, y, z));
        TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap()
    };
    let terrain = Collider::on_threads(terrain, 0);
    for (z, hits) in [(0.5, 9_999_392), (1.5, 0)] {
        let plane = plane(z);
        let query = Query::new(&terrain, &plane).threads(0);
        assert_eq!(query.count().unwrap(), hits);
        assert_eq!(query.any().unwrap(), hits > 0);
    }
}
