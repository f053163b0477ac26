//! Builders: all problems at once, each by its name, and solids that are none.

use glam::{DMat3, DQuat, DVec3};
use vertebra_assembly::{
    BallRange, BodyShape, Builder, Centerline, Closure, Joint, MassProperties, ModelDescription,
    ModelError, Problem, SolidError, Spring, Stop,
};
use vertebra_spatial::Pose;

#[test]
fn meshes_that_are_no_solids_are_refused() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let of = |vertices: &[DVec3], triangles: &[[u32; 3]]| {
        BodyShape::mesh(vertices, triangles).mass_properties()
    };
    assert!((of(&corners, &tetrahedron).unwrap().mass - 1000.0 / 6.0).abs() <= 1e-12);
    assert!(matches!(
        of(&corners, &tetrahedron[..3]),
        Err(SolidError::OpenMesh { .. })
    ));
    let mut turned = tetrahedron;
    turned[1] = [0, 3, 1];
    assert!(matches!(
        of(&corners, &turned),
        Err(SolidError::OpenMesh { .. })
    ));
    turned[1] = [0, 1, 9];
    assert!(matches!(
        of(&corners, &turned),
        Err(SolidError::UnknownVertex { vertex: 9, .. })
    ));
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE.with_z(0.0)];
    assert_eq!(of(&flat, &tetrahedron), Err(SolidError::NoVolume));
    assert_eq!(of(&[], &[]), Err(SolidError::NoVolume));
    let nan = [DVec3::NAN, DVec3::X, DVec3::Y, DVec3::Z];
    assert!(matches!(
        of(&nan, &tetrahedron),
        Err(SolidError::NonFiniteVertex { vertex: 0 })
    ));
    for solid in [
        BodyShape::sphere(0.0),
        BodyShape::capsule(1.0, f64::NAN),
        BodyShape::sphere(1.0).of_density(-1.0),
        BodyShape::sphere(1.0).of_mass(f64::INFINITY),
    ] {
        assert!(matches!(
            solid.mass_properties(),
            Err(SolidError::NotPositive { .. })
        ));
    }
}

/// Every mistake is listed, with who made it.
#[test]
fn all_problems_are_named_at_once() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let error = Builder::new("wreck")
        .tag("early")
        .body("a", Joint::revolute(DVec3::ZERO), rod)
        .body("a", Joint::fixed(), BodyShape::sphere(-1.0))
        .from("nowhere")
        .chain("none", 0, Joint::fixed(), rod, Pose::IDENTITY)
        .along_curve(
            "flat",
            &Centerline::polyline([DVec3::X]),
            3,
            Joint::fixed(),
            |_| rod,
        )
        .mirror("m", &Builder::new("empty"), DVec3::ZERO, Pose::IDENTITY)
        .body("b", Joint::prismatic(DVec3::X).with_damping(-1.0), rod)
        .joint_named("j")
        .body(
            "c",
            Joint::spherical().with_spring(Spring::at(1.0, 0.0)),
            rod,
        )
        .joint_named("j")
        .body("d", Joint::screw(DVec3::X, f64::NAN), rod)
        .body("e", Joint::revolute(DVec3::X).with_range(1.0, -1.0), rod)
        .build()
        .unwrap_err();
    let text = error.to_string();
    assert_eq!(error.problems.len(), 13, "{text}");
    for part in [
        "tag a body",
        "length zero",
        "used twice",
        "radius of the sphere",
        "`nowhere`",
        "`none`",
        "`flat`",
        "`m`",
        "damping",
        "spring",
        "`j`",
        "pitch",
        "lower position limit",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    // Joints that move nothing are all named too, once all else is in order.
    let error = Builder::new("light")
        .body("a", Joint::revolute(DVec3::X), MassProperties::MASSLESS)
        .from_world()
        .body("b", Joint::prismatic(DVec3::X), MassProperties::MASSLESS)
        .build()
        .unwrap_err();
    let massless =
        |problem: &Problem| matches!(problem, Problem::Model(ModelError::MasslessBody { .. }));
    assert!(error.problems.len() == 2 && error.problems.iter().all(massless));
    let empty = Builder::new("empty").build().unwrap_err();
    assert!(matches!(
        empty.problems[..],
        [Problem::Model(ModelError::Empty { .. })]
    ));
}

