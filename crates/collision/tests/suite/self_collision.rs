//! A mesh against itself: which neighbours count, against exact arithmetic over all pairs.

use crate::classes::meeting_points;
use crate::support::{
    Exact, Random, Triangle, cross, cuboid, dot, exact, exploded, gold_mesh, minus, wide,
};
use glam::{DVec3, Vec3};
use num_traits::{Signed, Zero};
use vertebra_collision::{Collider, Culling, SelfQuery, TriangleMesh};

/// Whether two triangles meet in a point that is not in the hull of their common corners; or are the same.
fn expected(a: &Triangle, b: &Triangle) -> bool {
    let mut common: Vec<DVec3> = Vec::new();
    for p in a {
        if b.contains(p) && !common.contains(p) {
            common.push(*p);
        }
    }
    let common: Vec<Exact> = common.into_iter().map(exact).collect();
    let points = meeting_points(a, b);
    let within = |x: &Exact, [p, q]: [&Exact; 2]| {
        let (u, v) = (minus(x, p), minus(x, q));
        cross(&u, &v).iter().all(Zero::is_zero) && !dot(&u, &v).is_positive()
    };
    let in_hull = |x: &Exact| {
        common
            .iter()
            .any(|p| common.iter().any(|q| within(x, [p, q])))
    };
    let area = common.len() == 3 && {
        let n = cross(
            &minus(&common[1], &common[0]),
            &minus(&common[2], &common[0]),
        );
        n.iter().any(|x| !x.is_zero())
    };
    area || !points.iter().all(|(x, _)| in_hull(x))
}

fn check(mesh: &TriangleMesh) -> usize {
    let triangles = wide(mesh);
    let mut pairs = Vec::new();
    for (j, b) in (0..).zip(&triangles) {
        for (i, a) in (0..j).zip(&triangles) {
            if expected(a, b) {
                pairs.push([i, j]);
            }
        }
    }
    pairs.sort_unstable();
    let mut mask = vec![false; mesh.len()];
    for i in pairs.iter().flatten() {
        mask[*i as usize] = true;
    }
    let collider = Collider::new(mesh.clone());
    for query in [SelfQuery::new(mesh), SelfQuery::new(&collider)] {
        let cullings = [Culling::Auto, Culling::AllPairs, Culling::Bvh];
        for (threads, culling) in [1, 2, 0].into_iter().zip(cullings) {
            let query = query.clone().threads(threads).culling(culling);
            assert_eq!(query.statistics().hits, pairs.len() as u64);
            assert_eq!(query.pairs(), pairs);
            assert_eq!(query.count(), pairs.len() as u64);
            assert_eq!(query.any(), !pairs.is_empty());
            assert_eq!(query.mask(), mask);
        }
    }
    // Whose vertex a corner is does not matter.
    assert_eq!(SelfQuery::new(&exploded(mesh)).pairs(), pairs);
    pairs.len()
}

/// Random triangles over few vertices: neighbours of all kinds, folded, piercing, in one plane, of zero area, repeated.
#[test]
fn lattice_neighbours() {
    let mut random = Random::new(51);
    let mut hits = 0;
    for size in [1, 2, 3] {
        for _ in 0..6 {
            let vertices: Vec<Vec3> = (0..12).map(|_| random.lattice(0, size).as_vec3()).collect();
            let corner = |random: &mut Random| random.int(0, 11) as u32;
            let triangles = (0..24).map(|_| [(); 3].map(|()| corner(&mut random)));
            hits += check(&TriangleMesh::new(vertices, triangles.collect()).unwrap());
        }
    }
    assert!(hits > 500, "{hits}");
}

/// Neighbours folded flat, an ulp from flat, and pierced through a common corner.
#[test]
fn folds() {
    let (o, x, y) = (Vec3::ZERO, Vec3::X, Vec3::Y);
    let flap =
        |apex: Vec3| TriangleMesh::new(vec![o, x, y, apex], vec![[0, 1, 2], [0, 1, 3]]).unwrap();
    let step = f32::EPSILON;
    for (apex, hits) in [
        (Vec3::new(0.3, 0.4, 0.0), 1),
        (Vec3::new(0.3, 0.4, step), 0),
        (Vec3::new(0.3, 0.4, -f32::from_bits(1)), 0),
        (Vec3::new(0.3, -0.4, 0.0), 0),
        (Vec3::new(-5.0, 1e-30, 0.0), 1),
        (y, 1),
        (x * 0.5, 0),
        (x * 2.0, 0),
    ] {
        assert_eq!(check(&flap(apex)), hits, "{apex}");
    }
    // One corner in common.
    let fan = |p: Vec3, q: Vec3| {
        TriangleMesh::new(vec![o, x, y, p, q], vec![[0, 1, 2], [0, 3, 4]]).unwrap()
    };
    let (up, down) = (Vec3::new(0.25, 0.25, 1.0), Vec3::new(0.25, 0.25, -1.0));
    for (p, q, hits) in [
        (up, down, 1),
        (up, up + x, 0),
        (up - x, down - x, 0),
        (up, Vec3::new(0.75, 0.75, step), 0),
        (up, Vec3::new(0.75, 0.75, 0.0), 1),
        (-x, -y, 0),
        (x * 2.0, -y, 1),
        (x * 0.5, y * 0.5, 1),
    ] {
        assert_eq!(check(&fan(p, q)), hits, "{p} {q}");
    }
}

