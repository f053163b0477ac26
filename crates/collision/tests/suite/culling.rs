//! Hierarchies against all pairs: the same answers, whatever the meshes, the poses, the threads and what is prepared.

use crate::support::{Random, gold_mesh};
use glam::{DQuat, DVec3, Vec2, Vec3};
use vertebra_collision::{
    Collider, Culling, MeshError, Query, SelfQuery, Statistics, TriangleMesh,
};
use vertebra_spatial::Pose;

/// Asks all questions in all ways, and returns the pairs.
fn same_answers(a: &TriangleMesh, b: &TriangleMesh, poses: [Pose; 2]) -> Vec<[u32; 2]> {
    let colliders = [a, b].map(|mesh| Collider::new(mesh.clone()));
    same_answers_of(a, b, [&colliders[0], &colliders[1]], poses)
}

fn same_answers_of(
    a: &TriangleMesh,
    b: &TriangleMesh,
    [collider_a, collider_b]: [&Collider; 2],
    poses: [Pose; 2],
) -> Vec<[u32; 2]> {
    let all = Query::new(a, b).poses(poses[0], poses[1]).unwrap();
    let all = all.culling(Culling::AllPairs);
    let pairs = all.pairs().unwrap();
    let queries = [
        Query::new(a, b),
        Query::new(collider_a, collider_b),
        Query::new(a, collider_b),
        Query::new(collider_a, b),
    ];
    for query in queries {
        for (culling, threads) in [(Culling::Bvh, 1), (Culling::Bvh, 2), (Culling::Auto, 0)] {
            let query = query.clone().poses(poses[0], poses[1]).unwrap();
            let query = query.culling(culling).threads(threads);
            assert_eq!(query.pairs().unwrap(), pairs);
            assert_eq!(query.count().unwrap(), pairs.len() as u64);
            assert_eq!(query.any().unwrap(), !pairs.is_empty());
            assert_eq!(query.mask().unwrap(), all.mask().unwrap());
        }
    }
    pairs
}

fn random_pose(random: &mut Random, reach: f64) -> Pose {
    let [x, y, z, w] = [(); 4].map(|()| random.unit());
    let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
    Pose::new(rotation, random.point().as_dvec3() * reach)
}

/// Triangles of one size or of many, in a cube or along a line.
fn soup(random: &mut Random, count: usize, kind: i64) -> TriangleMesh {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let corner = random.point();
        let size = match kind {
            0 => 0.2,
            1 => 2.0_f32.powi(random.int(-12, 0) as i32),
            _ => 0.0,
        };
        let spread = if kind == 2 {
            Vec3::new(1.0, 0.01, 0.0)
        } else {
            Vec3::ONE
        };
        for _ in 0..3 {
            vertices.push((corner + random.point() * size) * spread);
        }
    }
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(vertices, triangles.collect()).unwrap()
}

#[test]
fn soups_of_every_size_up_to_several_levels() {
    let mut random = Random::new(21);
    let mut hits = 0;
    for (a, b) in [
        (1, 1),
        (1, 9),
        (8, 8),
        (9, 64),
        (65, 7),
        (513, 1),
        (1, 600),
        (520, 700),
    ] {
        for kind in 0..3 {
            let (a, b) = (soup(&mut random, a, kind), soup(&mut random, b, kind));
            for reach in [0.0, 0.3, 1.5] {
                let poses = [
                    random_pose(&mut random, reach),
                    random_pose(&mut random, reach),
                ];
                hits += same_answers(&a, &b, poses).len();
            }
            hits += same_answers(&a, &b, [Pose::IDENTITY; 2]).len();
        }
    }
    assert!(hits > 1000, "{hits}");
}

