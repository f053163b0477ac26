//! URDF: what is read, element by element.
#![cfg(feature = "urdf")]
#![expect(
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use glam::{DMat3, DVec3};
use vertebra_assembly::urdf::{self, Mesh, Options, Problem, Robot, Role, Shape};
use vertebra_assembly::xml::XmlProblem;
use vertebra_assembly::{BodyId, Joint, JointKind, Random};

/// A robot of these elements, which start on line 2.
fn robot(elements: &str) -> String {
    format!("<robot name=\"test\">\n{elements}\n</robot>")
}

/// A link of 1 kg.
fn link(name: &str) -> String {
    format!(
        "<link name=\"{name}\"><inertial><mass value=\"1\"/>\
         <inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>\n"
    )
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, rest: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/>\
         <child link=\"{child}\"/>{rest}</joint>\n"
    )
}

/// A base and an arm on a joint of this type and content.
fn one_joint(kind: &str, rest: &str) -> String {
    robot(&(link("base") + &link("arm") + &joint("j", kind, "base", "arm", rest)))
}

fn read(text: &str) -> Robot {
    urdf::parse(text, &Options::default()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn arm(robot: &Robot) -> Joint {
    let arm = robot.model.find("arm").unwrap();
    robot.model.body(arm).unwrap().joint.clone()
}

#[test]
fn joint_types_and_defaults() {
    let kinds = [
        ("revolute", JointKind::Revolute { axis: DVec3::X }),
        ("continuous", JointKind::Revolute { axis: DVec3::X }),
        ("prismatic", JointKind::Prismatic { axis: DVec3::X }),
        ("floating", JointKind::Free),
    ];
    for (name, kind) in kinds {
        let robot = read(&one_joint(name, ""));
        assert_eq!(arm(&robot), Joint::new(kind));
        assert_eq!(robot.joints["j"], robot.model.find("arm").unwrap());
        // Those whose range the format demands lack it.
        let listed: Vec<_> = robot.ignored.iter().map(ToString::to_string).collect();
        assert_eq!(
            listed.len(),
            usize::from(name == "revolute" || name == "prismatic")
        );
        let lacks = "line 4: <limit> of joint `j` has no effect: the format asks for one here and there is none";
        assert!(
            listed.iter().all(|text| text.starts_with(lacks)),
            "{listed:?}"
        );
    }
    let robot = read(&one_joint("revolute", "<axis xyz='0 0 2'/>"));
    assert_eq!(arm(&robot).kind, JointKind::Revolute { axis: DVec3::Z });
    assert_eq!(robot.model.name(), "test");
    assert_eq!(robot.model.gravity(), DVec3::new(0.0, 0.0, -9.81));
    let moon = Options::default().gravity(DVec3::new(0.0, 0.0, -1.62));
    let robot = urdf::parse(&one_joint("revolute", ""), &moon).unwrap();
    assert_eq!(robot.model.gravity().z, -1.62);
}

/// Two slides across the normal, whatever its length, and a turn about it.
#[test]
fn a_planar_joint_moves_in_its_plane() {
    let rest = "<origin xyz='0 0 2'/><axis xyz='1e-200 2e-200 -3e-200'/><limit effort='1'/>";
    let follower = joint("k", "continuous", "arm", "tool", "<mimic joint='j'/>");
    let elements = link("base")
        + &link("arm")
        + &link("tool")
        + &joint("j", "planar", "base", "arm", rest)
        + &follower;
    let read = read(&robot(&elements));
    let listed: Vec<_> = read.ignored.iter().map(ToString::to_string).collect();
    assert_eq!(listed.len(), 2, "{listed:?}");
    assert!(listed[0].contains("<limit>"));
    assert!(listed[1].ends_with("the joint `j` has several freedoms"));
    let model = &read.model;
    let bodies = model.bodies();
    let names: Vec<_> = bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["arm.1", "arm.2", "arm", "tool"]);
    assert_eq!(read.joints["j"], BodyId(2));
    let JointKind::Revolute { axis } = bodies[2].joint.kind else {
        panic!("{:?}", bodies[2].joint.kind)
    };
    let normal = DVec3::new(1.0, 2.0, -3.0).normalize();
    assert!((axis - normal).length() < 1e-15);
    for body in &bodies[..2] {
        let JointKind::Prismatic { axis } = body.joint.kind else {
            panic!("{:?}", body.joint.kind)
        };
        assert!(axis.dot(normal).abs() < 1e-15);
    }
    assert_eq!(bodies[0].joint.parent_placement.translation.z, 2.0);

    let still = one_joint("planar", "<axis xyz='0 0 0'/>");
    let error = urdf::parse(&still, &Options::default()).unwrap_err();
    assert!(
        error.to_string().contains("`xyz` states no rotation"),
        "{error}"
    );
    // What is wrong with the bodies between is said of the link.
    let taken = robot(&(elements.replace("tool", "arm.1")));
    let error = urdf::parse(&taken, &Options::default()).unwrap_err();
    assert!(error.to_string().contains("link `arm.1`"), "{error}");
    let light = one_joint("planar", "").replace("value=\"1\"", "value=\"0\"");
    let light = light
        .replace("xx=\"1\"", "xx=\"0\"")
        .replace("yy=\"1\"", "yy=\"0\"");
    let light = light.replace("zz=\"1\"", "zz=\"0\"");
    let error = urdf::parse(&light, &Options::default()).unwrap_err();
    assert!(error.to_string().contains("`arm`"), "{error}");
}

#[test]
fn numbers_as_files_write_them() {
    let origin = "<origin xyz=' +1.5\t-2e-1\n 3. ' rpy='0 0 0'/>";
    let robot = read(&one_joint(
        "prismatic",
        &format!("{origin}<axis xyz='.5 0 -0'/>"),
    ));
    let arm = arm(&robot);
    assert_eq!(arm.parent_placement.translation, DVec3::new(1.5, -0.2, 3.0));
    assert_eq!(arm.parent_placement.rotation, glam::DQuat::IDENTITY);
    assert_eq!(arm.kind, JointKind::Prismatic { axis: DVec3::X });
}

#[test]
fn limits_and_dynamics_are_kept_and_said_not_to_be_simulated_and_mimics_are_couplings() {
    let limits = |kind: &str, text: &str| {
        let robot = read(&one_joint(kind, text));
        assert_eq!(robot.ignored.is_empty(), !text.is_empty());
        arm(&robot).limits
    };
    let all = "<limit lower='-1' upper='2' velocity='3' effort='4'/>";
    let read_limits = limits("revolute", all).unwrap();
    assert_eq!(read_limits.position, Some([-1.0, 2.0]));
    assert_eq!(
        (read_limits.velocity, read_limits.effort),
        (Some(3.0), Some(4.0))
    );
    // A continuous joint has no range whatever is written, and nothing need be written.
    assert_eq!(limits("continuous", all).unwrap().position, None);
    assert_eq!(
        limits("prismatic", "<limit upper='2'/>").unwrap().position,
        Some([0.0, 2.0])
    );
    assert_eq!(limits("revolute", "<limit/>"), None);
    assert_eq!(limits("revolute", ""), None);
    // What stands for no bound.
    let large = "<limit lower='-1e16' upper='2e16' velocity='1e16' effort='1e300'/>";
    assert_eq!(limits("prismatic", large), None);
    let one_sided = "<limit lower='-1' upper='1e16' velocity='1e15' effort='1e16'/>";
    let one_sided = limits("prismatic", one_sided).unwrap();
    assert_eq!(one_sided.position, Some([-1.0, 1e16]));
    assert_eq!((one_sided.velocity, one_sided.effort), (Some(1e15), None));

    let elements = link("base")
        + &link("hub")
        + &link("arm")
        + &joint(
            "j",
            "revolute",
            "hub",
            "arm",
            "<dynamics damping='0.5' friction='0.25'/><mimic joint='hub-joint' multiplier='-2' offset='0.1'/>",
        )
        + &joint(
            "hub-joint",
            "revolute",
            "base",
            "hub",
            "<limit effort='1'/>",
        );
    let robot = read(&robot(&elements));
    let mimic = arm(&robot).mimic.unwrap();
    assert_eq!(
        (mimic.body.as_str(), mimic.multiplier, mimic.offset),
        ("hub", -2.0, 0.1)
    );
    let features: Vec<_> = (robot.model.not_simulated().into_iter())
        .map(|item| (item.body, item.feature))
        .collect();
    assert_eq!(features, []);
    let couplings: Vec<_> = robot.model.couplings().collect();
    assert_eq!((couplings.len(), couplings[0].name.as_str()), (1, "arm"));
    assert_eq!((couplings[0].ratio, couplings[0].offset), (-2.0, 0.1));
    let plain = link("base")
        + &link("arm")
        + &link("tip")
        + &joint("j", "revolute", "base", "arm", "<mimic joint='k'/>")
        + &joint("k", "revolute", "arm", "tip", "");
    let mimic = arm(&read(&crate::robot(&plain))).mimic.unwrap();
    assert_eq!((mimic.multiplier, mimic.offset), (1.0, 0.0));
}

/// Roll, pitch, yaw about fixed axes, against products of matrices about single axes.
#[test]
fn roll_pitch_yaw_turn_about_fixed_axes() {
    let mut random = Random::new(1);
    for _ in 0..200 {
        let [r, p, y] = [0; 3].map(|_| 10.0 * random.symmetric());
        let robot = read(&one_joint(
            "revolute",
            &format!("<origin rpy='{r} {p} {y}'/>"),
        ));
        let found = DMat3::from_quat(arm(&robot).parent_placement.rotation);
        let expected =
            DMat3::from_rotation_z(y) * DMat3::from_rotation_y(p) * DMat3::from_rotation_x(r);
        // Half an angle of up to 10 is off by 10 eps before its sine is taken.
        assert!(
            found.abs_diff_eq(expected, 32.0 * f64::EPSILON),
            "{r} {p} {y}"
        );
    }
}

#[test]
fn inertials_are_turned_into_the_link_frame() {
    let inertial = "<link name='arm'><inertial><origin xyz='1 2 3' rpy='0 0 1.5707963267948966'/>\
        <mass value='2'/><inertia ixx='1' ixy='0.1' ixz='0' iyy='2' iyz='0.2' izz='2.5'/></inertial></link>";
    let text = robot(&(link("base") + inertial + &joint("j", "revolute", "base", "arm", "")));
    let robot = read(&text);
    let mass = robot.model.bodies()[0].mass;
    assert_eq!((mass.mass, mass.center), (2.0, DVec3::new(1.0, 2.0, 3.0)));
    // A quarter turn about z takes x to y and y to -x.
    let expected = DMat3::from_cols(
        DVec3::new(2.0, -0.1, -0.2),
        DVec3::new(-0.1, 1.0, 0.0),
        DVec3::new(-0.2, 0.0, 2.5),
    );
    assert!(
        mass.inertia.abs_diff_eq(expected, 16.0 * f64::EPSILON),
        "{}",
        mass.inertia
    );
}

/// What hangs from the base by fixed joints belongs to the world, or to the floating base.
#[test]
fn bases_are_welded_or_float() {
    let elements = link("base")
        + &link("plate")
        + &link("arm")
        + &joint("weld", "fixed", "base", "plate", "<origin xyz='1 0 0'/>")
        + &joint("j", "revolute", "plate", "arm", "<origin xyz='0 2 0'/>");
    let text = robot(&elements);
    let welded = read(&text).model;
    assert_eq!(welded.bodies().len(), 1);
    assert_eq!(welded.bodies()[0].parent, None);
    let at = welded.bodies()[0].joint.parent_placement.translation;
    assert_eq!(at, DVec3::new(1.0, 2.0, 0.0));
    let frames: Vec<_> = welded
        .frames()
        .iter()
        .map(|f| (f.name.as_str(), f.body))
        .collect();
    assert_eq!(frames, [("base", None), ("plate", None)]);

    let floating = urdf::parse(&text, &Options::default().floating_base()).unwrap();
    let base = floating.model.find("base").unwrap();
    let body = floating.model.body(base).unwrap();
    assert_eq!(body.joint, Joint::free());
    assert_eq!((body.mass.mass, body.mass.center.x), (2.0, 0.5));
    assert_eq!(floating.model.frames()[0].body, Some(base));
    assert_eq!(floating.model.dof_count(), 7);

    let kept = urdf::parse(&text, &Options::default().keep_fixed()).unwrap();
    let kinds: Vec<_> = kept
        .model
        .bodies()
        .iter()
        .map(|b| b.joint.kind.dof_count())
        .collect();
    assert_eq!(kinds, [0, 0, 1]);
    assert!(kept.model.frames().is_empty());
    assert_eq!(kept.joints.len(), 2);
    assert_eq!(welded.depth() + 2, kept.model.depth());
}

#[test]
fn bodies_stand_limb_by_limb() {
    let links: String = ["z", "r1", "base", "l2", "l1", "r2"].map(link).concat();
    let joints = joint("l1j", "revolute", "base", "l1", "")
        + &joint("r1j", "revolute", "base", "r1", "")
        + &joint("r2j", "revolute", "r1", "r2", "")
        + &joint("l2j", "revolute", "l1", "l2", "")
        + &joint("zj", "revolute", "base", "z", "");
    let robot = read(&robot(&(joints + &links)));
    let names: Vec<_> = robot
        .model
        .bodies()
        .iter()
        .map(|b| b.name.as_str())
        .collect();
    assert_eq!(names, ["l1", "l2", "r1", "r2", "z"]);
    assert_eq!(robot.joints["r2j"], robot.model.find("r2").unwrap());
}

#[test]
fn what_has_no_effect_is_listed() {
    let elements = "<material name='red'><color rgba='1 0 0 1'/></material>\n\
        <link name='base'><visual><geometry><sphere radius='1'/></geometry>\n\
        <material name='red'/></visual><collision><geometry><capsule radius='1' length='2'/></geometry></collision></link>\n\
        <gazebo reference='base'><robot/></gazebo>\n"
        .to_owned()
        + &link("arm")
        + &link("tip")
        + "<transmission name='t'/>\n<madeup/>\n"
        + &joint("j", "continuous", "base", "arm", "<safety_controller k_velocity='1'/><calibration rising='0'/>")
        + &joint("f", "fixed", "arm", "tip", "<axis xyz='0 0 0'/>\n<limit effort='1'/>");
    let robot = read(&robot(&elements));
    let listed: Vec<_> = (robot.ignored.iter())
        .map(|i| (i.line, i.element.as_str(), i.owner.as_str()))
        .collect();
    assert_eq!(
        listed,
        [
            (2, "material", "robot `test`"),
            (4, "material", "<visual> of link `base`"),
            (4, "capsule", "<geometry> of link `base`"),
            (5, "gazebo", "robot `test`"),
            (8, "transmission", "robot `test`"),
            (9, "madeup", "robot `test`"),
            (10, "safety_controller", "joint `j`"),
            (10, "calibration", "joint `j`"),
            (11, "axis", "joint `f`"),
            (12, "limit", "joint `f`"),
        ]
    );
    assert_eq!(robot.geometry.len(), 1);
    assert_eq!(
        robot.ignored[0].to_string(),
        "line 2: <material> of robot `test` has no effect"
    );
}

#[test]
fn a_mimic_of_a_folded_or_missing_joint_is_listed() {
    let elements = link("base")
        + &link("hub")
        + &link("arm")
        + &joint("weld", "fixed", "base", "hub", "")
        + &joint("j", "continuous", "hub", "arm", "<mimic joint='weld'/>");
    let text = robot(&elements);
    let folded = read(&text);
    let listed = folded.ignored[0].to_string();
    assert!(listed.ends_with("<mimic> of joint `j` has no effect: the joint `weld` does not move"));
    assert_eq!(arm(&folded).mimic, None);
    let missing = read(&text.replace("mimic joint='weld'", "mimic joint='nobody'"));
    let listed = missing.ignored[0].to_string();
    assert!(
        listed.ends_with("has no effect: the joint `nobody` is not in the file"),
        "{listed}"
    );
    assert_eq!(arm(&missing).mimic, None);
    let kept = urdf::parse(&text, &Options::default().keep_fixed()).unwrap();
    assert_eq!(arm(&kept).mimic.unwrap().body, "hub");
}

#[test]
fn foreign_namespaces_are_listed_and_default_ones_accepted() {
    let inner = link("base") + &link("arm") + &joint("j", "continuous", "base", "arm", "");
    let foreign = format!(
        "<robot name='r' xmlns:sensor='http://example.org/sensor'><sensor:camera/>{inner}</robot>"
    );
    let robot = read(&foreign);
    assert_eq!(robot.ignored[0].element, "sensor:camera");
    let default = format!("<robot name='r' xmlns='http://www.ros.org'>{inner}</robot>");
    assert_eq!(read(&default).model.dof_count(), 1);
    // A declaration that xacro leaves behind is harmless, and so are comments and a byte order mark.
    let left = format!(
        "\u{feff}<?xml version='1.0'?>\n<!-- <xacro:if value='${{a}}'/> -->\n\
         <robot name='r' xmlns:xacro='http://wiki.ros.org/xacro'>{inner}</robot>"
    );
    assert_eq!(read(&left).model.dof_count(), 1);
}

/// Dummy links of impossible inertia are common, and drown in the body they are folded into.
#[test]
fn doubtful_inertias_are_accepted_as_parts_and_listed() {
    let dummy = "<link name='dummy'><inertial><mass value='1e-6'/>\
        <inertia ixx='1e-6' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial></link>\n";
    let elements = link("base")
        + &link("arm")
        + dummy
        + &joint("j", "revolute", "base", "arm", "")
        + &joint("f", "fixed", "arm", "dummy", "");
    let text = robot(&elements);
    let folded = read(&text);
    assert_eq!(folded.doubtful[0].link, "dummy");
    assert!(folded.doubtful[0].to_string().starts_with("line 4: "));
    let kept = urdf::parse(&text, &Options::default().keep_fixed()).unwrap_err();
    assert!(matches!(kept.problem, Problem::Model(_)));
    assert_eq!(kept.location.line, Some(4));
}

#[test]
fn shapes_are_placed_in_their_bodies() {
    let elements = link("base")
        + &link("arm")
        + "<link name='hand'>\
           <visual><origin xyz='0 0 1'/><geometry><box size='1 2 3'/></geometry></visual>\
           <visual><geometry><cylinder radius='0.5' length='2'/></geometry></visual>\
           <collision><geometry><sphere radius='0.25'/></geometry></collision>\n\
           <collision><geometry><mesh filename=' package://p/a.stl ' scale='1 1 -1'/></geometry></collision>\
           </link>"
        + &joint("j", "revolute", "base", "arm", "")
        + &joint("f", "fixed", "arm", "hand", "<origin xyz='5 0 0'/>");
    let robot = read(&robot(&elements));
    let shapes: Vec<_> = robot.geometry.iter().map(|g| (g.role, &g.shape)).collect();
    let mesh = Mesh {
        file: "package://p/a.stl".to_owned(),
        scale: DVec3::new(1.0, 1.0, -1.0),
        link: "hand".to_owned(),
        line: 5,
    };
    let cylinder = Shape::Cylinder {
        radius: 0.5,
        length: 2.0,
    };
    assert_eq!(
        shapes,
        [
            (
                Role::Visual,
                &Shape::Box {
                    size: DVec3::new(1.0, 2.0, 3.0)
                }
            ),
            (Role::Visual, &cylinder),
            (Role::Collision, &Shape::Sphere { radius: 0.25 }),
            (Role::Collision, &Shape::Mesh(mesh)),
        ]
    );
    assert!(
        robot
            .geometry
            .iter()
            .all(|g| g.link == "hand" && g.body == robot.model.find("arm"))
    );
    assert_eq!(
        robot.geometry[0].placement.translation,
        DVec3::new(5.0, 0.0, 1.0)
    );
}

/// Neither reading nor folding recurses, and no step looks at all links for each link.
#[test]
fn long_chains_and_deep_nests_are_read() {
    let count = 100_000;
    for (kind, reversed) in [("revolute", false), ("revolute", true), ("fixed", false)] {
        let mut links: Vec<String> = (0..count).map(|i| link(&format!("l{i}"))).collect();
        let mut joints: Vec<String> = (1..count)
            .map(|i| {
                let (parent, child) = (format!("l{}", i - 1), format!("l{i}"));
                let last = i == count - 1;
                let kind = if last { "revolute" } else { kind };
                joint(
                    &format!("j{i}"),
                    kind,
                    &parent,
                    &child,
                    "<origin xyz='0 0 1'/>",
                )
            })
            .collect();
        if reversed {
            links.reverse();
            joints.reverse();
        }
        let text = robot(&(links.concat() + &joints.concat()));
        let robot = read(&text);
        let moving = if kind == "fixed" { 1 } else { count - 1 };
        assert_eq!(robot.model.depth(), moving);
        assert_eq!(robot.model.frames().len(), count - moving);
        let kept = urdf::parse(&text, &Options::default().keep_fixed().floating_base()).unwrap();
        assert_eq!(kept.model.depth(), count);
    }
    let deep = "<a>".repeat(count) + &"</a>".repeat(count);
    let inner = link("base") + &link("arm") + &joint("j", "continuous", "base", "arm", &deep);
    let nested = read(&robot(&(inner + "<gazebo>" + &deep + "</gazebo>")));
    assert_eq!(nested.ignored.len(), 2);
    let unclosed = urdf::parse(&"<robot>".repeat(count), &Options::default());
    assert!(matches!(
        unclosed.unwrap_err().problem,
        Problem::Xml(XmlProblem::NotXml { .. })
    ));
}
