//! Triangle collision on the device: every answer is the CPU's exact one.

use super::{holds, is_software};
use crate::scenario::tableware;
use crate::suite::{Figure, Outcome, gold_meshes};
use oorandom::Rand32;
use vertebra::collision::gpu::{Collider, Error, Links, Query, SelfQuery};
use vertebra::glam::{DQuat, DVec3, Vec3};
use vertebra::{Culling, MeshError, Method, Pose, TriangleMesh};
use vertebra_gpu::Device;

/// Wrong answers of a device about two meshes: 0 for each of its verbs, with and without the tree.
pub(super) fn compare(
    device: &Device,
    name: &str,
    [a, b]: [&TriangleMesh; 2],
    pose: Pose,
) -> anyhow::Result<Vec<Figure>> {
    let cpu = vertebra::Query::new(a, b).pose_b(pose)?.threads(0);
    let on_a = Collider::new(device, a.clone())?;
    let on_b = Collider::new(device, b.clone())?;
    let gpu = Query::new(&on_a, &on_b)?.pose_b(pose)?;
    let pairs = cpu.pairs()?;
    let found = gpu.statistics()?;
    let about = |what: &str| {
        format!(
            "{name}: {what} of {} pairs, {} undecided",
            pairs.len(),
            found.undecided
        )
    };
    let mut figures = vec![
        holds(about("count"), gpu.count()? == pairs.len() as u64),
        holds(about("any"), gpu.any()? != pairs.is_empty()),
        holds(about("mask"), gpu.mask()? == cpu.mask()?),
    ];
    let classified = gpu.classified()?;
    figures.push(holds(about("classes"), classified == cpu.classified()?));
    let mut gpu = gpu;
    for culling in [Culling::AllPairs, Culling::Bvh] {
        gpu = gpu.culling(culling);
        let (too_many, too_few) = gold_meshes::wrong_pairs(&gpu.pairs()?, &pairs);
        let wrong = (too_many + too_few) as f64;
        figures.push(Figure::new(about(&format!("{culling:?}")), wrong, 0.0));
    }
    Ok(figures)
}

/// A pose with some turn, up to `reach` away.
pub(super) fn pose(rng: &mut Rand32, reach: f32) -> Pose {
    let mut unit = || f64::from(2.0 * rng.rand_float() - 1.0);
    let rotation = DQuat::from_xyzw(unit(), unit(), unit(), unit() + 1.5).normalize();
    let translation = DVec3::new(unit(), unit(), unit()) * f64::from(reach);
    Pose::new(rotation, translation)
}

/// Triangles with corners of their own.
pub(super) fn soup(
    count: usize,
    mut triangle: impl FnMut() -> [Vec3; 3],
) -> anyhow::Result<TriangleMesh> {
    let vertices = (0..count).flat_map(|_| triangle()).collect();
    let corners = (0..u32::try_from(count)?).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    Ok(TriangleMesh::new(vertices, corners.collect())?)
}

fn point(rng: &mut Rand32) -> Vec3 {
    let mut unit = || 2.0 * rng.rand_float() - 1.0;
    Vec3::new(unit(), unit(), unit())
}

/// The reference pairs, where they stand and posed.
pub(super) fn gold(device: &Device) -> Outcome {
    let mut rng = Rand32::new(1);
    let mut figures = Vec::new();
    for case in gold_meshes::cases()? {
        let meshes = [&case.a, &case.b];
        figures.extend(compare(device, case.name, meshes, Pose::IDENTITY)?);
        for turn in 0..3 {
            let name = format!("{} posed {turn}", case.name);
            figures.extend(compare(device, &name, meshes, pose(&mut rng, 0.3))?);
        }
    }
    Ok(figures)
}

