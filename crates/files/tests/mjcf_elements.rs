//! MJCF files: what elements come to, by hand, and everything that is refused or listed.

#![cfg(feature = "mjcf")]

use glam::{DMat3, DVec3};
use std::sync::Arc;
use vertebra_assembly::BallRange;
use vertebra_assembly::xml::XmlProblem;
use vertebra_dynamics::Motor;
use vertebra_files::mjcf::{self, Options, Robot};
use vertebra_files::{FileError, Problem, Shape, TriangleSoup};

fn parse(text: &str) -> Result<Robot, FileError> {
    mjcf::parse(text, &Options::default())
}

/// Fields are public: no range of control makes a panic, and what is no number stays none.
#[test]
fn a_control_is_brought_into_any_range() {
    let text = with("<joint name='j'/><geom size='1'/>").replace(
        "</worldbody>",
        "</worldbody><actuator><motor joint='j' ctrlrange='-1 2'/></actuator>",
    );
    let mut actuator = parse(&text).unwrap().actuators.remove(0);
    for (control, force) in [(-3.0, -1.0), (0.5, 0.5), (7.0, 2.0)] {
        assert_eq!(actuator.motor(control).force, force);
    }
    assert!(actuator.motor(f64::NAN).force.is_nan());
    for range in [[2.0, -1.0], [f64::NAN, 1.0], [0.0, f64::NAN]] {
        actuator.control_range = Some(range);
        assert!(!actuator.motor(0.5).force.is_nan());
    }
}

/// Joint forces of actuators by hand, and why others are no motors.
#[test]
fn actuators_are_motors_where_they_are_affine() {
    let text = with("<joint name='j' ref='30' actuatorfrcrange='-9 9'/><geom size='1'/>").replace(
        "</worldbody>",
        "<body><joint name='k'/><joint name='b' type='ball' pos='1 0 0'/><geom size='1'/></body></worldbody>
<default><general ctrlrange='-1 1'/><position kp='7'/></default>
<actuator>
<general joint='j' gainprm='5' biastype='affine' biasprm='0.5 -2 -0.25' gear='3'/>
<position joint='j' ctrllimited='false' kv='0.5'/>
<velocity joint='k' kv='4' forcerange='-2 2' ctrllimited='false'/>
<motor joint='k'/>
<motor joint='j' forcerange='-1 2'/>
<motor joint='j' gaer='2'/>
<motor joint='b'/>
<motor tendon='t'/>
<general joint='j' dyntype='integrator'/>
<general joint='j' biastype='affine' biasprm='0 1'/>
<position joint='j' dampratio='1'/>
<muscle joint='j'/>
<moter joint='j'/>
</actuator>",
    );
    let robot = parse(&text).unwrap();
    let listed: Vec<String> = robot.ignored.iter().map(ToString::to_string).collect();
    let expected = [
        "line 11: <motor> of <actuator> has no effect: its joint has another one, and bounded forces do not add up to one motor",
        "line 12: <motor> of <actuator> has no effect: `forcerange` is not the same in both directions",
        "line 13: `gaer` of <motor> has no effect: is `gear` meant?",
        "line 14: <motor> of <actuator> has no effect: its joint has several freedoms",
        "line 15: <motor> of <actuator> has no effect: it drives no joint",
        "line 16: <general> of <actuator> has no effect: it has a state of its own (`dyntype`)",
        "line 17: <general> of <actuator> has no effect: its force grows with position or rate, which no motor's does",
        "line 18: <position> of <actuator> has no effect: `dampratio` needs MuJoCo's estimate of inertia; state `kv`",
        "line 19: <muscle> of <actuator> has no effect: it has a state of its own",
        "line 20: <moter> of <actuator> has no effect: is <motor> meant?",
    ];
    assert_eq!(listed, expected);
    let [first, second] = robot.motors(&[4.0, 4.0, 0.5, -0.1]).unwrap()[..] else {
        unreachable!("two joints are driven")
    };
    // Controls 1 (cut off), 4 and -0.1, at q and qd of the joint; its position in the file is q + 30 degrees.
    let (q, qd) = (0.3, -0.8);
    let angle = q + 30_f64.to_radians();
    let (l, dl) = (3.0 * angle, 3.0 * qd);
    let general = 3.0 * (5.0 + 0.5 - 2.0 * l - 0.25 * dl);
    let by_hand = general + 7.0 * (4.0 - angle) - 0.5 * qd - 0.1;
    let force = |motor: &Motor| motor.force - motor.stiffness * q - motor.damping * qd;
    assert!((force(&first.1) - by_hand).abs() < 1e-14 * by_hand.abs());
    assert_eq!((first.1.limit, first.0), (f64::INFINITY, robot.joints["j"]));
    assert_eq!(force(&second.1), 4.0 * 0.5 - 4.0 * qd);
    assert_eq!(second.1.limit, 2.0);
    let effort = robot
        .model
        .body(robot.joints["j"])
        .unwrap()
        .joint
        .limits
        .unwrap()
        .effort;
    assert_eq!(effort, Some(9.0));
    assert!(robot.motors(&[1.0]).is_err());
}

