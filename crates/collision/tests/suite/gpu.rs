//! The GPU against the CPU. Without an adapter nothing is tested, and the checks say so; where `CI` is set they fail.

use std::sync::OnceLock;

use glam::{DQuat, DVec3, Vec3};
use vertebra_collision::gpu::{Collider, Device, Error, Query};
use vertebra_collision::{Culling, Method, QueryError, TriangleMesh};
use vertebra_gpu::tests_are_left_out;
use vertebra_spatial::Pose;

use crate::support::{Random, cuboid, gold_mesh, step_f32};

/// The device of all tests.
pub(crate) fn device() -> Option<&'static Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    let open = || (!tests_are_left_out()).then(|| Device::auto().unwrap());
    DEVICE.get_or_init(open).as_ref()
}

/// A mesh of triangles with corners of their own.
pub(crate) fn soup(count: usize, mut corner: impl FnMut(usize) -> [Vec3; 3]) -> TriangleMesh {
    let vertices = (0..count).flat_map(&mut corner).collect();
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(vertices, triangles.collect()).unwrap()
}

/// Whether every answer is the CPU's; how many pairs met, and how many were left to the host.
fn agree(a: &TriangleMesh, b: &TriangleMesh, pose: Pose) -> [u64; 2] {
    let Some(device) = device() else {
        return [1; 2];
    };
    let cpu = vertebra_collision::Query::new(a, b)
        .pose_b(pose)
        .unwrap()
        .culling(Culling::Bvh);
    let [on_a, on_b] = [a, b].map(|mesh| Collider::new(device, mesh.clone()).unwrap());
    let gpu = Query::new(&on_a, &on_b).unwrap().pose_b(pose).unwrap();
    let pairs = cpu.pairs().unwrap();
    let gpu = gpu.culling(Culling::AllPairs);
    assert_eq!(gpu.pairs().unwrap(), pairs);
    let gpu = gpu.culling(Culling::Bvh);
    assert_eq!(gpu.pairs().unwrap(), pairs);
    assert_eq!(gpu.any().unwrap(), !pairs.is_empty());
    assert_eq!(gpu.count().unwrap(), pairs.len() as u64);
    assert_eq!(gpu.mask().unwrap(), cpu.mask().unwrap());
    assert_eq!(gpu.classified().unwrap(), cpu.classified().unwrap());
    assert_eq!(gpu.curves().unwrap(), cpu.curves().unwrap());
    if a.len() * b.len() < 100_000 {
        let matrix = gpu.matrix().unwrap();
        let set = |i: u32| (0..b.len() as u32 + 40).map(move |j| [i, j]);
        let set = (0..a.len() as u32).flat_map(set);
        let set: Vec<_> = set.filter(|&[i, j]| matrix.get(i, j)).collect();
        assert_eq!(set, pairs);
    }
    let statistics = gpu.statistics().unwrap();
    assert_eq!(statistics.hits, pairs.len() as u64);
    [statistics.hits, statistics.undecided]
}

pub(crate) fn pose(random: &mut Random, reach: f64) -> Pose {
    let [x, y, z, w] = [(); 4].map(|()| random.unit());
    let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
    let [x, y, z] = [(); 3].map(|()| reach * random.unit());
    Pose::new(rotation, DVec3::new(x, y, z))
}

#[test]
fn gold_meshes() {
    let mut random = Random::new(1);
    for (a, b) in [("sphere", "cylinder"), ("cup", "bowl"), ("cup", "spoon")] {
        let (a, b) = (gold_mesh(a), gold_mesh(b));
        let [hits, undecided] = agree(&a, &b, Pose::IDENTITY);
        assert!(hits > 200 || device().is_none());
        assert!(undecided <= hits / 10 + 1, "{undecided} of {hits}");
        agree(&a, &b, pose(&mut random, 0.2));
    }
}