/// Triangles on a lattice, full of contacts and of triangles without area; slivers; any unit of length.
pub(super) fn hard(device: &Device) -> Outcome {
    let mut rng = Rand32::new(2);
    let mut figures = Vec::new();
    let count = if is_software(device) { 150 } else { 2000 };
    for size in [2, 3, 6, 20] {
        let mut lattice = || {
            let mut corner = || {
                let mut step = || rng.rand_range(0..size + 1) as f32;
                Vec3::new(step(), step(), step())
            };
            [corner(), corner(), corner()]
        };
        let (a, b) = (soup(count, &mut lattice)?, soup(count, &mut lattice)?);
        let name = format!("lattice of {size}");
        figures.extend(compare(device, &name, [&a, &b], Pose::IDENTITY)?);
        let turned = Pose::new(
            DQuat::from_xyzw(0.0, 0.0, 1.0, 1.0).normalize(),
            DVec3::X * f64::from(size),
        );
        figures.extend(compare(
            device,
            &format!("{name}, turned"),
            [&a, &b],
            turned,
        )?);
    }
    for thin in [1e-2, 1e-4, 1e-7_f32] {
        let mut sliver = || {
            let (p, q) = (point(&mut rng), point(&mut rng));
            [p, q, 0.5 * (p + q) + point(&mut rng) * thin]
        };
        let (a, b) = (soup(count, &mut sliver)?, soup(count, &mut sliver)?);
        let name = format!("slivers of {thin:e}");
        figures.extend(compare(device, &name, [&a, &b], Pose::IDENTITY)?);
        let posed = pose(&mut rng, 0.2);
        figures.extend(compare(device, &format!("{name}, posed"), [&a, &b], posed)?);
    }
    for unit in [1e-42, 1e-38, 1e-30, 1e-10, 1e10, 1e30, 1e38_f32] {
        let mut triangle = || {
            let center = point(&mut rng);
            [(); 3].map(|()| (center + 0.3 * point(&mut rng)) * unit)
        };
        let (a, b) = (soup(count, &mut triangle)?, soup(count, &mut triangle)?);
        let name = format!("unit of {unit:e}");
        figures.extend(compare(device, &name, [&a, &b], Pose::IDENTITY)?);
        let posed = pose(&mut rng, 0.2 * unit);
        figures.extend(compare(device, &format!("{name}, posed"), [&a, &b], posed)?);
    }
    Ok(figures)
}

/// Triangles of which a corner is a rounding away from a triangle of the other mesh, or an edge from an edge.
pub(super) fn nearly_touching(device: &Device) -> Outcome {
    let mut rng = Rand32::new(7);
    let mut figures = Vec::new();
    let count = if is_software(device) { 200 } else { 2000 };
    for far in [0.0, 0.3, 20.0_f32] {
        let posed = if far > 0.0 {
            pose(&mut rng, far)
        } else {
            Pose::IDENTITY
        };
        let a = soup(count, || [(); 3].map(|()| point(&mut rng)))?;
        let mut index = 0;
        let b = soup(2 * count, || {
            let [p, q, r] = a.triangle(index / 2).map(|v| v.as_dvec3());
            let (u, v) = (f64::from(rng.rand_float()), f64::from(rng.rand_float()));
            let [along, aside] = [(); 2].map(|()| point(&mut rng).as_dvec3());
            let corners = if index % 2 == 0 {
                let inside = p + (q - p) * u * 0.5 + (r - p) * v * 0.5;
                [inside, inside + along, aside]
            } else {
                let edge = p + (q - p) * u;
                [edge - along * v, edge + along * (1.1 - v), edge + aside]
            };
            index += 1;
            corners.map(|p| posed.inverse().transform_point(p).as_vec3())
        })?;
        let name = format!("nearly touching, {far} away");
        figures.extend(compare(device, &name, [&a, &b], posed)?);
    }
    Ok(figures)
}

