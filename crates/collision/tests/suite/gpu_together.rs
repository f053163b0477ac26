//! Many poses, many bodies, and one mesh with itself, on the GPU against the CPU.

use glam::{DQuat, DVec3, Vec3};
use vertebra_collision::gpu::{Collider, Error, Links, Query, SelfQuery};
use vertebra_collision::{Culling, PoseProblem, QueryError, Side, TriangleMesh};
use vertebra_spatial::Pose;

use crate::gpu::{device, pose, soup};
use crate::support::{Random, exploded, gold_mesh};

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
    // Down trees of which nodes hold parts of two bodies.
    let descending = Links::new(device, &bodies).unwrap().culling(Culling::Bvh);
    let descending = descending.ignore(0, 1).unwrap();
    let at = descending.at(&configurations).unwrap();
    assert_eq!(at.pairs().unwrap(), expected);
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

/// A list of one mesh that is long enough to be sorted on the device, the lesser triangle first.
#[test]
fn long_lists_of_one_mesh_are_sorted_on_the_device() {
    let Some(device) = device() else { return };
    let mut random = Random::new(12);
    let lattice = soup(450, |_| random.lattice_triangle(0, 3).map(|p| p.as_vec3()));
    let expected = vertebra_collision::SelfQuery::new(&lattice).pairs();
    assert!(expected.len() > 20_000);
    let collider = Collider::new(device, lattice).unwrap();
    for culling in [Culling::AllPairs, Culling::Bvh] {
        let found = SelfQuery::new(&collider).culling(culling).pairs().unwrap();
        assert!(found == expected);
    }
}

/// So many pairs that touch that the device settles them in integers: corners on sides and in each other, at places of all
/// sizes, in one plane and not; what they span decides who does it.
#[test]
fn many_contacts() {
    let Some(device) = device() else { return };
    let mut random = Random::new(14);
    for (case, unit) in [1.0, 1.1e-3].into_iter().enumerate() {
        let mut corners = [Vec::new(), Vec::new()];
        for i in 0..7000_u16 {
            // Powers of two along y, so that sums of corners there are not rounded; whole numbers elsewhere.
            let cell = Vec3::new(f32::from(i % 80), 0.0, f32::from(i / 80)) * 16.0;
            let scale = 2.0_f32.powi(i32::from(i % 40) - 20);
            let mut corner = || {
                let [x, y, z] = [(); 3].map(|()| random.int(0, 12) as f32);
                (cell + Vec3::new(x, y * scale, z)) * unit
            };
            let [p, q, r, s, t] = [(); 5].map(|()| corner());
            corners[0].push([p, q, r]);
            corners[1].push(match i % 3 {
                0 => [0.5 * (p + q), s, t],
                1 => [s, q, t],
                _ => [t, s, 0.5 * (q + r)],
            });
        }
        let [a, b] = corners.map(|corners| soup(corners.len(), |i| corners[i]));
        let cpu = vertebra_collision::Query::new(&a, &b).culling(Culling::Bvh);
        let expected = cpu.pairs().unwrap();
        let [on_a, on_b] = [&a, &b].map(|mesh| Collider::new(device, mesh.clone()).unwrap());
        let gpu = Query::new(&on_a, &on_b).unwrap();
        assert!(gpu.pairs().unwrap() == expected, "case {case}");
        let statistics = gpu.statistics().unwrap();
        let (all, on_host) = (statistics.undecided, statistics.on_host);
        assert!(all > 4096, "case {case}: {all}");
        assert!(on_host < all / 2, "case {case}: {on_host} of {all}");
        if case == 0 {
            assert!(gpu.classified().unwrap() == cpu.classified().unwrap());
            assert_eq!(gpu.count().unwrap(), expected.len() as u64);
            assert_eq!(gpu.mask().unwrap(), cpu.mask().unwrap());
        }
        // Posed points are sums that are rounded, which integers do not know.
        let turn = Pose::new(
            DQuat::from_xyzw(0.0, 1.0, 0.0, 1.0).normalize(),
            DVec3::ZERO,
        );
        let gpu = gpu.pose_b(turn).unwrap();
        let cpu = cpu.pose_b(turn).unwrap();
        assert!(gpu.pairs().unwrap() == cpu.pairs().unwrap());
        // One mesh: neighbours are no pairs, and what touches by accident is.
        let joined: Vec<[Vec3; 3]> = (0..a.len())
            .flat_map(|i| [a.triangle(i), b.triangle(i)])
            .collect();
        let joined = soup(joined.len(), |i| joined[i]);
        let expected = vertebra_collision::SelfQuery::new(&joined).pairs();
        let collider = Collider::new(device, joined).unwrap();
        assert!(SelfQuery::new(&collider).pairs().unwrap() == expected);
    }
}
