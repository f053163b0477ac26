//! Many poses and many pairs of bodies in one call: the answers of one by one, in order.

use crate::support::{Random, gold_mesh};
use glam::{DQuat, DVec3};
use vertebra_collision::{Collider, Links, PoseProblem, Query, QueryError, Side};
use vertebra_spatial::Pose;

fn poses(random: &mut Random, count: usize) -> Vec<Pose> {
    let mut pose = || {
        let [x, y, z, w] = [(); 4].map(|()| random.unit());
        let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
        Pose::new(rotation, random.point().as_dvec3() * 2.5)
    };
    (0..count).map(|_| pose()).collect()
}

#[test]
fn many_poses_of_one_pair() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let colliders = [&a, &b].map(|mesh| Collider::new(mesh.clone()));
    let poses = poses(&mut Random::new(81), 40);
    let one_by_one: Vec<_> = poses
        .iter()
        .map(|&pose| Query::new(&a, &b).pose_b(pose).unwrap().pairs().unwrap())
        .collect();
    let counts: Vec<_> = one_by_one.iter().map(|pairs| pairs.len() as u64).collect();
    assert!(counts.contains(&0) && counts.iter().any(|&count| count > 0));
    let query = Query::new(&colliders[0], &colliders[1]);
    for threads in [1, 2, 0] {
        let query = query.clone().threads(threads);
        assert_eq!(query.at_poses(&poses, |q| q.pairs()).unwrap(), one_by_one);
        assert_eq!(query.at_poses(&poses, |q| q.count()).unwrap(), counts);
    }
    assert!(query.at_poses(&[], |q| q.any()).unwrap().is_empty());
    let mut broken = poses;
    broken[7].translation.x = f64::NAN;
    broken[9].translation.x = f64::NAN;
    let error = query.threads(0).at_poses(&broken, |q| q.any()).unwrap_err();
    let QueryError::AtPose { index: 7, error } = error else {
        panic!("{error:?}")
    };
    let problem = PoseProblem::NotFinite;
    assert_eq!(
        *error,
        QueryError::InvalidPose {
            mesh: Side::B,
            problem
        }
    );
}

#[test]
fn links_of_a_robot() {
    let mut random = Random::new(82);
    let names = ["sphere", "cylinder", "cylinder", "sphere", "cylinder"];
    let bodies = names.map(|name| Collider::new(gold_mesh(name)));
    let configurations: Vec<_> = (0..6).map(|_| poses(&mut random, 5)).collect();
    let links = Links::new(&bodies)
        .ignore(1, 0)
        .unwrap()
        .ignore(2, 3)
        .unwrap();
    let pairs = [
        [0, 2],
        [0, 3],
        [0, 4],
        [1, 2],
        [1, 3],
        [1, 4],
        [2, 4],
        [3, 4],
    ];
    assert_eq!(links.pairs(), pairs);
    let expected: Vec<Vec<_>> = configurations
        .iter()
        .map(|poses| {
            let answer = |[i, j]: [usize; 2]| {
                let query = Query::new(bodies[i].mesh(), bodies[j].mesh());
                query.poses(poses[i], poses[j]).unwrap().pairs().unwrap()
            };
            pairs.into_iter().map(answer).collect()
        })
        .collect();
    assert!(expected.iter().flatten().any(|pairs| pairs.is_empty()));
    assert!(expected.iter().flatten().any(|pairs| !pairs.is_empty()));
    for threads in [1, 2, 0] {
        let links = links.clone().threads(threads);
        assert_eq!(links.ask(&configurations, |q| q.pairs()).unwrap(), expected);
    }
    assert!(
        links
            .ask(&[[Pose::IDENTITY; 5]; 0], |q| q.any())
            .unwrap()
            .is_empty()
    );
    // Instances of one shape need no copies of it.
    let [sphere, cylinder] = [0, 1].map(|i: usize| &bodies[i]);
    let instances = [sphere, cylinder, cylinder, sphere, cylinder];
    let links = Links::new(&instances).ignore(0, 1).unwrap();
    let links = links.ignore(2, 3).unwrap();
    assert_eq!(links.ask(&configurations, |q| q.pairs()).unwrap(), expected);
    // Nothing is left to ask about, and a lone body.
    let alone = Links::new(&bodies[..1]);
    let answers = alone.ask(&[[Pose::IDENTITY]; 3], |q| q.any()).unwrap();
    assert_eq!(answers, [[false; 0]; 3]);
}

#[test]
fn links_refuse_what_does_not_fit() {
    let bodies = [(); 2].map(|()| Collider::new(gold_mesh("cylinder")));
    let error = Links::new(&bodies).ignore(0, 2).unwrap_err();
    assert_eq!(error, QueryError::NoSuchBody { body: 2, bodies: 2 });
    let error = Links::new(&bodies).ignore(1, 1).unwrap_err();
    assert_eq!(error, QueryError::SameBody { body: 1 });
    let links = Links::new(&bodies);
    let error = links.ask(&[vec![Pose::IDENTITY; 2], vec![Pose::IDENTITY]], |q| {
        q.any()
    });
    let expected = QueryError::PoseCount {
        configuration: 1,
        expected: 2,
        found: 1,
    };
    assert_eq!(error, Err(expected));
    let far = Pose::from_translation(DVec3::X * 1e39);
    let error = links
        .ask(&[[Pose::IDENTITY; 2], [far, Pose::IDENTITY]], |q| q.any())
        .unwrap_err();
    let QueryError::InPair {
        configuration: 1,
        pair: [0, 1],
        ..
    } = error
    else {
        panic!("{error:?}")
    };
    assert_eq!(
        error.to_string(),
        "the question about bodies 0 and 1 in configuration 1 failed"
    );
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(cause.starts_with("the pose of mesh A"), "{cause}");
}