#[test]
fn masses_of_shapes_by_hand() {
    // A capsule and the same shape as many thin slices.
    let (radius, length) = (0.3_f64, 0.8_f64);
    let capsule = Shape::Capsule { radius, length }
        .mass_properties(2.0)
        .unwrap();
    let slices = 200_000;
    let (mut mass, mut along, mut across) = (0.0, 0.0, 0.0);
    let half = 0.5 * length + radius;
    let thick = 2.0 * half / f64::from(slices);
    for slice in 0..slices {
        let z = -half + (f64::from(slice) + 0.5) * thick;
        let beyond = (z.abs() - 0.5 * length).max(0.0);
        let r2 = radius * radius - beyond * beyond;
        let dm = 2.0 * std::f64::consts::PI * r2 * thick;
        mass += dm;
        along += 0.5 * dm * r2;
        across += dm * (0.25 * r2 + z * z);
    }
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * b, "{a} against {b}");
    close(capsule.mass, mass);
    close(capsule.inertia.z_axis.z, along);
    close(capsule.inertia.x_axis.x, across);

    // A box of triangles is a box.
    let size = DVec3::new(0.2, 0.5, 1.1);
    let corner = |index: u32| {
        let side = |bit: u32| f64::from((index >> bit) & 1) - 0.5;
        DVec3::new(side(0), side(1), side(2)) * size + DVec3::new(3.0, -2.0, 1.0)
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let mut soup = TriangleSoup {
        vertices: (0..8).map(corner).collect(),
        triangles: quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
    };
    let solid = Shape::Box { size }.mass_properties(700.0).unwrap();
    let weigh = |soup: &TriangleSoup| Shape::Mesh(Arc::new(soup.clone())).mass_properties(700.0);
    let meshed = weigh(&soup).unwrap();
    close(meshed.mass, solid.mass);
    assert!((meshed.center - DVec3::new(3.0, -2.0, 1.0)).length() < 1e-14);
    let apart: DMat3 = meshed.inertia - solid.inertia;
    let largest = apart
        .to_cols_array()
        .iter()
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!(largest < 1e-13 * solid.mass, "{apart}");
    soup.triangles.pop();
    assert!(weigh(&soup).is_err());
    soup.triangles.clear();
    assert!(weigh(&soup).is_err());
}

/// A body of the world with this in it.
fn with(body: &str) -> String {
    format!("<mujoco>\n<worldbody>\n<body name=\"b\">\n{body}\n</body></worldbody></mujoco>")
}

