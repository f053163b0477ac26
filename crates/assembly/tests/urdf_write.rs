//! Models written as URDF and read again are the same to the last bit.

#![cfg(feature = "urdf")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat3, DVec3};
use vertebra_assembly::urdf::{self, Options, WriteError, write};
use vertebra_assembly::{
    Closure, Joint, JointLimits, MassProperties, Mimic, Model, ModelDescription, Random, Spring,
    generate,
};
use vertebra_spatial::Pose;

fn pose(random: &mut Random) -> Pose {
    let translation = DVec3::from_array([(); 3].map(|()| random.symmetric()));
    Pose::new(random.rotation(), translation)
}

/// A tree of joints that URDF has, in random places, with everything that URDF states of them.
fn random_model(count: usize, seed: u64) -> Model {
    let mut random = Random::new(seed);
    let mut description = ModelDescription::new("a <b> & \"c\"");
    for index in 0..count {
        let pick = 0.5 * (random.symmetric() + 1.0);
        let axis = random.direction();
        let mut joint = match index % 4 {
            0 | 1 => Joint::revolute(axis),
            2 => Joint::prismatic(axis),
            _ => Joint::free(),
        }
        .at(pose(&mut random));
        if index % 4 != 3 {
            joint.damping = f64::from(pick > 0.3) * pick;
            joint.friction = f64::from(pick > 0.6) * pick;
            joint.limits = (pick > 0.5).then(|| JointLimits {
                position: (index % 4 == 2 || pick > 0.7).then_some([-pick, 1.0 / pick]),
                velocity: (pick > 0.8).then_some(3.0 * pick),
                effort: (pick < 0.8).then_some(1e-9 * pick),
                ..JointLimits::default()
            });
            joint.mimic = (index > 4 && pick > 0.9).then(|| Mimic {
                body: "body & 0".to_owned(),
                multiplier: -pick,
                offset: 1e10 * pick,
            });
        }
        let rotation = DMat3::from_quat(random.rotation());
        let mass = MassProperties {
            mass: 0.1 + pick,
            center: random.direction() * 0.3,
            inertia: {
                let m = rotation
                    * DMat3::from_diagonal(DVec3::new(1.0, 1.5, 2.0))
                    * rotation.transpose();
                0.5 * (m + m.transpose())
            },
        };
        // Every eighth body starts a tree of its own.
        let parent = (index % 8 != 0).then(|| format!("body & {}", index / 2));
        description = description.body(format!("body & {index}"), parent.as_deref(), joint, mass);
        let place = pose(&mut random);
        let carrier = (index % 3 != 0).then(|| format!("body & {index}"));
        description = description.frame(format!("<{index}>"), carrier.as_deref(), place);
    }
    description.build().unwrap()
}

/// Bodies and frames in the order of their names.
fn sorted(mut description: ModelDescription) -> ModelDescription {
    description.bodies.sort_by(|a, b| a.name.cmp(&b.name));
    description.frames.sort_by(|a, b| a.name.cmp(&b.name));
    description
}

#[test]
fn what_is_written_is_read_to_the_last_bit() {
    for (count, seed) in (5..65).step_by(3).zip(0..) {
        let model = random_model(count, seed);
        let text = write(&model).unwrap();
        let again = urdf::parse(&text, &Options::default()).unwrap();
        assert!(again.ignored.is_empty(), "{:?}", again.ignored);
        let mut expected = model.describe();
        // The root link stands for the world.
        expected = expected.frame("world", None, Pose::IDENTITY);
        assert_eq!(sorted(again.model.describe()), sorted(expected));
        // Once more: now nothing is added.
        let third = urdf::parse(&write(&again.model).unwrap(), &Options::default()).unwrap();
        assert_eq!(
            sorted(third.model.describe()),
            sorted(again.model.describe())
        );
    }
}

#[test]
fn a_file_comes_back_as_it_was() {
    let text = include_str!("../../vertebra/examples/gripper.urdf");
    let robot = urdf::parse(text, &Options::default()).unwrap();
    let again = urdf::parse(&write(&robot.model).unwrap(), &Options::default()).unwrap();
    assert_eq!(
        sorted(robot.model.describe()),
        sorted(again.model.describe())
    );
    assert_eq!(robot.model.describe().bodies, again.model.describe().bodies);
}

