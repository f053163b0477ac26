//! Meshes that move, what goes wrong on a GPU, and who computes.

use glam::{DVec3, Vec3};
use vertebra_collision::gpu::{
    Collider, Device, Error, Links, MeshPair, Processor, Query, Reason, SelfQuery,
};
use vertebra_collision::{Culling, MeshError, QueryError, Side, TriangleMesh};
use vertebra_gpu::Options;
use vertebra_gpu::wgpu::Limits;
use vertebra_spatial::Pose;

use crate::gpu::{device, pose, soup};
use crate::support::{Random, gold_mesh};

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
    let error = MeshError::NonFiniteVertex { vertex: 33 };
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

/// Triangles about one axis, of which each meets each of another such fan.
fn fan(count: usize, turn: f32) -> TriangleMesh {
    soup(count, |i| {
        let angle = turn + i as f32;
        [
            Vec3::NEG_Z,
            Vec3::Z,
            Vec3::new(angle.cos(), angle.sin(), 0.0),
        ]
    })
}

/// A device whose buffers hold next to nothing.
fn small_device(bytes: u64) -> Option<Device> {
    device()?;
    let limits = Limits {
        max_storage_buffers_per_shader_stage: 8,
        max_storage_buffer_binding_size: bytes,
        ..Limits::downlevel_defaults()
    };
    let options = Options {
        limits,
        exact_limits: true,
        ..Options::default()
    };
    Some(Device::open(options).unwrap())
}

/// Queues that no buffer holds: the question is asked in parts, and nothing is lost.
#[test]
fn queues_beyond_the_device() {
    let Some(device) = small_device(1 << 16) else {
        return;
    };
    let (a, b) = (fan(150, 0.0), fan(120, 0.5));
    let expected = vertebra_collision::Query::new(&a, &b).pairs().unwrap();
    assert_eq!(expected.len(), 150 * 120);
    let [a, b] = [a, b].map(|mesh| Collider::new(&device, mesh).unwrap());
    for culling in [Culling::AllPairs, Culling::Bvh] {
        let query = Query::new(&a, &b).unwrap().culling(culling);
        assert!(query.pairs().unwrap() == expected, "{culling:?}");
        assert_eq!(query.count().unwrap(), expected.len() as u64);
        let classes = query.classified().unwrap();
        assert_eq!(classes.len(), expected.len());
    }
    let itself = SelfQuery::new(&a);
    assert_eq!(
        itself.pairs().unwrap(),
        vertebra_collision::SelfQuery::new(a.mesh()).pairs()
    );
}

/// A mesh that does not fit is refused by name, and the device goes on.
#[test]
fn meshes_beyond_the_device() {
    let Some(device) = small_device(1 << 16) else {
        return;
    };
    let large = soup(2000, |i| {
        [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p + Vec3::splat(i as f32))
    });
    let error = Collider::new(&device, large).unwrap_err();
    let Error::TooLarge {
        element,
        count,
        fits,
        limit,
        ..
    } = error
    else {
        unreachable!("{error:?}");
    };
    assert_eq!((element, count), ("vertices", 6000));
    assert_eq!(limit, "max_storage_buffer_binding_size");
    assert!(fits < 6000);
    let small = Collider::new(&device, fan(8, 0.0)).unwrap();
    assert_eq!(Query::new(&small, &small).unwrap().count().unwrap(), 64);
}

/// A device that is lost is an error of each call; another goes on.
#[test]
fn lost_devices() {
    let Some(device) = device() else { return };
    let other = device.reopen().unwrap();
    let mut lost = Collider::new(&other, fan(8, 0.0)).unwrap();
    let query = Query::new(&lost, &lost).unwrap();
    assert_eq!(query.count().unwrap(), 64);
    let kept = Collider::new(device, fan(8, 0.0)).unwrap();
    assert_eq!(Query::new(&kept, &lost).err(), Some(Error::OtherDevice));
    other.raw().0.destroy();
    let is_lost =
        |error: Error| matches!(error, Error::Device(vertebra_gpu::Error::DeviceLost { .. }));
    assert!(is_lost(query.pairs().unwrap_err()));
    assert!(is_lost(lost.rebuild().unwrap_err()));
    assert!(is_lost(Collider::new(&other, fan(8, 0.0)).unwrap_err()));
    assert_eq!(Query::new(&kept, &kept).unwrap().count().unwrap(), 64);
}

/// No bodies and one body have no pairs.
#[test]
fn no_bodies() {
    let Some(device) = device() else { return };
    let tile = fan(3, 0.0);
    for bodies in [vec![], vec![&tile]] {
        let links = Links::new(device, &bodies).unwrap();
        assert!(links.pairs().is_empty());
        let at = vec![Pose::IDENTITY; bodies.len()];
        assert_eq!(
            links.at(&[&at]).unwrap().any().unwrap(),
            [Vec::<bool>::new()]
        );
    }
}

/// Answers do not depend on who gives them, and the choice says why it was made.
#[test]
fn mesh_pairs() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let pair = |device, asked| MeshPair::new(device, a.clone(), b.clone(), asked);
    assert!(matches!(
        pair(None, Some(Processor::Gpu)),
        Err(Error::NoDevice)
    ));
    let mut cpu = pair(None, None).unwrap();
    assert_eq!(cpu.choice().processor, Processor::Cpu);
    assert_eq!(cpu.choice().reason, Reason::NoDevice);
    assert!(cpu.choice().to_string().contains("for want of a device"));
    let Some(device) = device() else { return };
    let mut gpu = pair(Some(device), Some(Processor::Gpu)).unwrap();
    assert_eq!(gpu.choice().processor, Processor::Gpu);
    assert_eq!(gpu.choice().reason, Reason::Asked);
    let mut random = Random::new(13);
    for turn in 0..4 {
        if turn > 0 {
            let at = pose(&mut random, 0.5);
            cpu.set_pose_b(at).unwrap();
            gpu.set_pose_b(at).unwrap();
        }
        if turn == 3 {
            let moved: Vec<Vec3> = b.vertices().iter().map(|v| *v * 0.75).collect();
            cpu.set_vertices(Side::B, moved.clone()).unwrap();
            gpu.set_vertices(Side::B, moved).unwrap();
        }
        assert_eq!(gpu.pairs().unwrap(), cpu.pairs().unwrap());
        assert_eq!(gpu.any().unwrap(), cpu.any().unwrap());
        assert_eq!(gpu.count().unwrap(), cpu.count().unwrap());
        assert_eq!(gpu.mask().unwrap(), cpu.mask().unwrap());
        assert_eq!(gpu.classified().unwrap(), cpu.classified().unwrap());
        assert_eq!(gpu.curves().unwrap(), cpu.curves().unwrap());
        assert!(cpu.any().unwrap());
    }
    let expected = gpu.pairs().unwrap();
    for pair in [&mut cpu, &mut gpu] {
        let refused = pair.set_pose_b(Pose::from_translation(DVec3::NAN));
        assert!(matches!(
            refused,
            Err(Error::Query(QueryError::InvalidPose { .. }))
        ));
        let refused = pair.set_vertices(Side::A, vec![Vec3::ZERO]);
        assert!(matches!(
            refused,
            Err(Error::Mesh(MeshError::VertexCount { .. }))
        ));
        assert_eq!(pair.pairs().unwrap(), expected);
    }
}
