//! Whole meshes: the gold pair lists, made independently with exact predicates.

use crate::support::{Random, gold_mesh, gold_path, oracle};
use glam::{DQuat, DVec3, Vec3};
use vertebra_collision::{Method, PoseProblem, Query, QueryError, Side, TriangleMesh};
use vertebra_spatial::Pose;

const SCENARIOS: [(&str, &str, usize); 3] = [
    ("sphere", "cylinder", 241),
    ("cup", "bowl", 624),
    ("cup", "spoon", 728),
];

fn gold_pairs(a: &str, b: &str) -> Vec<[u32; 2]> {
    let text = std::fs::read_to_string(gold_path(&format!("pairs_{a}_{b}.txt"))).unwrap();
    let mut pairs: Vec<[u32; 2]> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            let (i, j) = line.split_once(' ').unwrap();
            [i.parse().unwrap(), j.parse().unwrap()]
        })
        .collect();
    pairs.sort_unstable();
    pairs
}

/// Count, mask and any must say what the pair list says, on any number of threads.
fn consistent(query: &Query<'_>, pairs: &[[u32; 2]], sizes: [usize; 2]) {
    for threads in [1, 2, 0] {
        let query = query.clone().threads(threads);
        assert_eq!(query.pairs().unwrap(), pairs);
        assert_eq!(query.count().unwrap(), pairs.len() as u64);
        assert_eq!(query.any().unwrap(), !pairs.is_empty());
        let mut masks = [vec![false; sizes[0]], vec![false; sizes[1]]];
        for [i, j] in pairs {
            masks[0][*i as usize] = true;
            masks[1][*j as usize] = true;
        }
        let [a, b] = masks;
        assert_eq!(query.mask().unwrap(), (a, b));
    }
}

#[test]
fn gold_pair_lists() {
    for (a, b, count) in SCENARIOS {
        let gold = gold_pairs(a, b);
        assert_eq!(gold.len(), count);
        let (a, b) = (gold_mesh(a), gold_mesh(b));
        consistent(&Query::new(&a, &b), &gold, [a.len(), b.len()]);
        // The same pairs the other way round.
        let mut mirrored = Query::new(&b, &a).pairs().unwrap();
        for pair in &mut mirrored {
            pair.reverse();
        }
        mirrored.sort_unstable();
        assert_eq!(mirrored, gold);
    }
}

/// The baseline's answers are consistent between its queries too. How many are wrong is a result, not a requirement;
/// but that it finds most of the true pairs shows that it is the method it says it is.
#[test]
fn baseline_on_gold() {
    let (a, b, _) = SCENARIOS[0];
    let gold = gold_pairs(a, b);
    let (a, b) = (gold_mesh(a), gold_mesh(b));
    let query = Query::new(&a, &b).method(Method::MOLLER);
    let pairs = query.pairs().unwrap();
    consistent(&query, &pairs, [a.len(), b.len()]);
    let missed = gold.iter().filter(|pair| !pairs.contains(pair)).count();
    assert!(missed * 20 < gold.len(), "{missed} missed");
}

/// Random poses of both meshes: every answer that a query gives for a sample of pairs is the oracle's on the points
/// that the relative pose defines.
#[test]
fn posed_meshes_against_the_oracle() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let mut random = Random::new(11);
    let mut quaternion = || {
        let [x, y, z, w] = [(); 4].map(|()| random.unit());
        DQuat::from_xyzw(x, y, z, w).normalize()
    };
    for _ in 0..4 {
        let in_world = Pose::new(quaternion(), DVec3::new(5.0, -3.0, 1.0));
        let relative = Pose::new(quaternion(), DVec3::new(0.2, 0.1, -0.3));
        let query = Query::new(&a, &b)
            .poses(in_world, in_world * relative)
            .unwrap();
        let pairs = query.pairs().unwrap();
        assert!(!pairs.is_empty());
        consistent(&query, &pairs, [a.len(), b.len()]);
        // Every pair found, and every other pair of the triangles in them.
        let posed = |j: u32| {
            b.triangle(j as usize)
                .map(|v| query.relative_pose().apply(v))
        };
        for &[i, j] in pairs.iter().step_by(5) {
            let corners = a.triangle(i as usize).map(|v| v.as_dvec3());
            for other in (j.saturating_sub(4))..(j + 4).min(216) {
                let found = pairs.binary_search(&[i, other]).is_ok();
                assert_eq!(found, oracle(&corners, &posed(other)), "{i} {other}");
            }
        }
    }
}