/// Meshes that do not meet themselves, with vertices in common or not, and one that does.
#[test]
fn whole_meshes() {
    for name in ["sphere", "cylinder"] {
        let mesh = gold_mesh(name);
        assert_eq!(SelfQuery::new(&mesh).pairs(), [[0; 2]; 0], "{name}");
        assert!(!SelfQuery::new(&exploded(&mesh)).any());
    }
    assert_eq!(check(&cuboid(Vec3::ZERO, Vec3::ONE)), 0);
    // A sphere with one vertex pulled through to the other side.
    let mut sphere = gold_mesh("sphere");
    let mut vertices = sphere.vertices().to_vec();
    vertices[200] *= -1.5;
    sphere.set_vertices(vertices).unwrap();
    let pairs = SelfQuery::new(&sphere).pairs();
    assert!(pairs.len() > 10);
    let corners = wide(&sphere);
    for &[i, j] in &pairs {
        assert!(expected(&corners[i as usize], &corners[j as usize]));
    }
}

/// Places are those of the vertices as they are now, also in a mesh that keeps them.
#[test]
fn moved_vertices_have_new_places() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let apart = [Vec3::NEG_X, Vec3::NEG_Y, Vec3::ZERO];
    let vertices = |other: [Vec3; 3]| corners.into_iter().chain(other).collect::<Vec<_>>();
    let mesh = TriangleMesh::new(vertices(apart), vec![[0, 1, 2], [3, 4, 5]]).unwrap();
    let mut collider = Collider::new(mesh);
    assert!(!SelfQuery::new(&collider).any());
    // The corner in common becomes a corner on a side.
    let slid = apart.map(|p| p + Vec3::X * 0.5);
    collider.set_vertices(vertices(slid)).unwrap();
    assert_eq!(SelfQuery::new(&collider).pairs(), [[0, 1]]);
    collider.set_vertices(vertices(apart)).unwrap();
    assert!(!SelfQuery::new(&collider).any());
}

/// Flat neighbours in planes of all directions, where only the line or the angle between them tells them apart, and
/// a mesh large enough for several tasks and levels.
#[test]
fn flat_sheets() {
    let normals = [
        Vec3::Z,
        Vec3::X,
        Vec3::Y,
        Vec3::new(1.0, -2.0, 4.0),
        Vec3::new(-3.0, 1.0, 1.0),
    ];
    for normal in normals {
        // Small integers: coplanar exactly.
        let (u, v) = if normal.x == 0.0 && normal.y == 0.0 {
            (Vec3::X, Vec3::Y)
        } else {
            let u = Vec3::new(-normal.y, normal.x, 0.0);
            (u, normal.cross(u))
        };
        let n = 9_u32;
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let place = |i: u32, j: u32| u * i as f32 + v * j as f32;
        let vertices = (0..=n).flat_map(|i| (0..=n).map(move |j| place(i, j)));
        let mut vertices: Vec<Vec3> = vertices.collect();
        let triangles = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let triangles = triangles.flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)];
            [[a, b, d], [a, d, c]]
        });
        let triangles: Vec<[u32; 3]> = triangles.collect();
        let mesh = TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap();
        assert_eq!(SelfQuery::new(&mesh).pairs(), [[0; 2]; 0], "{normal}");
        // A corner drawn over its neighbours.
        vertices[at(4, 4) as usize] = place(6, 5);
        let folded = TriangleMesh::new(vertices, triangles).unwrap();
        let pairs = SelfQuery::new(&folded).pairs();
        let corners = wide(&folded);
        let near = (0_u32..).zip(&corners).filter(|(_, t)| {
            let spread = |p: &DVec3| {
                let steps = |d: Vec3| p.dot(d.as_dvec3()) / f64::from(d.length_squared());
                steps(u).min(steps(v)) > 1.9 && steps(u).max(steps(v)) < 7.1
            };
            t.iter().all(spread)
        });
        let near: Vec<_> = near.collect();
        let mut checked = 0;
        for (k, (i, a)) in near.iter().enumerate() {
            for (j, b) in &near[k + 1..] {
                assert_eq!(pairs.binary_search(&[*i, *j]).is_ok(), expected(a, b));
                checked += usize::from(expected(a, b));
            }
        }
        assert_eq!(checked, pairs.len(), "{normal}");
        assert!(checked > 10, "{normal}");
        for threads in [2, 3, 8] {
            assert_eq!(SelfQuery::new(&folded).threads(threads).pairs(), pairs);
        }
    }
}