#[test]
fn fixed_bodies_come_back_as_bodies_where_they_are_kept() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let model = ModelDescription::new("welded")
        .body("arm", None, Joint::revolute(DVec3::X), rod)
        .body(
            "tool",
            Some("arm"),
            Joint::fixed().at(Pose::from_translation(DVec3::Z)),
            rod,
        )
        .build()
        .unwrap();
    let text = write(&model).unwrap();
    let again = urdf::parse(&text, &Options::default().keep_fixed())
        .unwrap()
        .model;
    let tool = again.find("tool").and_then(|id| again.body(id)).unwrap();
    assert_eq!(tool.joint, model.bodies()[1].joint);
    assert_eq!(tool.mass, rod);
}

#[test]
fn angles_written_by_people_need_no_quaternion() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    for rpy in ["0.1 -0.25 3.141592", "1.570796 0 -1.5", "0.3 0.7 2"] {
        let text = format!(
            r#"<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
            <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
            <joint name="j" type="continuous"><parent link="a"/><child link="b"/>
            <origin rpy="{rpy}"/></joint></robot>"#
        );
        let model = urdf::parse(&text, &Options::default()).unwrap().model;
        assert!(!write(&model).unwrap().contains("quaternion"), "{rpy}");
    }
    // Near the pole, where roll and yaw are one turn, the quaternion carries the bits.
    let turned = glam::DQuat::from_rotation_y(quarter) * glam::DQuat::from_rotation_x(0.4);
    let model = ModelDescription::new("pole")
        .body(
            "b",
            None,
            Joint::revolute(DVec3::X).at(Pose::from_rotation(turned)),
            rod,
        )
        .build()
        .unwrap();
    let again = urdf::parse(&write(&model).unwrap(), &Options::default())
        .unwrap()
        .model;
    assert_eq!(again.bodies()[0].joint, model.bodies()[0].joint);
}

#[test]
fn a_quaternion_that_contradicts_the_angles_does_not_count() {
    let model = random_model(5, 3);
    let text = write(&model).unwrap();
    // Someone edits the angles by hand: they win.
    let start = text.find(" rpy=\"").unwrap() + 6;
    let end = start + text[start..].find('"').unwrap();
    let edited = format!("{}0 0 0{}", &text[..start], &text[end..]);
    let again = urdf::parse(&edited, &Options::default()).unwrap().model;
    let rotations = |m: &Model| {
        sorted(m.describe())
            .bodies
            .iter()
            .map(|b| b.joint.parent_placement.rotation)
            .collect::<Vec<_>>()
    };
    let differences = rotations(&again)
        .iter()
        .zip(rotations(&model))
        .filter(|(a, b)| **a != *b)
        .count();
    assert_eq!(differences, 1);
}

#[test]
fn what_urdf_cannot_state_is_named() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let ball = generate::chain(3, &Joint::spherical(), &generate::Rod::default()).unwrap();
    assert!(matches!(
        write(&ball),
        Err(WriteError::JointKind {
            kind: "spherical",
            ..
        })
    ));
    let one = |name: &str, joint: Joint| {
        ModelDescription::new("m")
            .body(name, None, joint, rod)
            .build()
            .unwrap()
    };
    let off = Joint::revolute(DVec3::X).on_child(Pose::from_translation(DVec3::X));
    assert_eq!(
        write(&one("b", off)),
        Err(WriteError::ChildPlacement {
            body: "b".to_owned()
        })
    );
    let damped = Joint {
        damping: 1.0,
        ..Joint::free()
    };
    assert_eq!(
        write(&one("b", damped)),
        Err(WriteError::Property {
            body: "b".to_owned(),
            property: "damping"
        })
    );
    let sprung = Joint {
        spring: Some(Spring::at(1.0, 0.0)),
        ..Joint::revolute(DVec3::X)
    };
    assert_eq!(
        write(&one("b", sprung)),
        Err(WriteError::Property {
            body: "b".to_owned(),
            property: "a spring"
        })
    );
    for name in ["a\u{0}b", "$(arg)", "x${y}"] {
        let error = write(&one(name, Joint::free())).unwrap_err();
        assert_eq!(
            error,
            WriteError::Name {
                name: name.to_owned()
            }
        );
        assert!(error.to_string().contains("rename"));
    }
}

