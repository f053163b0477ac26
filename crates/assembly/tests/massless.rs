//! Every joint must move inertia.
#![expect(
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use glam::{DMat3, DVec3};
use vertebra_assembly::{
    Joint, JointKind, MassProperties, Model, ModelDescription, ModelError, Random, State, generate,
};
use vertebra_spatial::Pose;

fn rod() -> MassProperties {
    MassProperties::rod(1.0, 0.5, 0.02)
}

/// A point mass at `center`.
fn point(center: DVec3) -> MassProperties {
    MassProperties {
        mass: 1.0,
        center,
        inertia: DMat3::ZERO,
    }
}

fn assert_refused(result: Result<Model, ModelError>, culprit: &str) {
    match result {
        Err(ModelError::MasslessBody { body, .. }) => assert_eq!(body, culprit),
        other => panic!("{other:?}"),
    }
}

fn one(joint: Joint, mass: MassProperties) -> Result<Model, ModelError> {
    ModelDescription::new("one")
        .body("b", None, joint, mass)
        .build()
}

#[test]
fn every_joint_must_move_inertia() {
    let none = MassProperties::MASSLESS;
    let refused = |result| assert_refused(result, "b");
    let along = DVec3::new(0.3, 0.0, 0.0);
    refused(one(Joint::revolute(DVec3::X), none));
    refused(one(Joint::prismatic(DVec3::X), none));
    refused(one(Joint::spherical(), none));
    refused(one(Joint::free(), none));
    // Mass on the axis resists sliding, not turning.
    refused(one(Joint::revolute(DVec3::X), point(along)));
    refused(one(Joint::spherical(), point(along)));
    refused(one(Joint::free(), point(along)));
    one(Joint::prismatic(DVec3::X), point(along)).unwrap();
    one(Joint::revolute(DVec3::Y), point(along)).unwrap();
    one(Joint::fixed(), none).unwrap();
    // A rod without thickness resists all turns but those about itself.
    let thin = MassProperties::rod(1.0, 1.0, 0.0);
    refused(one(Joint::revolute(DVec3::Z), thin));
    refused(one(Joint::spherical(), thin));
    one(Joint::revolute(DVec3::X), thin).unwrap();

    // Massless links between joints are right if something beyond them has mass.
    let beyond = |joint: Joint, mass| {
        ModelDescription::new("two")
            .body("a", None, Joint::revolute(DVec3::X), none)
            .body("b", Some("a"), joint, mass)
            .build()
    };
    beyond(Joint::revolute(DVec3::Y), rod()).unwrap();
    beyond(Joint::fixed(), rod()).unwrap();
    refused(beyond(Joint::revolute(DVec3::Y), none));
    assert_refused(beyond(Joint::fixed(), none), "a");
    // Through a fixed joint the mass lands on the axis of the first: collinear.
    let tip = Pose::from_translation(along);
    assert_refused(beyond(Joint::fixed().at(tip), point(along)), "a");
    beyond(
        Joint::fixed().at(Pose::from_translation(DVec3::Y)),
        point(along),
    )
    .unwrap();
}

fn random_pose(random: &mut Random) -> Pose {
    Pose::new(random.rotation(), random.direction() * random.unit())
}