/// What is wrong with loops and couplings is said with all the rest, by the names that inserting gave them.
#[test]
fn loops_are_renamed_and_checked_with_all_the_rest() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let hinge = Joint::revolute(DVec3::Y);
    let part = Builder::new("part")
        .body("a", hinge.clone().with_damping(-1.0), rod)
        .from_world()
        .body("b", Joint::spherical(), rod)
        .close(
            "pin",
            [Some("a"), Some("c")],
            [Pose::IDENTITY; 2],
            Closure::Ball,
        )
        .close(
            "nut",
            [None, Some("b")],
            [Pose::IDENTITY; 2],
            Closure::Distance { length: 0.0 },
        )
        .couple("gears", "a", "b", 2.0, 0.0);
    let whole = Builder::new("whole").attach("left", &part, Pose::IDENTITY);
    let error = whole.build().unwrap_err();
    let text = error.to_string();
    assert_eq!(error.problems.len(), 4, "{text}");
    for said in [
        "`left/a`",
        "`left/pin`",
        "`left/c`",
        "distance",
        "`left/gears`",
    ] {
        assert!(text.contains(said), "{said}: {text}");
    }
}

/// What is wrong with the whole, with a name or with one number hides nothing else that is wrong.
#[test]
fn no_problem_hides_another() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let nowhere = Pose::from_translation(DVec3::new(0.0, 0.0, f64::NAN));
    let stretched = Pose::from_rotation(DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0));
    let full = Joint::screw(DVec3::ZERO, f64::INFINITY)
        .at(nowhere)
        .on_child(stretched)
        .with_damping(-1.0)
        .with_friction(f64::NAN)
        .with_armature(-2.0)
        .with_spring(Spring::turned(-3.0, DQuat::IDENTITY))
        .with_stop(Stop::Hard { restitution: 2.0 })
        .with_range(2.0, 1.0)
        .with_ball_range(BallRange::turn(1.0))
        .with_effort(-4.0);
    let soft = Stop::Soft {
        stiffness: -5.0,
        damping: -6.0,
    };
    let light = MassProperties {
        mass: -7.0,
        center: DVec3::NAN,
        inertia: DMat3::from_cols(DVec3::X, DVec3::X, DVec3::Z),
    };
    let mut description = ModelDescription::new("wreck")
        .gravity(DVec3::NAN)
        .body("full", None, full, rod)
        .body(
            "full",
            None,
            Joint::revolute(DVec3::X).with_stop(soft),
            light,
        )
        .body("ball", None, Joint::spherical().with_range(-1.0, 1.0), rod)
        .body("lost", Some("bal"), Joint::fixed(), rod)
        .frame("mark", Some("fulll"), nowhere)
        .frame("mark", None, Pose::IDENTITY)
        .close(
            "lp",
            [Some("ball"), Some("zz")],
            [Pose::IDENTITY; 2],
            Closure::Ball,
        )
        .close(
            "lp",
            [None; 2],
            [nowhere, stretched],
            Closure::Distance { length: -8.0 },
        )
        .close(
            "",
            [Some("ball"), None],
            [Pose::IDENTITY; 2],
            Closure::Screw {
                axis: DVec3::ZERO,
                pitch: f64::NAN,
            },
        )
        .couple("lp", "ball", "zzz", f64::NAN, f64::INFINITY)
        .couple("own", "lost", "lost", 1.0, 0.0);
    description.version = 9;
    let expected = [
        "version 9",
        "gravity of `wreck`",
        "axis of length zero",
        "joint pitch of `full`",
        "placement on the parent of `full`",
        "placement on the body of `full` has a quaternion of length 2",
        "damping of body `full` is -1",
        "friction of `full` is not finite",
        "armature of body `full` is -2",
        "stiffness of body `full` is -3",
        "the spring in the joint of body `full`",
        "restitution of `full` is 2, which must be between 0 and 1",
        "lower position limit 2 above",
        "only spherical joints have one",
        "effort limit of body `full` is -4",
        "`full` is used twice",
        "stop stiffness of body `full` is -5",
        "stop damping of body `full` is -6",
        "negative mass -7",
        "centre of mass of `full`",
        "inertia of body `full` is not symmetric",
        "the joint of body `ball` is spherical",
        "parent `bal`, which is not a body of the model (is `ball` meant?)",
        "`fulll`, which is not a body of the model (is `full` meant?)",
        "placement of `mark`",
        "`mark` is used twice",
        "`zz`, which",
        "`lp` is used twice",
        "`lp` connects a body to itself",
        "placement on the first body of `lp`",
        "placement on the second body of `lp`",
        "distance of `lp` is -8",
        "loop number 2 has an empty name",
        "pitch of ``",
        "length zero",
        "`lp` is used twice",
        "coupling ratio",
        "coupling offset",
        "`ball`, which has 3 freedoms",
        "`zzz`",
        "`lost`, which has 0 freedoms",
        "`own` connects a body to itself",
    ];
    let problems = description.problems();
    let found: Vec<String> = problems.iter().map(ToString::to_string).collect();
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    let mut left = found.clone();
    for part in expected {
        let place = left.iter().position(|text| text.contains(part));
        assert!(place.is_some(), "{part} in {found:#?}");
        let _ = place.map(|place| left.remove(place));
    }
    assert_eq!(description.build().unwrap_err(), problems[0]);
    // What moves nothing is found beside what is wrong elsewhere.
    let problems = ModelDescription::new("light")
        .gravity(DVec3::NAN)
        .body(
            "a",
            None,
            Joint::revolute(DVec3::X),
            MassProperties::MASSLESS,
        )
        .frame("", None, Pose::IDENTITY)
        .problems();
    assert!(matches!(
        problems[..],
        [
            ModelError::NonFinite { .. },
            ModelError::EmptyName { .. },
            ModelError::MasslessBody { .. }
        ]
    ));
}