/// Small meshes of lattice triangles, so that touching, coplanar and zero-area pairs abound: complete against the
/// oracle, through boxes, chunks and threads.
#[test]
fn lattice_soups_against_the_oracle() {
    let mut random = Random::new(13);
    let mut soup = |count: usize| {
        let vertices: Vec<Vec3> = (0..3 * count)
            .map(|_| random.lattice(0, 5).as_vec3())
            .collect();
        let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        TriangleMesh::new(vertices, triangles.collect()).unwrap()
    };
    for (count_a, count_b) in [(1, 1), (1, 70), (70, 1), (100, 33)] {
        let (a, b) = (soup(count_a), soup(count_b));
        let corners = |m: &TriangleMesh, i: u32| m.triangle(i as usize).map(|v| v.as_dvec3());
        let mut expected = Vec::new();
        for i in 0..count_a as u32 {
            for j in 0..count_b as u32 {
                if oracle(&corners(&a, i), &corners(&b, j)) {
                    expected.push([i, j]);
                }
            }
        }
        consistent(&Query::new(&a, &b), &expected, [count_a, count_b]);
    }
}

#[test]
fn meshes_apart_have_no_pairs() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let far = Pose::from_translation(DVec3::new(0.0, 1e30, 0.0));
    let query = Query::new(&a, &b).pose_b(far).unwrap();
    consistent(&query, &[], [a.len(), b.len()]);
}

#[test]
fn unusable_poses_and_tolerances_are_refused() {
    let mesh = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let query = Query::new(&mesh, &mesh);
    let far = Pose::from_translation;
    let turned = Pose::from_rotation;
    let half = f64::from(f32::MAX) / 2.0;
    let cases = [
        (far(DVec3::X * f64::NAN), PoseProblem::NotFinite),
        (far(DVec3::Y * f64::NEG_INFINITY), PoseProblem::NotFinite),
        (
            turned(DQuat::from_xyzw(0.0, f64::NAN, 0.0, 1.0)),
            PoseProblem::NotFinite,
        ),
        (
            turned(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
            PoseProblem::NotUnit,
        ),
        (
            turned(DQuat::from_xyzw(0.0, 0.01, 0.0, 1.0)),
            PoseProblem::NotUnit,
        ),
        (far(DVec3::Z * -2.0_f64.powi(127)), PoseProblem::TooFar),
    ];
    for (pose, problem) in cases {
        for (mesh, poses) in [
            (Side::A, (pose, Pose::IDENTITY)),
            (Side::B, (Pose::IDENTITY, pose)),
        ] {
            assert_eq!(
                query.clone().poses(poses.0, poses.1).unwrap_err(),
                QueryError::InvalidPose { mesh, problem }
            );
        }
    }
    assert!(
        query
            .clone()
            .pose_b(far(DVec3::X * half))
            .unwrap()
            .any()
            .is_ok()
    );
    for epsilon in [-1e-6, f32::INFINITY] {
        let error = query.clone().method(Method::Moller { epsilon }).any();
        assert_eq!(error, Err(QueryError::InvalidEpsilon { epsilon }));
    }
    let nan = query.clone().method(Method::Moller { epsilon: f32::NAN });
    assert!(matches!(
        nan.pairs(),
        Err(QueryError::InvalidEpsilon { .. })
    ));
    let error = query.pose_b(far(DVec3::X * f64::NAN)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the pose of mesh B has a number that is not finite"
    );
}