#[test]
fn lattice_soups_full_of_contacts() {
    let mut random = Random::new(22);
    for (a, b) in [(70, 90), (600, 200)] {
        let mut lattice = |count: usize| {
            let vertices: Vec<Vec3> = (0..3 * count)
                .map(|_| random.lattice(0, 9).as_vec3())
                .collect();
            let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
            TriangleMesh::new(vertices, triangles.collect()).unwrap()
        };
        let (a, b) = (lattice(a), lattice(b));
        assert!(!same_answers(&a, &b, [Pose::IDENTITY; 2]).is_empty());
        // A quarter turn and an integer shift keep to the lattice, so boxes touch exactly.
        let turn = DQuat::from_xyzw(0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt());
        let pose = Pose::new(turn, DVec3::new(9.0, 0.0, 9.0));
        same_answers(&a, &b, [Pose::IDENTITY, pose]);
    }
}

#[test]
fn gold_meshes_in_random_poses() {
    let mut random = Random::new(23);
    for (a, b) in [("sphere", "cylinder"), ("cup", "bowl")] {
        let (a, b) = (gold_mesh(a), gold_mesh(b));
        for _ in 0..2 {
            let in_world = random_pose(&mut random, 5.0);
            let relative = random_pose(&mut random, 0.3);
            same_answers(&a, &b, [in_world, in_world * relative]);
        }
    }
}