#[test]
fn mistakes_are_named_with_line_and_element() {
    let joint = "<joint name=\"j\"/>";
    let refused = |text: &str, line: u32, words: &str| {
        let error = parse(text).unwrap_err();
        assert_eq!(error.location.line, Some(line), "{error}");
        assert!(error.to_string().contains(words), "{error}");
        error.problem
    };
    let geom = |attributes: &str| with(&format!("{joint}\n<geom name=\"g\" {attributes}/>"));
    refused(&geom("size='-1'"), 5, "geom `g`: a size [m] is -1");
    refused(
        &geom("type='box' size='1 1'"),
        5,
        "`size` has 2 numbers; it needs 3",
    );
    refused(&geom("type='torus' size='1'"), 5, "`torus` in `type`");
    refused(&geom("size='a'"), 5, "is not a number");
    for attributes in ["limited='true'", "actuatorfrclimited='true'"] {
        let limited = with(&format!("<joint {attributes}/><geom size='1'/>"));
        let wanted = if attributes.starts_with('l') {
            "no attribute `range`"
        } else {
            "no attribute `actuatorfrcrange`"
        };
        refused(&limited, 4, wanted);
    }
    let driven = with("<joint name='j'/><geom size='1'/>").replace(
        "</worldbody>",
        "</worldbody><actuator><motor joint='j' ctrllimited='true'/></actuator>",
    );
    refused(&driven, 5, "no attribute `ctrlrange`");
    refused(&geom("size='1' quat='0 0 0 0'"), 5, "states no rotation");
    refused(
        &geom("size='1' quat='1 0 0 0' euler='0 0 0'"),
        5,
        "contradict",
    );
    refused(&geom("size='1' mass='-2'"), 5, "the mass [kg] is -2");
    refused(&geom("type='mesh' mesh='m'"), 5, "names the mesh `m`");
    refused(&geom("size='1' class='c'"), 5, "names the class `c`");
    refused(&with(joint), 4, "moves no inertia");
    let slip = with(&format!("{joint}<gem size='1'/>"));
    refused(&slip, 4, "moves no inertia");
    refused(
        &slip,
        4,
        "line 4: <gem> of body `b` has no effect: is <geom> meant?",
    );
    refused(&with("<joint axis='0 0 0'/>"), 4, "states no rotation");
    refused(
        &with("<joint type='cog'/>"),
        4,
        "hinge, slide, ball or free",
    );
    refused(&with("<inertial mass='1' pos='0 0 0'/>"), 4, "diaginertia");
    refused(&with("<replicate count='3'/>"), 4, "save the expanded file");
    refused(
        &with(&format!("{joint}<geom size='1'/><body name='b'/>")),
        4,
        "taken already, on line 3",
    );
    refused(&with("<geom size='1'/>"), 1, "nothing moves");
    refused("<robot/>", 1, "<mujoco>");
    refused(
        "<mujoco>\n<compiler coordinate='global'/></mujoco>",
        2,
        "`local`",
    );
    refused(
        "<mujoco>\n<compiler angle='grad'/></mujoco>",
        2,
        "`degree` or `radian`",
    );
    refused("<mujoco>\n<include file='x'/></mujoco>", 2, "expanded");
    let problem = refused("<mujoco>\n<worldbody x></mujoco>", 2, "XML");
    assert!(matches!(problem, Problem::Xml(XmlProblem::NotXml { .. })));
    let equality = |text: &str| {
        with(&format!("{joint}<geom size='1'/>")).replace(
            "</mujoco>",
            &format!("\n<equality>{text}</equality></mujoco>"),
        )
    };
    refused(
        &equality("<connect name='c' body1='b' body2='b'/>"),
        6,
        "connects a body to itself",
    );
    refused(&equality("<weld body1='x'/>"), 6, "names the body `x`");
    refused(
        &equality("<weld site1='x' site2='y'/>"),
        6,
        "names the site `x`",
    );
    refused(&equality("<connect anchor='0 0 0'/>"), 6, "`body1`");
    let motor = with(&format!("{joint}<geom size='1'/>")).replace(
        "</mujoco>",
        "\n<actuator><motor joint='k'/></actuator></mujoco>",
    );
    refused(&motor, 6, "names the joint `k`");
    let error = mjcf::read("no/such/file.xml", &Options::default()).unwrap_err();
    assert!(
        error.to_string().starts_with("no/such/file.xml: "),
        "{error}"
    );
}

