//! Models and states: every way in which one can be wrong.
#![expect(
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use glam::{DMat3, DQuat, DVec3};
use vertebra_assembly::{
    InertiaViolation, Joint, JointLimits, MassProperties, Mimic, ModelDescription, ModelError,
    Random, State,
};
use vertebra_spatial::Pose;

fn rod() -> MassProperties {
    MassProperties::rod(1.0, 0.5, 0.02)
}

/// Two bodies and a frame, with every number there is.
fn two_bodies() -> ModelDescription {
    let mut lower = Joint::revolute(DVec3::Y)
        .at(Pose::from_translation(DVec3::new(0.0, 0.0, 0.5)))
        .on_child(Pose::from_translation(DVec3::new(0.1, 0.0, 0.0)));
    lower.limits = Some(JointLimits {
        position: Some([-1.0, 1.0]),
        velocity: Some(2.0),
        effort: Some(3.0),
        ..JointLimits::default()
    });
    lower.damping = 0.1;
    lower.friction = 0.2;
    lower.mimic = Some(Mimic {
        body: "upper".to_owned(),
        multiplier: 2.0,
        offset: 0.5,
    });
    ModelDescription::new("arm")
        .body("upper", None, Joint::prismatic(DVec3::X), rod())
        .body("lower", Some("upper"), lower, rod())
        .frame("tool", Some("lower"), Pose::IDENTITY)
}

fn refusal(change: impl FnOnce(&mut ModelDescription)) -> ModelError {
    let mut description = two_bodies();
    change(&mut description);
    match description.build() {
        Err(error) => error,
        Ok(model) => panic!("this was accepted: {:?}", model.describe()),
    }
}

fn with_mass(mass: MassProperties) -> ModelError {
    refusal(|d| d.bodies[1].mass = mass)
}

#[test]
fn the_base_of_these_tests_is_right() {
    let model = two_bodies().build().unwrap();
    assert_eq!(model.dof_count(), 2);
    // The largest speed.
    assert_eq!(model.not_simulated().len(), 1);
    assert_eq!(model.couplings().count(), 1);
    assert_eq!(model.frames()[0].body, model.find("lower"));
}

#[test]
fn no_number_may_be_missing_or_infinite() {
    type Change = fn(&mut ModelDescription, f64);
    let changes: [(&str, &str, Change); 26] = [
        ("gravity", "arm", |d, x| d.gravity.z = x),
        ("joint axis", "upper", |d, x| {
            d.bodies[0].joint = Joint::prismatic(DVec3::new(0.0, x, 1.0));
        }),
        ("joint axis", "lower", |d, x| {
            d.bodies[1].joint = Joint::revolute(DVec3::new(0.0, 1.0, x));
        }),
        ("joint placement on the parent", "lower", |d, x| {
            d.bodies[1].joint.parent_placement.translation.x = x;
        }),
        ("joint placement on the parent", "lower", |d, x| {
            d.bodies[1].joint.parent_placement.rotation.w = x;
        }),
        ("joint placement on the body", "lower", |d, x| {
            d.bodies[1].joint.child_placement.translation.y = x;
        }),
        ("joint placement on the body", "lower", |d, x| {
            d.bodies[1].joint.child_placement.rotation.x = x;
        }),
        ("joint damping", "lower", |d, x| {
            d.bodies[1].joint.damping = x;
        }),
        ("joint friction", "lower", |d, x| {
            d.bodies[1].joint.friction = x;
        }),
        ("joint position limit", "lower", |d, x| {
            limits(d).position = Some([x, 1.0]);
        }),
        ("joint position limit", "lower", |d, x| {
            limits(d).position = Some([0.0, x]);
        }),
        ("joint velocity limit", "lower", |d, x| {
            limits(d).velocity = Some(x);
        }),
        ("joint effort limit", "lower", |d, x| {
            limits(d).effort = Some(x);
        }),
        ("mimic multiplier", "lower", |d, x| mimic(d).multiplier = x),
        ("mimic offset", "lower", |d, x| mimic(d).offset = x),
        ("mass", "lower", |d, x| d.bodies[1].mass.mass = x),
        ("centre of mass", "upper", |d, x| {
            d.bodies[0].mass.center.x = x;
        }),
        ("centre of mass", "upper", |d, x| {
            d.bodies[0].mass.center.z = x;
        }),
        ("inertia", "lower", |d, x| {
            d.bodies[1].mass.inertia.x_axis.x = x;
        }),
        ("inertia", "lower", |d, x| {
            d.bodies[1].mass.inertia.x_axis.y = x;
        }),
        ("inertia", "lower", |d, x| {
            d.bodies[1].mass.inertia.y_axis.x = x;
        }),
        ("inertia", "lower", |d, x| {
            d.bodies[1].mass.inertia.z_axis.y = x;
        }),
        ("inertia", "lower", |d, x| {
            d.bodies[1].mass.inertia.z_axis.z = x;
        }),
        ("placement", "tool", |d, x| {
            d.frames[0].placement.translation.z = x;
        }),
        ("placement", "tool", |d, x| {
            d.frames[0].placement.rotation.x = x;
        }),
        ("placement", "tool", |d, x| {
            d.frames[0].placement.rotation.z = x;
        }),
    ];
    for (quantity, element, change) in changes {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            match refusal(|d| change(d, bad)) {
                ModelError::NonFinite {
                    quantity: found,
                    element: at,
                    value,
                } => {
                    assert_eq!((found, at.as_str()), (quantity, element));
                    assert_eq!(value.to_bits(), bad.to_bits());
                }
                // An infinite length is also an absurd one; either name is right.
                ModelError::AbsurdSize {
                    quantity: found, ..
                } => assert_eq!(found, quantity),
                other => panic!("{quantity} of {element}: {other:?}"),
            }
        }
    }
}

