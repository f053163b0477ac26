//! The GPU against the CPU. Without an adapter nothing is tested, and the checks say so; where `CI` is set they fail.

use std::sync::OnceLock;

use glam::{DQuat, DVec3, Vec3};
use vertebra_collision::gpu::{Collider, Device, Error, Links, Query, SelfQuery};
use vertebra_collision::{Culling, Method, PoseProblem, QueryError, Side, TriangleMesh};
use vertebra_gpu::tests_are_left_out;
use vertebra_spatial::Pose;

use crate::support::{Random, cuboid, exploded, gold_mesh, step_f32};

/// The device of all tests.
pub(crate) fn device() -> Option<&'static Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    let open = || (!tests_are_left_out()).then(|| Device::auto().unwrap());
    DEVICE.get_or_init(open).as_ref()
}

/// A mesh of triangles with corners of their own.
fn soup(count: usize, mut corner: impl FnMut(usize) -> [Vec3; 3]) -> TriangleMesh {
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

fn pose(random: &mut Random, reach: f64) -> Pose {
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

/// Many poses in one run, of meshes far apart and in each other.
#[test]
fn many_poses() {
    let Some(device) = device() else { return };
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let mut random = Random::new(5);
    let poses: Vec<Pose> = (0..40).map(|_| pose(&mut random, 1.5)).collect();
    let cpu = vertebra_collision::Query::new(&a, &b);
    let expected = cpu.at_poses(&poses, |query| query.pairs()).unwrap();
    let [a, b] = [a, b].map(|mesh| Collider::new(device, mesh).unwrap());
    for culling in [Culling::AllPairs, Culling::Bvh] {
        let query = Query::new(&a, &b).unwrap().culling(culling);
        let at = query.at_poses(&poses).unwrap();
        assert_eq!(at.pairs().unwrap(), expected);
        let counts: Vec<u64> = expected.iter().map(|pairs| pairs.len() as u64).collect();
        assert_eq!(at.count().unwrap(), counts);
        let any: Vec<bool> = expected.iter().map(|pairs| !pairs.is_empty()).collect();
        assert_eq!(at.any().unwrap(), any);
        assert!(any.contains(&true) && any.contains(&false));
        assert!(query.at_poses(&[]).unwrap().pairs().unwrap().is_empty());
    }
    let bad = [Pose::IDENTITY, Pose::from_translation(DVec3::NAN)];
    let refused = Query::new(&a, &b).unwrap().at_poses(&bad).err();
    assert!(matches!(
        refused,
        Some(Error::Query(QueryError::AtPose { index: 1, .. }))
    ));
}

/// Bodies of which some are one shape, posed from the host, and from a buffer on the device.
#[test]
fn links() {
    let Some(device) = device() else { return };
    let (sphere, cylinder) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let tile = soup(3, |i| {
        [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p + Vec3::splat(i as f32))
    });
    let bodies = [&sphere, &cylinder, &sphere, &tile];
    let colliders = bodies.map(|mesh| vertebra_collision::Collider::new(mesh.clone()));
    let on_cpu = vertebra_collision::Links::new(&colliders)
        .ignore(0, 1)
        .unwrap();
    let on_gpu = Links::new(device, &bodies).unwrap().ignore(1, 0).unwrap();
    assert_eq!(on_gpu.pairs(), on_cpu.pairs());
    // Numbers of f32, so that a buffer holds the same poses.
    let mut random = Random::new(6);
    let mut narrow = || {
        let Pose {
            rotation,
            translation,
        } = pose(&mut random, 1.2);
        let rotation = rotation.to_array().map(|x| f64::from(x as f32));
        Pose::new(
            DQuat::from_array(rotation),
            translation.as_vec3().as_dvec3(),
        )
    };
    let configurations: Vec<[Pose; 4]> = (0..12).map(|_| [(); 4].map(|()| narrow())).collect();
    let expected = on_cpu.ask(&configurations, |query| query.pairs()).unwrap();
    let hits = expected.iter().flatten().filter(|pairs| !pairs.is_empty());
    assert!(hits.count() > 20);
    assert_eq!(
        on_gpu.at(&configurations).unwrap().pairs().unwrap(),
        expected
    );
    let words = |configurations: &[[Pose; 4]]| -> Vec<f32> {
        let pose = |pose: &Pose| {
            let [x, y, z, w] = pose.rotation.to_array().map(|x| x as f32);
            let [a, b, c] = pose.translation.to_array().map(|x| x as f32);
            [x, y, z, w, a, b, c, 0.0]
        };
        configurations.iter().flatten().flat_map(pose).collect()
    };
    let poses = device
        .buffer_from("poses", &words(&configurations))
        .unwrap();
    let following = on_gpu.following(&poses).unwrap();
    assert_eq!(following.now().pairs().unwrap(), expected);
    // The bodies have moved on.
    let mut later = configurations;
    later.reverse();
    poses.write(&words(&later)).unwrap();
    let expected = on_cpu.ask(&later, |query| query.count()).unwrap();
    assert_eq!(following.now().count().unwrap(), expected);
    let any = on_cpu.ask(&later, |query| query.any()).unwrap();
    assert_eq!(following.now().any().unwrap(), any);
    let mut bad = words(&later);
    bad[8 * 7] = f32::NAN;
    poses.write(&bad).unwrap();
    let problem = QueryError::InvalidPose {
        mesh: Side::B,
        problem: PoseProblem::NotFinite,
    };
    let expected = QueryError::AtPose {
        index: 7,
        error: Box::new(problem),
    };
    assert_eq!(following.now().any(), Err(Error::Query(expected)));
    poses.write(&words(&later)).unwrap();
    assert_eq!(following.now().any().unwrap(), any);
    let short = device.buffer::<f32>("short", 8 * 9).unwrap();
    assert!(matches!(
        on_gpu.following(&short).err(),
        Some(Error::Query(QueryError::PoseCount {
            configuration: 2,
            expected: 4,
            found: 1
        }))
    ));
}

/// Meshes that pass through themselves, with and without vertices in common, and others that only touch where they
/// should.
#[test]
fn self_collision() {
    let Some(device) = device() else { return };
    let mut random = Random::new(7);
    let lattice = soup(120, |_| random.lattice_triangle(0, 3).map(|p| p.as_vec3()));
    let grid = |height: fn(f32, f32) -> f32| {
        let vertices = (0..144).map(|i| {
            let (x, y) = ((i % 12) as f32, (i / 12) as f32);
            Vec3::new(x, y, height(x, y))
        });
        let square = |i: u32| {
            let at = i / 11 * 12 + i % 11;
            [[at, at + 1, at + 13], [at, at + 13, at + 12]]
        };
        TriangleMesh::new(vertices.collect(), (0..121).flat_map(square).collect()).unwrap()
    };
    let flat = grid(|_, _| 0.0);
    let saddle = grid(|x, y| 0.125 * x * y);
    let sphere = gold_mesh("sphere");
    let moved = |by: f32| sphere.vertices().iter().map(move |v| *v + Vec3::splat(by));
    let two = TriangleMesh::new(moved(0.0).chain(moved(0.5)).collect(), {
        let first = sphere.vertices().len() as u32;
        let second = sphere.triangles().iter().map(|t| t.map(|v| v + first));
        sphere.triangles().iter().copied().chain(second).collect()
    })
    .unwrap();
    let parts = exploded(&saddle);
    for (name, mesh, most_undecided) in [
        ("lattice", &lattice, u64::MAX),
        ("flat", &flat, 10),
        ("saddle", &saddle, 10),
        ("saddle in parts", &parts, 10),
        ("sphere", &sphere, 200),
        ("two spheres", &two, 600),
    ] {
        let cpu = vertebra_collision::SelfQuery::new(mesh);
        let pairs = cpu.pairs();
        let collider = Collider::new(device, mesh.clone()).unwrap();
        for culling in [Culling::AllPairs, Culling::Bvh] {
            let gpu = SelfQuery::new(&collider).culling(culling);
            assert_eq!(gpu.pairs().unwrap(), pairs, "{name}");
            assert_eq!(gpu.any().unwrap(), !pairs.is_empty());
            assert_eq!(gpu.count().unwrap(), pairs.len() as u64);
            assert_eq!(gpu.mask().unwrap(), cpu.mask());
            assert_eq!(gpu.curves().unwrap(), cpu.curves());
            assert_eq!(gpu.classified().unwrap(), cpu.classified());
            let undecided = gpu.statistics().unwrap().undecided;
            assert!(undecided <= most_undecided, "{name}: {undecided}");
        }
    }
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

/// Vertices written by the host and on the device; what is not finite is found, and nothing stays of it.
#[test]
fn moved_vertices() {
    let Some(device) = device() else { return };
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let on_a = Collider::new(device, a.clone()).unwrap();
    let mut on_b = Collider::new(device, b.clone()).unwrap();
    let query = Query::new(&on_a, &on_b).unwrap();
    let pushed: Vec<Vec3> = b.vertices().iter().map(|v| *v + Vec3::X * 0.25).collect();
    let moved = TriangleMesh::new(pushed.clone(), b.triangles().to_vec()).unwrap();
    let expected = vertebra_collision::Query::new(&a, &moved).pairs().unwrap();
    on_b.set_vertices(pushed).unwrap();
    assert_eq!(query.pairs().unwrap(), expected);
    on_b.rebuild().unwrap();
    assert_eq!(query.pairs().unwrap(), expected);
    assert!(on_b.set_vertices(vec![Vec3::ZERO]).is_err());
    assert_eq!(query.pairs().unwrap(), expected);
    let mut bad: Vec<f32> = b.vertices().iter().flat_map(Vec3::to_array).collect();
    let good = bad.clone();
    bad[100] = f32::NEG_INFINITY;
    on_b.vertices().write(&bad).unwrap();
    on_b.refit().unwrap();
    let error = vertebra_collision::MeshError::NonFiniteVertex { vertex: 33 };
    for _ in 0..2 {
        assert_eq!(query.pairs(), Err(Error::Mesh(error.clone())));
    }
    on_b.vertices().write(&good).unwrap();
    on_b.refit().unwrap();
    let expected = vertebra_collision::Query::new(&a, &b).pairs().unwrap();
    assert_eq!(query.pairs().unwrap(), expected);
}

/// Triangles that have been mixed up are sorted again.
#[test]
fn degradation() {
    let Some(device) = device() else { return };
    let mesh = gold_mesh("cup");
    let vertices = mesh.vertices().to_vec();
    let mut collider = Collider::new(device, mesh).unwrap();
    assert_eq!(collider.degradation().unwrap(), 1.0);
    // A common motion and stretching change little.
    let stretched = vertices
        .iter()
        .map(|v| *v * Vec3::new(1.0, 1.0, 2.0) + Vec3::ONE);
    collider.set_vertices(stretched.collect()).unwrap();
    assert!((0.7..1.4).contains(&collider.degradation().unwrap()));
    let mut mixed = vertices.clone();
    let mut random = Random::new(9);
    for i in (1..mixed.len()).rev() {
        mixed.swap(i, random.int(0, i as i64) as usize);
    }
    collider.set_vertices(mixed).unwrap();
    assert!(collider.degradation().unwrap() > 1.5);
    collider.set_vertices(vertices).unwrap();
    assert!((collider.degradation().unwrap() - 1.0).abs() < 1e-6);
    collider.rebuild().unwrap();
    assert_eq!(collider.degradation().unwrap(), 1.0);
    let one = soup(1, |_| [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(
        Collider::new(device, one).unwrap().degradation().unwrap(),
        1.0
    );
}