/// Slips in sentences are told with what may have been meant.
#[test]
fn slips_in_sentences_are_told() {
    let rod = MassProperties::rod(1.0, 0.5, 0.01);
    let bad = |builder: Builder| builder.build().unwrap_err().to_string();
    let arm = || Builder::new("arm").body("arm", Joint::free(), rod);
    let text = bad(arm().from("amr"));
    assert!(
        text.contains("no body `amr` to go to (is `arm` meant?)"),
        "{text}"
    );
    let forearm = arm().body("forearm", Joint::revolute(DVec3::X), rod);
    let text = bad(forearm.from("forarm").from("leg"));
    assert!(text.contains("(is `forearm` meant?)"), "{text}");
    assert!(text.contains("no body `leg` to go to;"), "{text}");
    for (winding, said) in [
        ((-1.0, 0.1, 0.1), "length of a link of the helix `h` is -1"),
        ((0.0, 0.1, 0.1), "length of a link of the helix `h` is 0"),
        ((1.0, f64::NAN, 0.1), "bend of the helix `h` is NaN"),
        ((1.0, 0.1, f64::INFINITY), "twist of the helix `h` is inf"),
    ] {
        let error = arm().helix("h", 3, Joint::fixed(), rod, winding).build();
        let error = error.unwrap_err();
        assert!(
            matches!(error.problems[..], [Problem::BadHelix { .. }]),
            "{error}"
        );
        assert!(error.to_string().contains(said), "{error}");
    }
    // Axes that are one.
    let slanted = DVec3::new(0.1, 0.2, 0.3);
    for joint in [
        Joint::universal(DVec3::X, DVec3::X),
        Joint::universal(slanted, slanted * -3.0),
        Joint::planar(DVec3::X, DVec3::X),
        Joint::planar(slanted, slanted * 3.0),
    ] {
        let text = bad(Builder::new("wrist").body("w", joint, rod));
        let culprit = "`w.1` moves no inertia, as that of body `w";
        assert!(
            text.contains(culprit) && text.contains("parallel"),
            "{text}"
        );
        assert!(
            text.starts_with("the model `wrist` has 1 problem:"),
            "{text}"
        );
    }
}