#[test]
fn meshes_of_one_triangle() {
    let one = soup(1, |_| [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(agree(&one, &one, Pose::IDENTITY)[0], 1);
    let above = Pose::from_translation(DVec3::Z * 1e-30);
    agree(&one, &one, above);
}

/// Triangles that touch in points, along sides, in one plane, and of zero area.
#[test]
fn lattices_full_of_contacts() {
    let mut random = Random::new(2);
    for size in [2, 3, 6] {
        let mut lattice = |count: usize| {
            soup(count, |_| {
                random.lattice_triangle(0, size).map(|p| p.as_vec3())
            })
        };
        let (a, b) = (lattice(120), lattice(150));
        let [hits, _] = agree(&a, &b, Pose::IDENTITY);
        assert!(hits > 100 || device().is_none());
        // A quarter turn is exact.
        let turn = DQuat::from_xyzw(0.0, 0.0, 1.0, 1.0).normalize();
        agree(&a, &b, Pose::new(turn, DVec3::X * size as f64));
    }
}

#[test]
fn slivers_and_needles() {
    let mut random = Random::new(3);
    for thin in [1e-3, 1e-6, 1e-9_f32] {
        let mut slivers = |count: usize| {
            soup(count, |_| {
                let (p, q) = (random.point(), random.point());
                [p, q, 0.5 * (p + q) + random.point() * thin]
            })
        };
        let (a, b) = (slivers(200), slivers(220));
        agree(&a, &b, Pose::IDENTITY);
        agree(&a, &b, pose(&mut random, 0.5));
    }
}

/// Triangles of which a corner is a rounding away from a triangle of the other mesh, or an edge from an edge, where they
/// stand and posed: signs that no arithmetic in `f32` can tell, and many more that it barely can.
#[test]
fn a_rounding_from_touching() {
    let mut random = Random::new(10);
    for (turned, far) in [(false, 0.0), (true, 0.3), (true, 20.0)] {
        let pose = if turned {
            pose(&mut random, far)
        } else {
            Pose::IDENTITY
        };
        let back = pose.inverse();
        let a = soup(250, |_| [(); 3].map(|()| random.point()));
        let mut random = Random::new(11);
        let b = soup(500, |i| {
            let [p, q, r] = a.triangle(i / 2).map(|v| v.as_dvec3());
            let (u, v) = (random.unit().abs(), random.unit().abs());
            let ends = if i % 2 == 0 {
                let inside = p + (q - p) * u * 0.5 + (r - p) * v * 0.5;
                [
                    inside,
                    inside + random.point().as_dvec3(),
                    random.point().as_dvec3(),
                ]
            } else {
                let (edge, along) = (p + (q - p) * u, random.point().as_dvec3());
                [
                    edge - along * v,
                    edge + along * (1.1 - v),
                    edge + random.point().as_dvec3(),
                ]
            };
            ends.map(|end| {
                let end = back.transform_point(end).as_vec3();
                let step = |x: f32, steps| step_f32(f64::from(x), steps) as f32;
                Vec3::from(end.to_array().map(|x| step(x, random.int(-1, 1))))
            })
        });
        let [hits, undecided] = agree(&a, &b, pose);
        assert!(
            hits > 500 && undecided > 100 || device().is_none(),
            "{hits} {undecided}"
        );
    }
}

/// The same triangles in other units of length, and far from the origin.
#[test]
fn any_size_and_place() {
    let mut random = Random::new(4);
    for exponent in [-140, -126, -100, -60, 0, 60, 100, 125] {
        let unit = 2.0_f32.powi(exponent / 2) * 2.0_f32.powi(exponent - exponent / 2);
        let mut triangles = |count: usize| {
            soup(count, |_| {
                let center = random.point();
                [(); 3].map(|()| (center + 0.4 * random.point()) * unit)
            })
        };
        let (a, b) = (triangles(100), triangles(120));
        let [hits, _] = agree(&a, &b, Pose::IDENTITY);
        assert!(hits > 50 || device().is_none(), "2^{exponent}: {hits}");
        agree(&a, &b, pose(&mut random, 0.3 * f64::from(unit)));
    }
    for offset in [1e2, 1e5_f32] {
        let shift = |mesh: &TriangleMesh| {
            let vertices = mesh.vertices().iter().map(|v| *v + Vec3::splat(offset));
            TriangleMesh::new(vertices.collect(), mesh.triangles().to_vec()).unwrap()
        };
        let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
        let [hits, _] = agree(&shift(&a), &shift(&b), Pose::IDENTITY);
        assert!(hits > 100 || device().is_none());
        // Of a mesh that has come back from afar by its pose, undecided pairs are more, but no answer is wrong.
        agree(
            &a,
            &shift(&b),
            Pose::from_translation(DVec3::splat(-f64::from(offset))),
        );
    }
}

/// Faces upon faces: everything that matters is zero.
#[test]
fn stacked_boxes() {
    let unit = cuboid(Vec3::ZERO, Vec3::ONE);
    for shift in [Vec3::X, Vec3::ONE, Vec3::new(1.0, 0.5, 0.25), Vec3::ZERO] {
        let other = cuboid(shift, shift + Vec3::ONE);
        let [hits, _] = agree(&unit, &other, Pose::IDENTITY);
        assert!(hits > 0);
        agree(&unit, &unit, Pose::from_translation(shift.as_dvec3()));
    }
}

/// Queues that are too short at first: every triangle meets every other, and most are undecided.
#[test]
fn queues_grow() {
    let fan = |turn: f32| {
        soup(300, |i| {
            let angle = turn + i as f32;
            [
                Vec3::NEG_Z,
                Vec3::Z,
                Vec3::new(angle.cos(), angle.sin(), 0.0),
            ]
        })
    };
    let [hits, undecided] = agree(&fan(0.0), &fan(0.5), Pose::IDENTITY);
    assert_eq!(hits, if device().is_some() { 90_000 } else { 1 });
    assert!(undecided > 300 || device().is_none());
}

/// Whether the baseline rounds nothing about two triangles of small integers: whether every quotient is a number of few
/// bits.
fn is_exact([a, b]: [[Vec3; 3]; 2]) -> bool {
    let whole = |t: [Vec3; 3]| t.map(|p| p.to_array().map(|x| x as i64));
    let (a, b) = (whole(a), whole(b));
    let minus = |p: [i64; 3], q: [i64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let cross = |u: [i64; 3], v: [i64; 3]| {
        [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ]
    };
    let dot = |u: [i64; 3], v: [i64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let normal = |t: [[i64; 3]; 3]| cross(minus(t[1], t[0]), minus(t[2], t[0]));
    let exact = |t: [[i64; 3]; 3], plane: [[i64; 3]; 3]| {
        let d = t.map(|p| dot(normal(plane), minus(p, plane[0])));
        (0..3).all(|i| {
            let k = (i + 1) % 3;
            let denominator = d[i] - d[k];
            // In units of a 256th.
            denominator == 0 || [d[i], d[k]].iter().all(|d| 256 * d % denominator == 0)
        })
    };
    exact(a, b) && exact(b, a)
}

/// Where no operation is rounded the baseline is that of the CPU.
#[test]
fn moller_on_small_integers() {
    let Some(device) = device() else { return };
    let mut random = Random::new(8);
    for size in [1, 2, 4] {
        let mut lattice = |count: usize| {
            soup(count, |_| {
                random.lattice_triangle(0, size).map(|p| p.as_vec3())
            })
        };
        let meshes = [lattice(150), lattice(600)];
        let cpu = vertebra_collision::Query::new(&meshes[0], &meshes[1]).method(Method::MOLLER);
        let expected = cpu.pairs().unwrap();
        let [a, b] = [0, 1].map(|k| Collider::new(device, meshes[k].clone()).unwrap());
        let gpu = Query::new(&a, &b).unwrap().method(Method::MOLLER).unwrap();
        let found = gpu.pairs().unwrap();
        assert_eq!(gpu.count().unwrap(), found.len() as u64);
        assert!(matches!(
            gpu.classified(),
            Err(Error::Query(QueryError::NotExact))
        ));
        let exact = |&[i, j]: &[u32; 2]| {
            is_exact([
                meshes[0].triangle(i as usize),
                meshes[1].triangle(j as usize),
            ])
        };
        let only_exact =
            |pairs: &[[u32; 2]]| -> Vec<[u32; 2]> { pairs.iter().copied().filter(exact).collect() };
        assert_eq!(only_exact(&found), only_exact(&expected));
        assert!(only_exact(&found).len() * 8 > found.len());
        // Elsewhere the last bit of a quotient decides whether intervals touch.
        let differ = found
            .iter()
            .filter(|pair| expected.binary_search(pair).is_err())
            .count();
        assert!(differ * 50 <= found.len(), "{differ} of {}", found.len());
    }
    let tile = Collider::new(device, cuboid(Vec3::ZERO, Vec3::ONE)).unwrap();
    let wrong = Query::new(&tile, &tile)
        .unwrap()
        .method(Method::Moller { epsilon: f32::NAN });
    assert!(matches!(
        wrong.err(),
        Some(Error::Query(QueryError::InvalidEpsilon { .. }))
    ));
}
