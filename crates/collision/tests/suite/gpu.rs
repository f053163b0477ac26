//! The GPU against the CPU. Without an adapter nothing is tested, and the checks say so; where `CI` is set they fail.

use std::sync::OnceLock;

use glam::{DQuat, DVec3, Vec3};
use vertebra_collision::gpu::{Collider, Device, Query};
use vertebra_collision::{Culling, TriangleMesh};
use vertebra_spatial::Pose;

use crate::support::{Random, cuboid, gold_mesh};

/// The device of all tests.
pub(crate) fn device() -> Option<&'static Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    let open = || match Device::auto() {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("CI").is_none() => {
            eprintln!("nothing is tested on a GPU: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    };
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