/// Spheres crossing in a ring, up to ten million triangles.
pub(super) fn large(device: &Device) -> Outcome {
    let sizes: &[(usize, usize)] = if is_software(device) {
        &[(60, 40)]
    } else {
        &[(708, 354), (3163, 1582)]
    };
    let mut figures = Vec::new();
    for &(around, down) in sizes {
        let (a, b) = (
            tableware::uv_sphere(around, down)?,
            tableware::uv_sphere(224, 113)?,
        );
        let on_a = Collider::new(device, a.clone())?;
        let on_b = Collider::new(device, b.clone())?;
        for pose in [
            Pose::from_translation(DVec3::new(0.37, 0.61, 1.32)),
            pose(&mut Rand32::new(3), 1.0),
        ] {
            // From either side: in A's frame other vertices are rounded than in B's.
            let cases = [
                (
                    "down the larger",
                    [&a, &b],
                    [&on_a, &on_b],
                    [Pose::IDENTITY, pose],
                ),
                (
                    "down the smaller",
                    [&b, &a],
                    [&on_b, &on_a],
                    [pose, Pose::IDENTITY],
                ),
            ];
            for (name, meshes, on_device, poses) in cases {
                let cpu = vertebra::Query::new(meshes[0], meshes[1]);
                let expected = cpu.poses(poses[0], poses[1])?.threads(0).pairs()?;
                let gpu = Query::new(on_device[0], on_device[1])?;
                let found = gpu.poses(poses[0], poses[1])?.pairs()?;
                let (too_many, too_few) = gold_meshes::wrong_pairs(&found, &expected);
                let name = format!("{} triangles, {name}: {} pairs", a.len(), expected.len());
                figures.push(Figure::new(name, (too_many + too_few) as f64, 0.0));
            }
        }
    }
    Ok(figures)
}

/// Every triangle meets every other in a common side: queues that are too short at first.
pub(super) fn queues_grow(device: &Device) -> Outcome {
    let count = if is_software(device) { 300 } else { 1500 };
    let fan = |turn: f32| {
        let mut i = 0.0_f32;
        soup(count, || {
            i += 1.0;
            let (sin, cos) = (i + turn).sin_cos();
            [Vec3::NEG_Z, Vec3::Z, Vec3::new(cos, sin, 0.0)]
        })
    };
    compare(device, "fans", [&fan(0.0)?, &fan(0.5)?], Pose::IDENTITY)
}

/// Vertices moved by the host, and written on the device, good and bad.
pub(super) fn moved(device: &Device) -> Outcome {
    let (a, b) = (tableware::sphere()?, tableware::cylinder()?);
    let on_a = Collider::new(device, a.clone())?;
    let mut on_b = Collider::new(device, b.clone())?;
    let query = Query::new(&on_a, &on_b)?;
    let pushed: Vec<Vec3> = b.vertices().iter().map(|v| *v + Vec3::X * 0.1).collect();
    let moved = TriangleMesh::new(pushed.clone(), b.triangles().to_vec())?;
    let exact = |mesh: &TriangleMesh| vertebra::Query::new(&a, mesh).pairs();
    let mut figures = Vec::new();
    on_b.set_vertices(pushed)?;
    figures.push(holds("set by the host", query.pairs()? == exact(&moved)?));
    on_b.rebuild()?;
    figures.push(holds("built again", query.pairs()? == exact(&moved)?));
    let coordinates = |mesh: &TriangleMesh| -> Vec<f32> {
        mesh.vertices().iter().flat_map(Vec3::to_array).collect()
    };
    let mut bad = coordinates(&b);
    bad[31] = f32::NAN;
    on_b.vertices().write(&bad)?;
    on_b.refit()?;
    let refused = query.pairs();
    let expected = Error::Mesh(MeshError::NonFiniteVertex { vertex: 10 });
    figures.push(holds(format!("NaN: {refused:?}"), refused == Err(expected)));
    on_b.vertices().write(&coordinates(&b))?;
    on_b.refit()?;
    figures.push(holds("repaired", query.pairs()? == exact(&b)?));
    let other = device.reopen()?;
    let elsewhere = Collider::new(&other, b.clone())?;
    let refused = Query::new(&on_a, &elsewhere).err();
    figures.push(holds("other device", refused == Some(Error::OtherDevice)));
    // The device of these is destroyed, and the others go on.
    let again = Collider::new(&other, a.clone())?;
    let lost = Query::new(&again, &elsewhere)?;
    other.raw().0.destroy();
    let error = lost.pairs();
    let typed = matches!(
        error,
        Err(Error::Device(vertebra_gpu::Error::DeviceLost { .. }))
    );
    figures.push(holds(format!("device lost: {error:?}"), typed));
    figures.push(holds("the next call works", query.pairs()? == exact(&b)?));
    Ok(figures)
}

