//! SDF files: placements against matrices composed by hand, and everything that is refused or listed.

#![cfg(feature = "sdf")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::f64::consts::FRAC_PI_2;
use vertebra_assembly::{
    Closure, Joint, JointKind, MassProperties, Model, ModelDescription, Spring, State,
};
use vertebra_dynamics::{Forces, Precision, Simulation, Workspace, aba, forward_kinematics};
use vertebra_files::Problem;
use vertebra_files::sdf::{self, Import};
use vertebra_spatial::Pose;

const ROVER: &str = include_str!("data/rover.sdf");

fn rover() -> Import {
    sdf::parse(ROVER).unwrap()
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

#[test]
fn bodies_stand_where_their_frames_say() {
    let import = rover();
    let model = &import.model;
    let mut workspace = Workspace::new(model, Precision::F64);
    forward_kinematics(model, &State::neutral(model), &mut workspace).unwrap();
    let rover = at(0.0, 1.0, 0.5) * DAffine3::from_rotation_z(FRAC_PI_2);
    let chassis = rover * at(0.0, 0.0, 0.1);
    let axle = chassis * at(0.3, 0.0, -0.1);
    let wheel = axle * at(0.0, 0.3, 0.0) * DAffine3::from_rotation_x(-FRAC_PI_2);
    let tilt = DAffine3::from_quat(DQuat::from_xyzw(0.0, 0.1, 0.0, 1.0).normalize());
    let mast = chassis * at(0.1, 0.0, 0.6) * tilt;
    for (name, expected) in [("chassis", chassis), ("wheel", wheel), ("mast", mast)] {
        let id = model.find(&format!("rover::{name}")).unwrap();
        let pose = workspace.pose(id).unwrap();
        assert!(
            (pose.translation - expected.translation).length() < 1e-14,
            "{name}"
        );
        assert!(
            (pose.matrix() - expected.matrix3).abs_diff_eq(DMat3::ZERO, 1e-14),
            "{name}"
        );
    }
    let frame = model.find_frame("rover::axle").unwrap();
    assert_eq!(frame.body, model.find("rover::chassis"));
    assert!((frame.placement.translation - DVec3::new(0.3, 0.0, -0.1)).length() < 1e-15);
    let rock = model.find_frame("ground::rock").unwrap();
    assert_eq!(
        (rock.body, rock.placement.translation),
        (None, DVec3::new(3.0, 0.0, 0.2))
    );
    assert_eq!(model.gravity(), DVec3::new(0.0, 0.0, -3.7));
}

#[test]
fn joints_turn_about_the_axes_stated() {
    let import = rover();
    let model = &import.model;
    let body = |name: &str| model.body(model.find(name).unwrap()).unwrap();
    assert_eq!(body("rover::chassis").joint.kind, JointKind::Free);
    // The model's y is the wheel's z, about which it rolls.
    let wheel = body("rover::wheel");
    let JointKind::Revolute { axis } = wheel.joint.kind else {
        unreachable!("{:?}", wheel.joint.kind)
    };
    assert!((axis - DVec3::Z).length() < 1e-15, "{axis}");
    let limits = wheel.joint.limits.unwrap();
    assert_eq!((limits.position, limits.effort), (None, Some(20.0)));
    assert_eq!((wheel.joint.damping, wheel.joint.friction), (0.1, 0.05));
    // A cylinder of 400 kg/m^3.
    let mass = 400.0 * std::f64::consts::PI * 0.15 * 0.15 * 0.08;
    assert!((wheel.mass.mass - mass).abs() < 1e-14);
    assert!((wheel.mass.inertia.z_axis.z - 0.5 * mass * 0.15 * 0.15).abs() < 1e-15);
    // Nothing stated is a kilogram.
    assert_eq!(body("rover::mast").mass.mass, 1.0);
    assert_eq!(
        body("rover::mast").joint.limits.unwrap().position,
        Some([-0.5, 0.5])
    );
    assert_eq!(model.dof_count(), 6 + 1 + 2);
    assert_eq!(
        import.joints["rover::neck"],
        model.find("rover::mast").unwrap()
    );
    let [stay] = model.loops() else {
        unreachable!("one joint closes a loop")
    };
    assert_eq!(
        (stay.name.as_str(), stay.closure),
        ("rover::stay", Closure::Ball)
    );
    let ends = ["rover::chassis", "rover::mast"].map(|name| model.find(name));
    assert_eq!(stay.bodies, ends);
    let [on_chassis, on_mast] = stay.placements.map(|placement| placement.translation);
    assert!((on_chassis - DVec3::new(0.1, 0.0, 0.6)).length() < 1e-15);
    assert!(on_mast.length() < 1e-15);
    // A universal joint crosses at the neck, wherever it turns.
    let mut state = State::neutral(model);
    let mast = body("rover::mast");
    let between = model.body(mast.parent.unwrap()).unwrap();
    state.q[between.position_start] = 0.4;
    state.q[mast.position_start] = -0.3;
    let mut workspace = Workspace::of_tree(model, Precision::F64);
    forward_kinematics(model, &state, &mut workspace).unwrap();
    let seen = workspace.pose(model.find("rover::mast").unwrap()).unwrap();
    let chassis = workspace
        .pose(model.find("rover::chassis").unwrap())
        .unwrap();
    let neck = chassis.transform_point(DVec3::new(0.1, 0.0, 0.1));
    let on_mast = mast.joint.child_placement.translation;
    assert!((seen.transform_point(on_mast) - neck).length() < 1e-14);
    assert!(aba(model, &state, &Forces::none(model), &mut workspace).is_ok());
}

#[test]
fn screws_and_springs() {
    let text = |pitch: &str| {
        model(&format!(
            "<link name='b'/><joint name='j' type='screw'><parent>a</parent><child>b</child>{pitch}
             <axis><xyz>1 0 0</xyz><dynamics><spring_stiffness>3</spring_stiffness>
             <spring_reference>0.2</spring_reference></dynamics></axis></joint>"
        ))
    };
    for (pitch, expected) in [
        (
            "<screw_thread_pitch>0.01</screw_thread_pitch>",
            0.01 / std::f64::consts::TAU,
        ),
        ("<thread_pitch>-200</thread_pitch>", 0.005),
    ] {
        let import = sdf::parse(&text(pitch)).unwrap();
        let nut = &import.model.bodies()[1].joint;
        assert_eq!(
            nut.kind,
            JointKind::Screw {
                axis: DVec3::X,
                pitch: expected
            }
        );
        assert_eq!(nut.spring, Some(Spring::at(3.0, 0.2)));
    }
}

#[test]
fn what_has_no_effect_is_listed() {
    let import = rover();
    let listed: Vec<String> = import.ignored.iter().map(ToString::to_string).collect();
    assert_eq!(listed.len(), 2, "{listed:?}");
    assert!(
        listed[0].contains("<plane> of <geometry> of link `plane`"),
        "{listed:?}"
    );
    assert!(
        listed[1].contains("<plugin> of model `rover`"),
        "{listed:?}"
    );
    assert_eq!(import.parts.len(), 3);
}

fn model(inside: &str) -> String {
    format!("<sdf version='1.9'>\n<model name='m'>\n<link name='a'/>\n{inside}\n</model></sdf>")
}

/// A world pulls with 9.8 m/s^2 unless it says otherwise; a model alone leaves that to where it is put.
#[test]
fn worlds_have_gravity() {
    let alone = model("");
    let gravity = |text: &str| sdf::parse(text).unwrap().model.gravity();
    assert_eq!(gravity(&alone), ModelDescription::new("").gravity);
    let world = |inside: &str| {
        let text = alone.replace("<model", &format!("<world name='w'>{inside}<model"));
        text.replace("</model>", "</model></world>")
    };
    assert_eq!(gravity(&world("")), DVec3::new(0.0, 0.0, -9.8));
    let stated = world("<gravity>0 1 -2</gravity>");
    assert_eq!(gravity(&stated), DVec3::new(0.0, 1.0, -2.0));
}

#[test]
fn mistakes_are_named_with_line_and_element() {
    let refused = |text: &str, line: u32, words: &str| {
        let error = sdf::parse(text).unwrap_err();
        assert_eq!(error.location.line, Some(line), "{error}");
        assert!(error.to_string().contains(words), "{error}");
        error.problem
    };
    let joint = |kind: &str, inside: &str| {
        model(&format!(
            "<link name='b'/>\n<joint name='j' type='{kind}'>\n<parent>a</parent><child>b</child>\n{inside}</joint>"
        ))
    };
    refused("<robot/>", 1, "<sdf>");
    refused("<sdf version='1.9'/>", 1, "has no <model>");
    refused(&model("<link name='a'/>"), 4, "taken already, on line 3");
    refused(
        &model("<model name='n'/>"),
        4,
        "may stand in <sdf> or a <world> only",
    );
    refused(&model("<include><uri>x</uri></include>"), 4, "gz sdf -p");
    refused(
        &model("<link name='b'><pose>0 0 0</pose></link>"),
        4,
        "has 3 numbers; it needs 6",
    );
    refused(
        &model("<link name='b'><pose relative_to='c'/></link>"),
        4,
        "names the frame `c`",
    );
    refused(
        "<sdf version='1.9'>\n<model name='m' canonical_link='b'><link name='a'/></model></sdf>",
        2,
        "names the link `b`",
    );
    refused(
        "<sdf version='1.9'>\n<model name='m' placement_frame='b'><link name='a'/></model></sdf>",
        2,
        "names the frame `b`",
    );
    for inside in [
        "<inertial>\n<pose relative_to='a'/></inertial>",
        "<collision name='c'>\n<pose relative_to='a'/><geometry/></collision>",
    ] {
        let text = model(&format!("<link name='b'>{inside}</link>"));
        refused(&text, 5, "`a` in `relative_to` is not supported");
    }
    refused(&joint("gearbox", ""), 5, "`gearbox` in `type`");
    refused(
        &joint("revolute", "<axis><xyz>0 0 0</xyz></axis>"),
        7,
        "states no rotation",
    );
    refused(
        &joint("revolute", "<axis><xyz expressed_in='x'>1 0 0</xyz></axis>"),
        5,
        "frame `x`",
    );
    refused(
        &model("<joint name='j' type='fixed'><parent>a</parent><child>b</child></joint>"),
        4,
        "names the frame `b`",
    );
    let box_of = |size: &str| {
        model(&format!(
            "<link name='b'><collision name='c'><geometry><box><size>{size}</size></box></geometry></collision></link>"
        ))
    };
    refused(&box_of("1 -1 1"), 4, "a size [m] is -1");
    let circle = "<frame name='f'><pose relative_to='g'/></frame>\n<frame name='g'><pose relative_to='f'/></frame>";
    let problem = refused(&model(circle), 5, "refers to itself by way of `g`, `f`");
    assert!(matches!(problem, Problem::Cycle { .. }));
    let attached = "<frame name='f' attached_to='g'/>\n<frame name='g' attached_to='f'/>";
    assert!(sdf::parse(&model(attached)).is_err());
    let fixed =
        "<sdf version='1.9'><model name='m'><static>true</static><link name='a'/></model></sdf>";
    refused(fixed, 1, "nothing moves");
    let circle = joint("revolute", "").replace(
        "</model>",
        "<joint name='k' type='revolute'><parent>b</parent><child>a</child></joint></model>",
    );
    refused(&circle, 3, "own ancestor");
    let error = sdf::read("no/such.sdf").unwrap_err();
    assert!(error.to_string().starts_with("no/such.sdf: "), "{error}");
}

/// Versions before 1.2 are built otherwise; nonsense is no version; those to come are read with a word of caution.
#[test]
fn versions_are_checked() {
    let parse = |attributes: &str| {
        sdf::parse(&format!(
            "<sdf {attributes}>\n<model name='m'><link name='a'/></model></sdf>"
        ))
    };
    for version in ["1.2", "1.4", "1.5", "1.9", "1.12"] {
        let import = parse(&format!("version='{version}'")).unwrap();
        assert!(import.ignored.is_empty(), "{:?}", import.ignored);
    }
    for version in ["1.13", "2.0"] {
        let import = parse(&format!("version='{version}'")).unwrap();
        let listed: Vec<_> = import.ignored.iter().map(ToString::to_string).collect();
        assert_eq!(
            listed,
            [
                "line 1: `version` of <sdf> has no effect: it is later than 1.12, and what came after that is not known"
            ]
        );
    }
    for (attributes, words) in [
        (
            "version='1.1'",
            "`1.1` in `version` is not supported; use 1.2 or later",
        ),
        ("version='0.9'", "`gz sdf -p` converts older files"),
        ("version='new'", "a version such as 1.9"),
        ("version='1'", "a version such as 1.9"),
        ("version='1.x'", "a version such as 1.9"),
        ("version='-1.9'", "a version such as 1.9"),
        ("version='1.+9'", "a version such as 1.9"),
        ("version=''", "no attribute `version`"),
        ("", "no attribute `version`"),
    ] {
        let error = parse(attributes).unwrap_err();
        assert_eq!(error.location.line, Some(1), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
}

/// Versions before 1.5 have axes in the model's frame; 1.5 and 1.6 say by a flag what later ones say by `expressed_in`.
#[test]
fn axes_of_old_files_may_be_those_of_the_model() {
    let axis_of = |version: &str, attribute: &str, flag: &str| {
        let text = format!(
            "<sdf version='{version}'><model name='m'><pose>0 0 0 0.3 0.2 0.1</pose>
             <link name='a'><pose>0 0 1 1 0.5 0.2</pose></link>
             <joint name='j' type='revolute'><parent>world</parent><child>a</child>
             <axis><xyz {attribute}>1 2 3</xyz>{flag}</axis></joint></model></sdf>"
        );
        let import = sdf::parse(&text).unwrap();
        assert!(import.ignored.is_empty(), "{:?}", import.ignored);
        import.model.bodies()[0].joint.kind
    };
    let axis = |attribute: &str, flag: &str| axis_of("1.6", attribute, flag);
    let flag = |stated: &str| format!("<use_parent_model_frame>{stated}</use_parent_model_frame>");
    let of_model = axis("expressed_in='__model__'", "");
    assert_eq!(axis("", &flag("true")), of_model);
    assert_eq!(axis("", &flag("0")), axis("", ""));
    assert_ne!(axis("", ""), of_model);
    assert_eq!(axis_of("1.4", "", ""), of_model);
    for version in ["1.4", "1.7"] {
        let text = format!(
            "<sdf version='{version}'><model name='m'><link name='a'/>
             <joint name='j' type='revolute'><parent>world</parent><child>a</child>
             <axis><xyz>1 2 3</xyz>{}</axis></joint></model></sdf>",
            flag("true")
        );
        let ignored = sdf::parse(&text).unwrap().ignored;
        let listed: Vec<_> = ignored.iter().map(|one| one.element.as_str()).collect();
        assert_eq!(listed, ["use_parent_model_frame"], "{version}");
    }
}

/// A name that nothing has, and an element that is nearly spelt like one that is missing.
#[test]
fn slips_in_names_are_pointed_out() {
    let hinge = |child: &str, joint: &str| {
        format!(
            "<sdf version='1.9'><model name='m'>\n<link name='arm'/>\n<joint name='j' type='{joint}'><parent>world</parent><{child}>amr</{child}></joint></model></sdf>"
        )
    };
    for (text, words) in [
        (
            hinge("child", "fixed"),
            "names the frame `amr`, which the file does not have (is `arm` meant?)",
        ),
        (
            hinge("chidl", "fixed"),
            "has no <child>; add one; line 3: <chidl> of joint `j` has no effect: is <child> meant?",
        ),
    ] {
        let error = sdf::parse(&text).unwrap_err();
        assert_eq!(error.location.line, Some(3), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
    let twice = "<sdf version='1.9'>\n<model name='m'>\n<link name='a'/></model>\n<model name='m'><link name='a'/></model></sdf>";
    let error = sdf::parse(twice).unwrap_err().to_string();
    assert!(
        error.starts_with("line 4: ") && error.contains("already, on line 3"),
        "{error}"
    );
}

/// A four-bar linkage whose last hinge closes the loop, and a follower: it stays closed, and its crank falls as
/// that of the same linkage put together by hand.
#[test]
fn a_linkage_stays_closed_and_moves_as_the_same_one_by_hand() {
    let link = |name: &str, pose: &str| {
        format!(
            "<link name='{name}'><pose>{pose}</pose><inertial><pose>0 0 0.25 0 0 0</pose><mass>1</mass><inertia><ixx>0.02</ixx><iyy>0.02</iyy><izz>0.001</izz></inertia></inertial></link>\n"
        )
    };
    let hinge = |name: &str, parent: &str, child: &str, more: &str| {
        format!(
            "<joint name='{name}' type='revolute'>{more}<parent>{parent}</parent><child>{child}</child><axis><xyz>0 1 0</xyz>"
        )
    };
    let close = "</axis></joint>\n";
    let text = [
        "<sdf version='1.11'><model name='m'>",
        &link("left", "0 0 1 0 0 0"),
        &link("right", "0.6 0 1 0 0 0"),
        &link("bar", "0 0 1.5 0 1.5707963267948966 0"),
        &link("gear", "2 0 1 0 0 0"),
        &(hinge("a", "world", "left", "") + close),
        &(hinge("b", "world", "right", "") + close),
        &(hinge("c", "left", "bar", "") + close),
        &(hinge("d", "right", "bar", "<pose>0 0 0.6 0 0 0</pose>")
            + "<dynamics><damping>1</damping></dynamics>" + close),
        &(hinge("e", "world", "gear", "")
            + "<mimic joint='a'><multiplier>-2</multiplier><offset>0.1</offset><reference>0.05</reference></mimic>"
            + close),
        "</model></sdf>",
    ]
    .concat();
    let import = sdf::parse(&text).unwrap();
    assert_eq!(import.ignored.len(), 1, "{:?}", import.ignored);
    assert!(import.ignored[0].to_string().contains("<dynamics>"));

    let mass = MassProperties {
        mass: 1.0,
        center: DVec3::new(0.0, 0.0, 0.25),
        inertia: DMat3::from_diagonal(DVec3::new(0.02, 0.02, 0.001)),
    };
    let at = |x: f64, z: f64| Pose::from_translation(DVec3::new(x, 0.0, z));
    let joint = Joint::revolute(DVec3::Y);
    let flat = Pose::new(DQuat::from_rotation_y(FRAC_PI_2), DVec3::new(0.0, 0.0, 0.5));
    let by_hand = ModelDescription::new("by hand")
        .body("left", None, joint.clone().at(at(0.0, 1.0)), mass)
        .body("right", None, joint.clone().at(at(0.6, 1.0)), mass)
        .body("bar", Some("left"), joint.clone().at(flat), mass)
        .body("gear", None, joint.at(at(2.0, 1.0)), mass)
        .close(
            "d",
            [Some("right"), Some("bar")],
            [at(0.0, 0.5), at(0.0, 0.6)],
            Closure::Revolute { axis: DVec3::Y },
        )
        .couple("e", "gear", "left", -2.0, 0.2)
        .build()
        .unwrap();
    let run = |model: &Model| {
        let mut simulation = Simulation::new(model.clone()).unwrap();
        let mut state = State::neutral(model);
        state.q[model.bodies()[3].position_start] = 0.2;
        simulation.set_state(state).unwrap();
        simulation.close_loops().unwrap();
        simulation.forces_mut().joint[0] = 3.0;
        simulation.steps(1e-3, 400).unwrap();
        let violation = simulation.loop_violation().unwrap().unwrap();
        assert!(violation.position < 1e-9, "{violation:?}");
        simulation.state().unwrap().q.clone()
    };
    assert!(
        import
            .model
            .bodies()
            .iter()
            .map(|body| &body.name)
            .eq(["left", "right", "bar", "gear"])
    );
    for (ours, theirs) in run(&import.model).iter().zip(run(&by_hand)) {
        assert!((ours - theirs).abs() < 1e-9, "{ours} against {theirs}");
    }
    assert!(run(&by_hand)[0].abs() > 0.1);

    let slanted = text
        .replace("name='d' type='revolute'", "name='d' type='universal'")
        .replace(
            "<dynamics><damping>1</damping></dynamics></axis>",
            "</axis><axis2><xyz>0 1 1</xyz></axis2>",
        );
    let error = sdf::parse(&slanted).unwrap_err();
    assert!(
        error.to_string().contains("joint `d`: the cosine"),
        "{error}"
    );
    let universal = slanted.replace("<xyz>0 1 1</xyz>", "<xyz>1 0 0</xyz>");
    let import = sdf::parse(&universal).unwrap();
    let first = import.model.loops()[0].closure;
    assert!(matches!(first, Closure::Universal { .. }), "{first:?}");
}