/// Far from the origin, at the ends of the range of `f32`, where boxes become unbounded.
#[test]
fn extreme_sizes_and_offsets() {
    let mut random = Random::new(24);
    let mut hits = 0;
    for size in [f32::MAX, 1e30, 1e-30, f32::from_bits(40)] {
        let mut scaled = |count| {
            let soup = soup(&mut random, count, 0);
            let vertices = soup.vertices().iter().map(|&v| (v * 0.8) * size);
            TriangleMesh::new(vertices.collect(), soup.triangles().to_vec()).unwrap()
        };
        let (a, b) = (scaled(90), scaled(70));
        hits += same_answers(&a, &b, [Pose::IDENTITY; 2]).len();
        let turn = random_pose(&mut random, f64::from(size).min(1e38) * 0.2);
        hits += same_answers(&a, &b, [Pose::IDENTITY, turn]).len();
        hits += same_answers(&a, &b, [turn, Pose::IDENTITY]).len();
    }
    for offset in [1e3, 1e6, 1e8] {
        let a = soup(&mut random, 90, 0);
        let shift = Vec3::splat(offset);
        let moved = a.vertices().iter().map(|&v| v + shift).collect();
        let b = TriangleMesh::new(moved, a.triangles().to_vec()).unwrap();
        let back = Pose::from_translation(-shift.as_dvec3());
        hits += same_answers(&a, &b, [Pose::IDENTITY, back]).len();
        hits += same_answers(&b, &a, [back, Pose::IDENTITY]).len();
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn moved_vertices() {
    let mut random = Random::new(25);
    let fixed = soup(&mut random, 300, 0);
    let other = Collider::new(fixed.clone());
    let mut moving = Collider::new(soup(&mut random, 400, 0));
    assert_eq!(moving.degradation(), 1.0);
    let mut worst = 1.0_f64;
    for _ in 0..4 {
        let moved = moving
            .mesh()
            .vertices()
            .iter()
            .map(|&v| v + random.point() * 0.4);
        let moved: Vec<Vec3> = moved.collect();
        moving.set_vertices(moved).unwrap();
        let mesh = moving.mesh();
        same_answers_of(mesh, &fixed, [&moving, &other], [Pose::IDENTITY; 2]);
        worst = worst.max(moving.degradation());
    }
    assert!(worst > 1.05, "{worst}");
    moving.rebuild();
    assert_eq!(moving.degradation(), 1.0);
    same_answers_of(
        moving.mesh(),
        &fixed,
        [&moving, &other],
        [Pose::IDENTITY; 2],
    );
    // Refused input changes nothing.
    let before = moving.mesh().clone();
    let mut short = before.vertices().to_vec();
    short.pop();
    let error = moving.set_vertices(short).unwrap_err();
    let counts = MeshError::VertexCount {
        expected: 1200,
        found: 1199,
    };
    assert_eq!(error, counts);
    assert_eq!(
        error.to_string(),
        "1199 vertices cannot replace 1200: to change their number, make a new mesh"
    );
    let mut broken = before.vertices().to_vec();
    broken[7].y = f32::NAN;
    let error = moving.set_vertices(broken).unwrap_err();
    assert_eq!(error, MeshError::NonFiniteVertex { vertex: 7 });
    assert_eq!(*moving.mesh(), before);
    assert_eq!(moving.into_mesh(), before);
}

/// Scaling a mesh changes no hierarchy's quality; a mesh without surface has the neutral one.
#[test]
fn degradation_has_no_unit() {
    let mut random = Random::new(26);
    let mut collider = Collider::new(soup(&mut random, 100, 0));
    let doubled = collider
        .mesh()
        .vertices()
        .iter()
        .map(|&v| v * 2.0)
        .collect();
    collider.set_vertices(doubled).unwrap();
    assert_eq!(collider.degradation(), 1.0);
    let point = TriangleMesh::new(vec![Vec3::ONE], vec![[0, 0, 0]]).unwrap();
    assert_eq!(Collider::new(point).degradation(), 1.0);
}

/// A sheet twisted about its middle, so that what was close no longer is: one vertex far away neither hides that nor looks
/// like it, and building again mends it.
#[test]
fn degradation_is_not_hidden_by_a_vertex_far_away() {
    let size = 60_u32;
    let side = size + 1;
    let flat = (0..side * side).map(|i| Vec3::new((i % side) as f32, (i / side) as f32, 0.0));
    let triangles = (0..size * size).flat_map(|i| {
        let corner = i / size * side + i % size;
        [
            [corner, corner + 1, corner + side],
            [corner + 1, corner + side, corner + side + 1],
        ]
    });
    let sheet = TriangleMesh::new(flat.collect(), triangles.collect()).unwrap();
    let built = Collider::new(sheet);
    let degraded = |vertices: Vec<Vec3>| {
        let mut collider = built.clone();
        collider.set_vertices(vertices).unwrap();
        let before = collider.degradation();
        collider.rebuild();
        assert_eq!(collider.degradation(), 1.0);
        before
    };
    let far = |mut vertices: Vec<Vec3>| {
        vertices[77] = Vec3::splat(1e5);
        vertices
    };
    let flat = built.mesh().vertices().to_vec();
    let twisted: Vec<Vec3> = flat
        .iter()
        .map(|v| {
            let from_middle = v.truncate() - size as f32 / 2.0;
            let turned = Vec2::from_angle(from_middle.length()).rotate(from_middle);
            turned.extend(0.0)
        })
        .collect();
    let (alone, hidden) = (degraded(twisted.clone()), degraded(far(twisted)));
    assert!(alone > 1.5, "{alone}");
    assert!((hidden / alone - 1.0).abs() < 0.1, "{hidden} {alone}");
    let unharmed = degraded(far(flat));
    assert!((unharmed - 1.0).abs() < 0.1, "{unharmed}");
}

/// Threads only share the work of building.
#[test]
fn hierarchies_do_not_depend_on_threads() {
    let mesh = soup(&mut Random::new(27), 20_000, 1);
    let one = format!("{:?}", Collider::on_threads(mesh.clone(), 1));
    assert_eq!(format!("{:?}", Collider::on_threads(mesh, 0)), one);
}

#[test]
fn statistics_add_up() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let sum = |s: &Statistics| {
        s.apart_by_first_plane + s.apart_by_second_plane + s.on_line + s.degenerate
    };
    let query = Query::new(&a, &b);
    let one = query.statistics().unwrap();
    assert_eq!(query.clone().threads(2).statistics().unwrap(), one);
    assert_eq!(one.hits, 241);
    assert_eq!(sum(&one), one.pairs);
    assert!(one.beyond_filter * 100 < one.pairs, "{one:?}");
    // A mesh on itself is all contacts: no filter decides those.
    let itself = Query::new(&b, &b).statistics().unwrap();
    assert_eq!(sum(&itself), itself.pairs);
    assert!(itself.degenerate >= b.len() as u64);
    assert!(itself.beyond_filter > b.len() as u64);
    assert!(itself.signs_beyond_filter >= itself.beyond_filter);
}

/// However lopsided the meshes, and whichever is the large one, threads divide the work without changing an answer.
#[test]
#[cfg(feature = "rayon")]
fn many_threads_on_lopsided_meshes() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build();
    let pool = pool.unwrap();
    let mut random = Random::new(28);
    let mut hits = 0;
    for (few, many) in [(1, 9000), (7, 9000), (40, 9000), (3000, 9000)] {
        let (few, many) = (soup(&mut random, few, 0), soup(&mut random, many, 1));
        let placed = random_pose(&mut random, 0.2);
        for (a, b) in [(&few, &many), (&many, &few)] {
            for pose in [Pose::IDENTITY, placed] {
                let all = Query::new(a, b).pose_b(pose).unwrap();
                let all = all.culling(Culling::AllPairs);
                let pairs = all.pairs().unwrap();
                hits += pairs.len();
                for threads in [1, 2, 3, 8] {
                    let [ca, cb] = [a, b]
                        .map(|mesh| pool.install(|| Collider::on_threads(mesh.clone(), threads)));
                    for query in [Query::new(a, b), Query::new(&ca, &cb)] {
                        let query = query.pose_b(pose).unwrap().threads(threads);
                        let query = query.culling(Culling::Bvh);
                        assert_eq!(pool.install(|| query.pairs()).unwrap(), pairs);
                        let any = pool.install(|| query.any()).unwrap();
                        assert_eq!(any, !pairs.is_empty());
                    }
                    let all = all.clone().threads(threads);
                    assert_eq!(pool.install(|| all.pairs()).unwrap(), pairs);
                }
            }
        }
        for threads in [1, 2, 3, 8] {
            let itself = SelfQuery::new(&many).threads(threads);
            let count = pool.install(|| itself.count());
            assert_eq!(count, SelfQuery::new(&many).count());
        }
    }
    assert!(hits > 100, "{hits}");
    let mesh = soup(&mut random, 20_000, 1);
    let one = format!("{:?}", Collider::on_threads(mesh.clone(), 1));
    for threads in [2, 3, 8] {
        let collider = pool.install(|| Collider::on_threads(mesh.clone(), threads));
        assert_eq!(format!("{collider:?}"), one, "{threads}");
    }
}