/// One mesh after another, as one.
fn joined(meshes: &[TriangleMesh]) -> anyhow::Result<TriangleMesh> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = u32::try_from(vertices.len())?;
        vertices.extend_from_slice(mesh.vertices());
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    Ok(TriangleMesh::new(vertices, triangles)?)
}

/// Meshes that pass through themselves, and lattices of triangles.
pub(super) fn itself(device: &Device) -> Outcome {
    let mut rng = Rand32::new(4);
    let count = if is_software(device) { 150 } else { 1000 };
    let lattice = soup(count, || {
        let mut step = || rng.rand_range(0..5) as f32;
        [(); 3].map(|()| Vec3::new(step(), step(), step()))
    })?;
    let mut meshes = vec![
        (
            "sphere and cylinder",
            joined(&[tableware::sphere()?, tableware::cylinder()?])?,
        ),
        ("lattice", lattice),
    ];
    if !is_software(device) {
        meshes.push(("cup", tableware::cup()?));
        meshes.push(("bowl", tableware::bowl()?));
        let sphere = tableware::uv_sphere(708, 354)?;
        let moved = sphere
            .vertices()
            .iter()
            .map(|v| *v + Vec3::new(0.37, 0.61, 1.32));
        let other = TriangleMesh::new(moved.collect(), sphere.triangles().to_vec())?;
        meshes.push(("two spheres", joined(&[sphere, other])?));
    }
    let mut figures = Vec::new();
    for (name, mesh) in meshes {
        let expected = vertebra::SelfQuery::new(&mesh).threads(0).pairs();
        let collider = Collider::new(device, mesh)?;
        for culling in [Culling::Auto, Culling::Bvh] {
            let query = SelfQuery::new(&collider).culling(culling);
            let (too_many, too_few) = gold_meshes::wrong_pairs(&query.pairs()?, &expected);
            let undecided = query.statistics()?.undecided;
            let name = format!("{name}: {} pairs, {undecided} undecided", expected.len());
            figures.push(Figure::new(name, (too_many + too_few) as f64, 0.0));
        }
    }
    Ok(figures)
}