/// What is nearly spelt like something that is read is named beside the problem that it may be the cause of.
#[test]
fn slips_are_named_beside_the_problem_they_cause() {
    let scene = |inside: &str| {
        format!("<mujoco><worldbody>\n<body name='arm'><joint name='hinge'/>\n{inside}</mujoco>")
    };
    for (text, line, words) in [
        (
            "<mujoco><worldbody>\n<boddy name='a'><joint/><geom size='0.1'/></boddy></worldbody></mujoco>".to_owned(),
            1,
            "nothing moves; add a body with one; line 2: <boddy> of <worldbody> has no effect: is <body> meant?",
        ),
        (
            scene("<geom siz='0.1'/></body></worldbody>"),
            3,
            "<geom> of body `arm`: attribute `size` has 0 numbers; it needs 1; \
             line 3: `siz` of <geom> of body `arm` has no effect: is `size` meant?",
        ),
        (
            scene("<geom size='0.1'/></body></worldbody>\n<equality><connect body1='amr' anchor='0 0 0'/></equality>"),
            4,
            "names the body `amr`, which the file does not have (is `arm` meant?); add it",
        ),
        (
            scene("<geom size='0.1'/></body></worldbody>\n<actuator><motor joint='hnige'/></actuator>"),
            4,
            "names the joint `hnige`, which the file does not have (is `hinge` meant?); add it",
        ),
    ] {
        let error = parse(&text).unwrap_err();
        assert_eq!(error.location.line, Some(line), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
    // Slips elsewhere have nothing to do with it.
    let elsewhere =
        scene("<geom size='0.1'/><geom size='0.1' masss='1'/>\n<geom/></body></worldbody>");
    let error = parse(&elsewhere).unwrap_err().to_string();
    assert!(!error.contains("meant?"), "{error}");
}

#[test]
fn meshes_in_files_weigh_if_the_caller_has_them() {
    let text = with("<joint/><geom type='mesh' mesh='m'/>").replace(
        "<worldbody>",
        "<asset><mesh name='m' file='m.stl' scale='1 1 -2'/></asset><worldbody>",
    );
    let error = parse(&text).unwrap_err();
    assert!(
        matches!(&error.problem, Problem::MeshMass { mesh } if mesh == "m"),
        "{error}"
    );
    let tetrahedron = TriangleSoup {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let robot = mjcf::parse(&text, &Options::default().mesh("m.stl", tetrahedron)).unwrap();
    let mass = robot.model.bodies()[0].mass;
    assert!((mass.mass - 1000.0 / 3.0).abs() < 1e-10);
    assert!((mass.center - DVec3::new(0.25, 0.25, -0.5)).length() < 1e-15);
}

#[test]
fn what_has_no_effect_is_listed() {
    let text = with("<joint name='j' margin='0.1'/><geom size='1' rgba='1 0 0 1'/><camera/>")
        .replace("</mujoco>", "<sensor/></mujoco>");
    let listed: Vec<String> = parse(&text)
        .unwrap()
        .ignored
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(
        listed,
        [
            "line 4: <camera> of body `b` has no effect",
            "line 4: `rgba` of <geom> of body `b` has no effect",
            "line 4: `margin` of joint `j` has no effect",
            "line 5: <sensor> of <mujoco> has no effect",
        ]
    );
}

/// A ball joint's range is the largest turn about any axis; one of half a turn is none.
#[test]
fn ranges_of_ball_joints_are_turns() {
    let ball = |attributes: &str| {
        let joint = format!("<joint type='ball' {attributes}/><geom size='1'/>");
        let robot = parse(&with(&joint)).unwrap();
        let joint = robot.model.bodies()[0].joint.clone();
        (joint.limits.and_then(|limits| limits.orientation), joint)
    };
    let (range, joint) = ball("range='0 60' frictionloss='0.2'");
    assert_eq!(joint.friction, 0.2);
    let Some(BallRange::Turn { angle }) = range else {
        unreachable!("{range:?}")
    };
    assert!((angle - core::f64::consts::FRAC_PI_3).abs() <= 1e-15);
    assert_eq!(ball("range='0 180'").0, None);
    assert_eq!(ball("range='0 60' limited='false'").0, None);
}