/// Couplings are mimics there; of what is more than that, and of loops, nothing is dropped.
#[test]
fn couplings_are_written_and_loops_are_named() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let hinge = |x: f64| Joint::revolute(DVec3::Y).at(Pose::from_translation(DVec3::X * x));
    let gears = ModelDescription::new("gears")
        .body("a", None, hinge(0.0), rod)
        .body("b", None, hinge(0.5), rod)
        .body("c", None, hinge(1.0), rod)
        .couple("ab", "a", "b", -1.0 / 3.0, 0.1)
        .couple("cb", "c", "b", 0.7, 1e-9);
    let text = write(&gears.clone().build().unwrap()).unwrap();
    let again = urdf::parse(&text, &Options::default()).unwrap().model;
    let law = |model: &Model| {
        let found = model.couplings();
        let found = found.map(|c| (c.body, c.other, c.ratio.to_bits(), c.offset.to_bits()));
        found.collect::<Vec<_>>()
    };
    assert_eq!(law(&again), law(&gears.clone().build().unwrap()));
    assert_eq!(law(&again).len(), 2);

    let twice = gears.clone().couple("ac", "a", "c", 2.0, 0.0);
    let error = write(&twice.build().unwrap()).unwrap_err();
    let (name, body) = ("ac".to_owned(), "a".to_owned());
    assert_eq!(error, WriteError::Coupling { name, body });
    let mut mimicking = gears.clone();
    mimicking.bodies[2].joint.mimic = Some(Mimic {
        body: "a".to_owned(),
        multiplier: 1.0,
        offset: 0.0,
    });
    let error = write(&mimicking.build().unwrap()).unwrap_err();
    let (name, body) = ("cb".to_owned(), "c".to_owned());
    assert_eq!(error, WriteError::Coupling { name, body });

    let tips = [Pose::from_translation(DVec3::Z); 2];
    let closed = gears.close("tips", [Some("a"), Some("b")], tips, Closure::Ball);
    let error = write(&closed.build().unwrap()).unwrap_err();
    let name = "tips".to_owned();
    assert_eq!(error, WriteError::Loop { name });
}

/// What the parser of ROS (urdfdom) demands: a `<limit>` of revolute and prismatic joints, effort and velocity of
/// every one, and bounds, which it takes for zero where they are left out.
#[test]
fn limits_are_stated_as_ros_demands_them() {
    let mut seen = [0; 3];
    for seed in 0..10 {
        let text = write(&random_model(60, seed)).unwrap();
        let document = vertebra_assembly::xml::document(&text).unwrap();
        let joints = document
            .root_element()
            .children()
            .filter(|node| node.has_tag_name("joint"));
        for joint in joints {
            let limit = joint.children().find(|node| node.has_tag_name("limit"));
            let states = |attribute: &str| {
                let value = limit.and_then(|limit| limit.attribute(attribute));
                value.is_some_and(|value| value.parse::<f64>().is_ok_and(f64::is_finite))
            };
            let is_bounded = states("effort") && states("velocity");
            let has_range = states("lower") && states("upper");
            match joint.attribute("type").unwrap() {
                "revolute" => assert!(is_bounded && has_range, "{seed}: {joint:?}"),
                "prismatic" => {
                    assert!(is_bounded && has_range, "{seed}: {joint:?}");
                    let lower = limit.unwrap().attribute("lower");
                    seen[usize::from(lower == Some("-1e16"))] += 1;
                }
                _ => {
                    assert!(limit.is_none() || is_bounded, "{seed}: {joint:?}");
                    seen[2] += 1;
                }
            }
        }
    }
    // Slides with a range, slides without one, joints of other types.
    assert!(seen.iter().all(|&count| count > 10), "{seen:?}");
}

/// A bound that stands for none cannot be stated; one-sided ranges can.
#[test]
fn bounds_without_end_are_told_from_none() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let with = |limits: JointLimits| {
        let joint = Joint {
            limits: Some(limits),
            ..Joint::prismatic(DVec3::X)
        };
        ModelDescription::new("m")
            .body("b", None, joint, rod)
            .build()
            .unwrap()
    };
    let limits = JointLimits::default();
    for beyond in [
        JointLimits {
            effort: Some(1e16),
            ..limits
        },
        JointLimits {
            velocity: Some(f64::MAX),
            ..limits
        },
        JointLimits {
            position: Some([-1e17, 1e16]),
            ..limits
        },
    ] {
        let error = write(&with(beyond)).unwrap_err().to_string();
        assert!(
            error.contains("a bound of 1e16 or more") && error.contains("`b`"),
            "{error}"
        );
    }
    for kept in [
        JointLimits {
            position: Some([0.0, f64::MAX]),
            ..limits
        },
        JointLimits {
            position: Some([-1e16, 2.0]),
            effort: Some(9.9e15),
            ..limits
        },
        limits,
    ] {
        let model = with(kept);
        let again = urdf::parse(&write(&model).unwrap(), &Options::default()).unwrap();
        assert_eq!(again.model.bodies()[0].joint, model.bodies()[0].joint);
    }
    // Limits that state nothing are none.
    assert_eq!(with(limits).bodies()[0].joint.limits, None);
}