/// Signs of contacts are zero, which no filter decides: in space six for two triangles of a plane; in the plane those of
/// corners on the line of a side; and all of triangles of zero area.
#[test]
fn signs_are_counted_in_all_stages() {
    let one = |corners: [[f32; 3]; 3]| {
        TriangleMesh::new(corners.map(Vec3::from).to_vec(), vec![[0, 1, 2]]).unwrap()
    };
    let triangle = one([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
    let segment = one([[1.0, 1.0, 0.0], [1.0, 1.0, 2.0], [1.0, 1.0, 1.0]]);
    for (a, b, signs) in [
        // In one plane, apart; and with a corner on a side, the line of which decides nothing.
        (
            &triangle,
            one([[4.0, 1.0, 0.0], [4.0, 3.0, 0.0], [3.0, 3.0, 0.0]]),
            6..7,
        ),
        (
            &triangle,
            one([[2.0, 2.0, 0.0], [4.0, 3.0, 0.0], [3.0, 4.0, 0.0]]),
            7..9,
        ),
        // The triangle against a line has three zero signs and one of the line's end; then the same of the segment.
        (&triangle, segment.clone(), 5..20),
        (&segment, segment.clone(), 10..40),
    ] {
        let found = Query::new(a, &b).statistics().unwrap();
        assert_eq!([found.pairs, found.degenerate, found.beyond_filter], [1; 3]);
        assert!(signs.contains(&found.signs_beyond_filter), "{found:?}");
    }
}