fn limits(description: &mut ModelDescription) -> &mut JointLimits {
    description.bodies[1].joint.limits.as_mut().unwrap()
}

fn mimic(description: &mut ModelDescription) -> &mut Mimic {
    description.bodies[1].joint.mimic.as_mut().unwrap()
}

#[test]
fn names_and_references_are_checked() {
    let name = |name: &str| ModelError::DuplicateName {
        name: name.to_owned(),
    };
    assert_eq!(
        refusal(|d| d.bodies[1].name = "upper".into()),
        name("upper")
    );
    assert_eq!(
        refusal(|d| d.frames[0].name = "upper".into()),
        name("upper")
    );
    assert_eq!(
        refusal(|d| d.frames.push(d.frames[0].clone())),
        name("tool")
    );
    let empty = |what, index| ModelError::EmptyName { what, index };
    assert_eq!(refusal(|d| d.bodies[1].name.clear()), empty("body", 1));
    assert_eq!(refusal(|d| d.frames[0].name.clear()), empty("frame", 0));
    assert_eq!(
        refusal(|d| d.bodies[1].parent = Some("upperr".into())),
        ModelError::UnknownParent {
            body: "lower".into(),
            parent: "upperr".into(),
            meant: Some("upper".into())
        }
    );
    let unknown = |user: &str| ModelError::UnknownBody {
        user: user.into(),
        body: "hand".into(),
        meant: None,
    };
    assert_eq!(
        refusal(|d| d.frames[0].body = Some("hand".into())),
        unknown("tool")
    );
    assert_eq!(refusal(|d| mimic(d).body = "hand".into()), unknown("lower"));
    assert_eq!(
        ModelDescription::new("void").build().unwrap_err(),
        ModelError::Empty {
            model: "void".into()
        }
    );
    assert_eq!(
        refusal(|d| d.version = 2),
        ModelError::UnsupportedVersion {
            what: "model",
            found: 2,
            supported: 1
        }
    );
}