/// What rounding leaves of a vanishing moment must not pass for one.
#[test]
fn points_on_a_tilted_axis_resist_no_turn() {
    let mut random = Random::new(11);
    for case in 0..1000 {
        let axis = random.direction();
        let size = 10.0_f64.powi(case % 13 - 6);
        let on_axis = |random: &mut Random| MassProperties {
            mass: 0.1 + random.unit(),
            ..point(axis * (size * random.symmetric()))
        };
        let joints = [Joint::revolute(axis), Joint::spherical(), Joint::free()];
        for joint in joints {
            assert_refused(one(joint.clone(), on_axis(&mut random)), "b");
            // The same, seen from a body frame that is elsewhere.
            let frame = Pose::new(random.rotation(), random.direction() * size);
            let placed = on_axis(&mut random).placed(&frame);
            assert_refused(one(joint.clone().on_child(frame), placed), "b");
            // And with more of them welded on along the axis.
            let weld = Joint::fixed().on_child(frame);
            let welded = ModelDescription::new("welded")
                .body("b", None, joint, on_axis(&mut random))
                .body(
                    "c",
                    Some("b"),
                    weld.clone(),
                    on_axis(&mut random).placed(&frame),
                )
                .body(
                    "d",
                    Some("c"),
                    Joint::fixed().at(frame),
                    on_axis(&mut random),
                );
            assert_refused(welded.build(), "b");
        }
    }
    // All but along a coordinate axis, where the smallest pivot may come first.
    for exponent in 1..16 {
        let slight = 10.0_f64.powi(-exponent);
        for axis in [
            DVec3::new(1.0, slight, 0.0),
            DVec3::new(slight, 1.0, slight),
            DVec3::new(0.0, -slight, 1.0),
        ] {
            assert_refused(one(Joint::spherical(), point(axis)), "b");
        }
    }
}

/// A moment of 1e-12 of the others is small, and is one.
#[test]
fn thin_rods_resist_all_turns() {
    // About its end a rod has m l^2 / 3 across and m r^2 / 2 along.
    let thin = MassProperties::rod(0.7, 1.0, (2e-12_f64 / 3.0).sqrt());
    let mut random = Random::new(12);
    for case in 0..1000 {
        let rotation = random.rotation();
        let frame = if case == 0 {
            Pose::IDENTITY
        } else {
            Pose::from_rotation(rotation)
        };
        let rod = thin.placed(&frame);
        let along = frame.rotation * DVec3::Z;
        for joint in [Joint::revolute(along), Joint::spherical(), Joint::free()] {
            one(joint, rod).unwrap();
        }
        for joint in [Joint::revolute(DVec3::Z), Joint::spherical(), Joint::free()] {
            one(joint.on_child(frame), rod).unwrap();
        }
    }
}

/// `a`, without mass, carries `b` by `second`.
fn pair(first: Joint, second: Joint, between: MassProperties) -> ModelDescription {
    ModelDescription::new("pair")
        .body("a", None, first, between)
        .body("b", Some("a"), second, rod())
}

/// Whether the last body stays where it is when both joints move oppositely, or alike: then the
/// first joint never feels its mass.
fn is_undone(first: &Joint, second: &Joint, random: &mut Random) -> bool {
    let heavy = pair(first.clone(), second.clone(), rod()).build().unwrap();
    [1.0, -1.0].into_iter().any(|sign| {
        (0..3).all(|_| {
            let state = State::random(&heavy, random.below(1 << 20) as u64);
            let place = |by: f64| {
                let q = [state.q[0] + by, state.q[1] + sign * by];
                common::body_placements(&heavy, &q)[1]
            };
            let (before, after) = (place(0.0), place(0.7));
            before.abs_diff_eq(after, 1e-12)
        })
    })
}

/// Two joints of one motion with nothing between: what one does the other undoes.
#[test]
fn joints_that_undo_each_other_need_inertia_between() {
    let mut random = Random::new(13);
    let mut refused = 0;
    for case in 0..2000 {
        let axis = random.direction();
        // The joint frame on `a` from which the second starts, and its axis in it.
        let (mut tilt, mut shift) = (random.rotation(), axis * random.symmetric());
        let mut other = tilt.inverse() * axis * if case % 2 == 0 { 1.0 } else { -3.0 };
        match case % 5 {
            0 => shift += axis.any_orthonormal_vector() * 1e-4,
            1 => other += other.any_orthonormal_vector() * 1e-4,
            2 => tilt = random.rotation(),
            _ => {}
        }
        let on_first = random_pose(&mut random);
        let of = |kind, axis| {
            Joint::new(match kind {
                0 => JointKind::Revolute { axis },
                _ => JointKind::Prismatic { axis },
            })
        };
        let first = of(random.below(2), axis).on_child(on_first);
        let second = of(random.below(2), other)
            .at(on_first * Pose::new(tilt, shift))
            .on_child(random_pose(&mut random));
        let light = pair(first.clone(), second.clone(), MassProperties::MASSLESS);
        if is_undone(&first, &second, &mut random) {
            refused += 1;
            assert_refused(light.build(), "a");
        } else {
            light.build().unwrap();
        }
    }
    assert!((500..1500).contains(&refused), "{refused}");
}