/// Many poses, and many bodies, in one run.
pub(super) fn together(device: &Device) -> Outcome {
    let mut rng = Rand32::new(5);
    let (a, b) = (tableware::sphere()?, tableware::cylinder()?);
    let count = if is_software(device) { 30 } else { 1000 };
    let poses: Vec<Pose> = (0..count).map(|_| pose(&mut rng, 1.2)).collect();
    let cpu = vertebra::Query::new(&a, &b).threads(0);
    let expected = cpu.at_poses(&poses, |query| query.pairs())?;
    let (on_a, on_b) = (
        Collider::new(device, a.clone())?,
        Collider::new(device, b.clone())?,
    );
    let mut figures = Vec::new();
    for culling in [Culling::AllPairs, Culling::Bvh] {
        let query = Query::new(&on_a, &on_b)?.culling(culling);
        let found = query.at_poses(&poses)?.pairs()?;
        figures.push(holds(
            format!("{count} poses, {culling:?}"),
            found == expected,
        ));
    }
    let ball = tableware::uv_sphere(24, 12)?;
    let bodies = [&ball, &b, &ball, &a, &b];
    let colliders = bodies.map(|mesh| vertebra::Collider::new(mesh.clone()));
    let cpu = vertebra::Links::new(&colliders).ignore(0, 1)?.threads(0);
    let gpu = Links::new(device, &bodies)?.ignore(0, 1)?;
    let narrow = |pose: Pose| {
        let translation = pose.translation.as_vec3().as_dvec3();
        Pose::new(pose.rotation.as_quat().as_dquat(), translation)
    };
    let configurations: Vec<[Pose; 5]> = (0..count)
        .map(|_| [(); 5].map(|()| narrow(pose(&mut rng, 1.5))))
        .collect();
    let expected = cpu.ask(&configurations, |query| query.pairs())?;
    figures.push(holds(
        format!("links in {count} configurations"),
        gpu.at(&configurations)?.pairs()? == expected,
    ));
    let words: Vec<f32> = configurations
        .iter()
        .flatten()
        .flat_map(|pose| {
            let [x, y, z, w] = pose.rotation.as_quat().to_array();
            let [a, b, c] = pose.translation.as_vec3().to_array();
            [x, y, z, w, a, b, c, 0.0]
        })
        .collect();
    let poses = device.buffer_from("poses", &words)?;
    figures.push(holds(
        "poses from a buffer",
        gpu.following(&poses)?.now().pairs()? == expected,
    ));
    Ok(figures)
}

/// Whether the baseline rounds nothing about two triangles of small integers: whether it divides by powers of two only.
fn is_exact(a: [Vec3; 3], b: [Vec3; 3]) -> bool {
    let exact = |t: [Vec3; 3], plane: [Vec3; 3]| {
        let normal = (plane[1] - plane[0]).cross(plane[2] - plane[0]);
        let distance = t.map(|p| normal.dot(p - plane[0]));
        (0..3).all(|i| {
            let difference = (distance[i] - distance[(i + 1) % 3]).abs();
            difference == 0.0 || difference.log2().fract() == 0.0
        })
    };
    exact(a, b) && exact(b, a)
}

/// The source's test: none of its answers differs from the CPU's where nothing is rounded; elsewhere few may, by the last bit
/// of a quotient.
pub(super) fn moller(device: &Device) -> Outcome {
    let mut rng = Rand32::new(6);
    let mut figures = Vec::new();
    for size in [1, 2, 4] {
        let mut lattice = || {
            let mut step = || rng.rand_range(0..size + 1) as f32;
            [(); 3].map(|()| Vec3::new(step(), step(), step()))
        };
        let (a, b) = (soup(150, &mut lattice)?, soup(600, &mut lattice)?);
        let cpu = vertebra::Query::new(&a, &b).method(Method::MOLLER);
        let expected = cpu.pairs()?;
        let exact: Vec<[u32; 2]> = (0..150)
            .flat_map(|i| (0..600).map(move |k| [i, k]))
            .filter(|[i, k]| is_exact(a.triangle(*i as usize), b.triangle(*k as usize)))
            .collect();
        let (on_a, on_b) = (Collider::new(device, a)?, Collider::new(device, b)?);
        let found = Query::new(&on_a, &on_b)?.method(Method::MOLLER)?.pairs()?;
        let differs = |pair: &&[u32; 2]| {
            found.binary_search(pair).is_ok() != expected.binary_search(pair).is_ok()
        };
        let name = format!(
            "lattice of {size}: of {} pairs without rounding",
            exact.len()
        );
        let wrong = exact.iter().filter(differs).count();
        figures.push(Figure::new(name, wrong as f64, 0.0));
        let (too_many, too_few) = gold_meshes::wrong_pairs(&found, &expected);
        let name = format!("lattice of {size}: of {} pairs", expected.len());
        let few = 0.02 * expected.len() as f64;
        figures.push(Figure::new(name, (too_many + too_few) as f64, few));
    }
    Ok(figures)
}