#[test]
fn cycles_are_found_on_the_cycle() {
    assert_eq!(
        refusal(|d| d.bodies[0].parent = Some("upper".into())),
        ModelError::Cycle {
            body: "upper".into()
        }
    );
    // A long tail hangs from a cycle of three: the error names one of the three.
    let ring = Joint::revolute(DVec3::X);
    let mut description = ModelDescription::new("ring").body("root", None, ring.clone(), rod());
    for index in 0..50 {
        let parent = format!("tail-{}", index + 1);
        description = description.body(
            format!("tail-{index}"),
            Some(if index == 49 { "a" } else { &parent }),
            ring.clone(),
            rod(),
        );
    }
    for (name, parent) in [("a", "b"), ("b", "c"), ("c", "a")] {
        description = description.body(name, Some(parent), ring.clone(), rod());
    }
    match description.build().unwrap_err() {
        ModelError::Cycle { body } => assert!(["a", "b", "c"].contains(&body.as_str()), "{body}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn axes_and_quaternions_are_directions() {
    let zero = ModelError::ZeroAxis {
        body: "lower".into(),
    };
    for axis in [DVec3::ZERO, DVec3::new(-0.0, 0.0, -0.0)] {
        assert_eq!(refusal(|d| d.bodies[1].joint = Joint::revolute(axis)), zero);
        assert_eq!(
            refusal(|d| d.bodies[1].joint = Joint::prismatic(axis)),
            zero
        );
    }
    // Any other length does, down to the smallest and up to the largest number.
    for length in [5e-324, 1e-200, 0.1, 7.0, 1e200, f64::MAX] {
        let mut description = two_bodies();
        description.bodies[1].joint = Joint::revolute(DVec3::new(0.0, length, 0.0));
        let model = description.build().unwrap();
        assert_eq!(
            model.bodies()[1].joint.kind,
            Joint::revolute(DVec3::Y).kind,
            "{length:e}"
        );
    }
    for quaternion in [
        DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        DQuat::from_xyzw(0.0, 0.0, 0.0, 1.001),
        DQuat::from_xyzw(1.0, 1.0, 0.0, 0.0),
    ] {
        let pose = Pose::from_rotation(quaternion);
        for error in [
            refusal(|d| d.bodies[1].joint.parent_placement = pose),
            refusal(|d| d.bodies[1].joint.child_placement = pose),
            refusal(|d| d.frames[0].placement = pose),
        ] {
            assert!(
                matches!(error, ModelError::NonUnitQuaternion { length, .. } if length == quaternion.length()),
                "{error:?}"
            );
        }
    }
}

#[test]
fn absurd_sizes_are_refused() {
    for size in [1e101, 1e-101, 5e-324, f64::MAX] {
        let absurd = |error| {
            assert!(
                matches!(error, ModelError::AbsurdSize { value, .. } if value == size),
                "{error:?}"
            );
        };
        absurd(refusal(|d| d.bodies[1].mass.mass = size));
        absurd(refusal(|d| d.bodies[1].mass.center = DVec3::splat(-size)));
        absurd(with_mass(MassProperties {
            inertia: DMat3::from_diagonal(DVec3::splat(size)),
            ..rod()
        }));
        absurd(refusal(|d| {
            d.bodies[1].joint.parent_placement.translation = DVec3::splat(size);
        }));
        absurd(refusal(|d| {
            d.frames[0].placement.translation = DVec3::splat(-size);
        }));
    }
    for size in [1e101, 1e-101] {
        let error = refusal(|d| d.gravity.z = -size);
        assert!(
            matches!(&error, ModelError::AbsurdSize { quantity: "gravity", element, value }
                if element == "arm" && *value == size),
            "{error:?}"
        );
    }
    // A protein in SI and a moon are not absurd.
    for size in [1e-26, 1e22] {
        let mut description = two_bodies();
        for body in &mut description.bodies {
            body.mass = MassProperties::sphere(size, size.cbrt());
        }
        description.build().unwrap();
    }
}

#[test]
fn inertias_must_be_possible() {
    let name = || "lower".to_owned();
    assert_eq!(
        with_mass(MassProperties {
            mass: -1.0,
            ..rod()
        }),
        ModelError::NegativeMass {
            body: name(),
            mass: -1.0
        }
    );
    let mut skew = rod();
    skew.inertia.x_axis.y = 1e-3;
    assert_eq!(
        with_mass(skew),
        ModelError::AsymmetricInertia { body: name() }
    );
    let mut random = Random::new(5);
    for _ in 0..200 {
        // The triangle inequality decides in any axes, from 1e-5 past its edge on either side;
        // a slack of 1e-6 of the trace lets rounded files through.
        let (a, b) = (0.1 + random.unit(), 0.1 + random.unit());
        let rotation = DMat3::from_quat(random.rotation());
        let turned = |moments: DVec3| {
            let inertia = rotation * DMat3::from_diagonal(moments) * rotation.transpose();
            MassProperties {
                mass: 1.0,
                center: DVec3::ZERO,
                inertia: 0.5 * (inertia + inertia.transpose()),
            }
        };
        let sum = a + b;
        assert_eq!(turned(DVec3::new(a, b, sum)).violation(), None);
        assert_eq!(
            turned(DVec3::new(a, b, sum * (1.0 + 1e-8))).violation(),
            None
        );
        assert_eq!(
            with_mass(turned(DVec3::new(a, b, sum * (1.0 + 1e-5)))),
            ModelError::NonPhysicalInertia {
                body: name(),
                reason: InertiaViolation::TriangleInequality
            }
        );
        assert_eq!(
            turned(DVec3::new(0.0, a, a)).violation(),
            None,
            "a thin rod"
        );
        assert_eq!(
            with_mass(turned(DVec3::new(-1e-5 * a, a, a))),
            ModelError::NonPhysicalInertia {
                body: name(),
                reason: InertiaViolation::NotPositiveSemidefinite
            }
        );
    }
    // Dust that exporters leave where they mean zero.
    let mut dust = MassProperties {
        mass: 1.3,
        center: DVec3::new(0.02, -0.1, 0.0),
        inertia: DMat3::ZERO,
    };
    dust.inertia.x_axis.z = 2.4e-35;
    dust.inertia.z_axis.x = 2.4e-35;
    assert_eq!(dust.violation(), None);
    dust.inertia.x_axis.z = 1e-9;
    dust.inertia.z_axis.x = 1e-9;
    assert!(dust.violation().is_some());
}

#[test]
fn limits_must_be_possible() {
    assert_eq!(
        refusal(|d| limits(d).position = Some([0.5, -0.5])),
        ModelError::EmptyRange {
            body: "lower".into(),
            lower: 0.5,
            upper: -0.5
        }
    );
    type Change = fn(&mut ModelDescription, f64);
    let changes: [(&str, Change); 4] = [
        ("joint velocity limit", |d, x| limits(d).velocity = Some(x)),
        ("joint effort limit", |d, x| limits(d).effort = Some(x)),
        ("joint damping", |d, x| d.bodies[1].joint.damping = x),
        ("joint friction", |d, x| d.bodies[1].joint.friction = x),
    ];
    for (quantity, change) in changes {
        for value in [-1.0, -5e-324] {
            let body = "lower".to_owned();
            assert_eq!(
                refusal(|d| change(d, value)),
                ModelError::Negative {
                    quantity,
                    body,
                    value
                }
            );
        }
        for value in [0.0, -0.0, f64::MAX] {
            let mut description = two_bodies();
            change(&mut description, value);
            description.build().unwrap();
        }
    }
    let mut locked = two_bodies();
    limits(&mut locked).position = Some([0.5, 0.5]);
    locked.build().unwrap();
}

#[test]
fn bodies_and_frames_are_found_by_name() {
    let model = two_bodies().build().unwrap();
    assert_eq!(model.find_frame("tool"), Some(&model.frames()[0]));
    assert_eq!(model.find_frame("lower"), None, "a body is no frame");
    assert_eq!(model.find("tool"), None, "a frame is no body");
}

#[test]
fn states_are_checked() {
    let model = ModelDescription::new("m")
        .body("ball", None, Joint::spherical(), rod())
        .body("float", None, Joint::free(), rod())
        .build()
        .unwrap();
    let refused = |change: fn(&mut State)| {
        let mut state = State::neutral(&model);
        change(&mut state);
        state.check(&model).unwrap_err()
    };
    let length = |quantity, expected, found| ModelError::WrongLength {
        quantity,
        expected,
        found,
    };
    assert_eq!(refused(|s| s.q.truncate(10)), length("positions q", 11, 10));
    assert_eq!(refused(|s| s.qd.push(0.0)), length("rates qd", 9, 10));
    for (index, body) in [(2, "ball"), (4, "float"), (10, "float")] {
        let mut state = State::neutral(&model);
        state.q[index] = f64::NAN;
        let error = state.check(&model).unwrap_err();
        assert!(
            matches!(&error, ModelError::NonFinite { element, .. } if element == body),
            "{error:?}"
        );
    }
    assert!(matches!(
        refused(|s| s.qd[8] = f64::INFINITY),
        ModelError::NonFinite {
            quantity: "joint rate",
            ..
        }
    ));
    assert!(matches!(
        refused(|s| s.time = f64::NAN),
        ModelError::NonFinite {
            quantity: "time",
            ..
        }
    ));
    for change in [|s: &mut State| s.q[3] = 0.0, |s: &mut State| s.q[10] = 1.1] {
        assert!(matches!(
            refused(change),
            ModelError::NonUnitQuaternion { .. }
        ));
    }
}

#[test]
fn bad_input_leaves_the_message_readable() {
    let error = refusal(|d| d.bodies[1].parent = Some("upperr".into()));
    assert_eq!(
        error.to_string(),
        "body `lower` names the parent `upperr`, which is not a body of the model (is `upper` meant?); \
         add it or correct the name"
    );
}