#[test]
fn the_motion_of_a_massless_body_must_be_resisted_somewhere() {
    let none = MassProperties::MASSLESS;
    let hinge = || Joint::revolute(DVec3::X);
    let start = || ModelDescription::new("m").body("a", None, hinge(), none);
    let at = |x, y| Pose::from_translation(DVec3::new(x, y, 0.0));

    // A free body does not feel what carries it.
    assert_refused(
        start().body("b", Some("a"), Joint::free(), rod()).build(),
        "a",
    );
    for first in [
        Joint::prismatic(DVec3::X),
        Joint::spherical(),
        Joint::free(),
    ] {
        assert_refused(pair(first, Joint::free(), none).build(), "a");
    }
    // A ball on the axis turns back.
    let ball = |placement| start().body("b", Some("a"), Joint::spherical().at(placement), rod());
    assert_refused(ball(at(0.3, 0.0)).build(), "a");
    ball(at(0.3, 0.1)).build().unwrap();
    // The same joint, carried by a weld.
    let welded = |placement| {
        start()
            .body("w", Some("a"), Joint::fixed().at(placement), none)
            .body("b", Some("w"), hinge(), rod())
    };
    assert_refused(welded(at(0.3, 0.0)).build(), "a");
    welded(at(0.3, 0.1)).build().unwrap();
    // A second load that resists is enough, however it hangs; one of the same axis is not.
    let two = |joint| {
        start()
            .body("b", Some("a"), hinge(), rod())
            .body("c", Some("a"), joint, rod())
            .build()
    };
    two(Joint::revolute(DVec3::Y)).unwrap();
    two(Joint::fixed()).unwrap();
    assert_refused(two(hinge()), "a");
    // The lower of two light hinges has a load; the upper has only the lower's motion.
    let three = start().body("b", Some("a"), hinge(), none).body(
        "c",
        Some("b"),
        Joint::revolute(DVec3::Y),
        rod(),
    );
    assert_refused(three.build(), "a");
    // Inertia of its own, however little, is for the solvers to judge.
    let little = MassProperties {
        inertia: DMat3::from_diagonal(DVec3::splat(1e-17)),
        ..none
    };
    pair(hinge(), hinge(), little).build().unwrap();
}

/// What sees at a glance that all is well agrees with what puts every cluster together.
#[test]
fn models_are_built_of_which_nothing_is_wrong() {
    let mut random = Random::new(11);
    let (mut refused, mut built) = (0, 0);
    for seed in 0..300 {
        let tree = generate::random_tree(&generate::RandomTree::mixed(8), seed).unwrap();
        let mut description = tree.describe();
        for body in &mut description.bodies {
            match random.below(6) {
                0 => body.mass = MassProperties::MASSLESS,
                1 => body.mass.inertia = DMat3::ZERO,
                2 => body.joint.kind = JointKind::Fixed,
                _ => {}
            }
        }
        let problems = description.problems();
        let result = description.build();
        assert_eq!(result.is_ok(), problems.is_empty(), "seed {seed}");
        built += usize::from(result.is_ok());
        let is_massless = |problem: &ModelError| matches!(problem, ModelError::MasslessBody { .. });
        refused += usize::from(problems.first().is_some_and(is_massless));
    }
    assert!(built > 30 && refused > 30, "{built} {refused}");
}
