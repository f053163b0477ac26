//! URDF: every way in which a file can be wrong, with its line and element; where meshes are.
#![cfg(feature = "urdf")]
#![expect(clippy::panic, reason = "a test fails by panicking")]

use std::fs;
use vertebra_assembly::urdf::{self, Mesh, Options, Problem, Robot, Shape, UrdfError};
use vertebra_assembly::xml::XmlProblem;
use vertebra_assembly::{Model, ModelError};

const BASE: &str = "<link name='base'/>\n";
const ARM: &str = "<link name='arm'><inertial><mass value='1'/>\
    <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>\n";
const JOINT: &str =
    "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/></joint>\n";

/// A robot of these elements, which start on line 2.
fn robot(elements: &str) -> String {
    format!("<robot name='test'>\n{elements}</robot>")
}

fn refusal_of(text: &str, options: &Options) -> UrdfError {
    match urdf::parse(text, options) {
        Err(error) => error,
        Ok(_) => panic!("this was read:\n{text}"),
    }
}

/// The refusal of a robot, which must be of this line and speak of all these words.
fn refused(text: &str, line: u32, words: &[&str]) -> Problem {
    let error = refusal_of(text, &Options::default());
    let message = error.to_string();
    assert_eq!(error.location.line, Some(line), "{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
    error.problem
}

macro_rules! assert_problem {
    ($problem:expr, $pattern:pat) => {
        let problem = $problem;
        assert!(matches!(problem, $pattern), "{problem:?}");
    };
}

#[test]
fn the_base_of_these_tests_is_right() {
    let robot = robot(&[BASE, ARM, JOINT].concat());
    assert_eq!(
        urdf::parse(&robot, &Options::default())
            .unwrap()
            .model
            .dof_count(),
        1
    );
}

#[test]
fn a_joint_that_mimics_itself_is_refused() {
    let rest = "<child link='arm'/>\n<mimic joint='j' multiplier='2'/></joint>";
    let joint = JOINT.replace("<child link='arm'/></joint>", rest);
    let problem = refused(
        &robot(&[BASE, ARM, &joint].concat()),
        5,
        &["<mimic> of joint `j`", "mimic itself; name the joint"],
    );
    assert_problem!(problem, Problem::SelfMimic);
}

#[test]
fn other_documents_are_told_apart() {
    let not_xml = |text: &str, line, words: &[&str]| {
        assert_problem!(
            refused(text, line, words),
            Problem::Xml(XmlProblem::NotXml { .. })
        );
    };
    not_xml("no xml", 1, &["not well-formed XML"]);
    not_xml("<robot name='r'>\n<li<nk/></robot>", 2, &[]);
    not_xml("<robot name='r'>\n</rob>", 2, &["robot", "rob"]);
    not_xml(
        "<robot name='r'>\n<link name='a' name='b'/></robot>",
        2,
        &["name"],
    );
    not_xml("<robot name='r'>\n<sensor:camera/></robot>", 2, &["sensor"]);
    for text in ["", "<robot name='r'>\n<link name='a'/>", "<!-- -->"] {
        let error = refusal_of(text, &Options::default());
        assert_problem!(error.problem, Problem::Xml(XmlProblem::NotXml { .. }));
        assert_eq!(error.location.line, None, "{text}");
    }
    for (root, format) in [
        ("sdf", "SDF"),
        ("mujoco", "MJCF"),
        ("COLLADA", "COLLADA"),
        ("launch", "launch"),
        ("package", "manifest"),
    ] {
        let problem = refused(&format!("\n<{root}/>"), 2, &[format, root, "convert"]);
        assert_problem!(
            problem,
            Problem::NotRobot {
                looks_like: Some(_)
            }
        );
    }
    let problem = refused("<html/>", 1, &["<html>", "<robot>"]);
    assert_problem!(problem, Problem::NotRobot { looks_like: None });
    // Entities that expand to more than memory holds are not even looked at.
    let bomb = "<!DOCTYPE robot [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;'>]>\
                <robot name='&b;'/>";
    let error = refusal_of(bomb, &Options::default());
    assert_problem!(error.problem, Problem::Xml(XmlProblem::DocumentType));
    assert!(urdf::parse("<robot name='&b;'/>", &Options::default()).is_err());
}

#[test]
fn unexpanded_xacro_is_recognised() {
    let namespace = "xmlns:xacro='http://www.ros.org/wiki/xacro'";
    let inner = [BASE, ARM, JOINT].concat();
    let texts = [
        format!("<robot name='r' {namespace}>\n<xacro:include filename='a'/></robot>"),
        "<robot name='r'>\n<xacro:include filename='a'/></robot>".to_string(),
        format!("<robot name='r' {namespace}>\n<link name='a'><xacro:inertia/></link></robot>"),
        robot(&inner.replace("'base'", "'${prefix}base'")),
        robot(&ARM.replace("'1'", "'${m}'")),
        robot(&ARM.replace("'1'", "'$(arg m)'")),
    ];
    for text in texts {
        let problem = refused(&text, 2, &["xacro", "run xacro"]);
        assert_problem!(problem, Problem::Xml(XmlProblem::Unexpanded { .. }));
    }
    // Where nothing is read nothing need be expanded.
    let gazebo = robot(&(inner + "<gazebo><topic>camera_${name}</topic><a b='${c}'/></gazebo>"));
    assert!(urdf::parse(&gazebo, &Options::default()).is_ok());
}

#[test]
fn missing_parts_are_named() {
    let attribute = |text: &str, line, words: &[&str]| {
        assert_problem!(
            refused(text, line, words),
            Problem::Xml(XmlProblem::MissingAttribute { .. })
        );
    };
    let whole = [BASE, ARM, JOINT].concat();
    let without = |part: &str| {
        assert!(whole.contains(part));
        robot(&whole.replacen(part, "", 1))
    };
    attribute("<robot/>", 1, &["<robot>", "`name`"]);
    attribute("<robot name=''/>", 1, &["`name`"]);
    attribute(
        &without(" name='base'"),
        2,
        &["<link> of robot `test`", "`name`"],
    );
    attribute(&without(" name='j'"), 4, &["<joint>", "`name`"]);
    attribute(&without(" type='revolute'"), 4, &["joint `j`", "`type`"]);
    attribute(
        &without(" link='base'"),
        4,
        &["<parent> of joint `j`", "`link`"],
    );
    attribute(
        &without(" link='arm'"),
        4,
        &["<child> of joint `j`", "`link`"],
    );
    attribute(
        &without(" value='1'"),
        3,
        &["<mass> of link `arm`", "`value`"],
    );
    for entry in ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"] {
        let value = if entry.as_bytes()[1] == entry.as_bytes()[2] {
            1
        } else {
            0
        };
        let text = without(&format!(" {entry}='{value}'"));
        attribute(&text, 3, &["<inertia> of link `arm`", entry]);
    }
    let mimic = JOINT.replace("</joint>", "<mimic/></joint>");
    attribute(
        &robot(&[BASE, ARM, &mimic].concat()),
        4,
        &["<mimic> of joint `j`", "`joint`"],
    );

    let element = |text: &str, line, words: &[&str]| {
        assert_problem!(
            refused(text, line, words),
            Problem::Xml(XmlProblem::MissingElement { .. })
        );
    };
    element(
        &without("<parent link='base'/>"),
        4,
        &["joint `j`", "<parent>"],
    );
    element(
        &without("<child link='arm'/>"),
        4,
        &["joint `j`", "<child>"],
    );
    element(
        &without("<mass value='1'/>"),
        3,
        &["<inertial> of link `arm`", "<mass>"],
    );
    let inertia = "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>";
    element(
        &without(inertia),
        3,
        &["<inertial> of link `arm`", "<inertia>"],
    );
    let visual = |inner: &str| robot(&format!("<link name='a'><visual>{inner}</visual></link>\n"));
    element(&visual(""), 2, &["<visual> of link `a`", "<geometry>"]);
    element(
        &visual("<geometry/>"),
        2,
        &["<geometry> of link `a`", "<box>", "<mesh>"],
    );
    for shape in ["box", "cylinder", "sphere", "mesh"] {
        attribute(
            &visual(&format!("<geometry><{shape}/></geometry>")),
            2,
            &[shape],
        );
    }
    let twice = |part: &str| {
        let text = robot(&whole.replacen(part, &part.repeat(2), 1));
        assert_problem!(
            refused(&text, if part.contains("link=") { 4 } else { 3 }, &[]),
            Problem::Xml(XmlProblem::Repeated)
        );
    };
    twice("<parent link='base'/>");
    twice("<child link='arm'/>");
    twice("<mass value='1'/>");
    twice(inertia);
    assert_problem!(
        refused("<robot name='r'/>", 1, &["no links"]),
        Problem::NoLinks
    );
}

#[test]
fn numbers_are_checked() {
    let origin = |xyz: &str| {
        let joint = JOINT.replace("</joint>", &format!("\n<origin xyz='{xyz}'/></joint>"));
        robot(&[BASE, ARM, &joint].concat())
    };
    let element = "<origin> of joint `j`";
    for bad in [
        "a b c", "1,2,3", "1 2 0x3", "--1 0 0", "1 2 3m", "1e 0 0", "٣ 0 0",
    ] {
        let problem = refused(&origin(bad), 5, &[element, "`xyz`", "not a number"]);
        assert_problem!(problem, Problem::Xml(XmlProblem::NotANumber { .. }));
    }
    for bad in [
        "nan 0 0",
        "0 inf 0",
        "0 0 -Infinity",
        "1e999 0 0",
        "NaN NaN NaN",
    ] {
        let problem = refused(&origin(bad), 5, &[element, "`xyz`", "not finite"]);
        assert_problem!(problem, Problem::Xml(XmlProblem::NonFinite { .. }));
    }
    for (bad, count) in [("", 0), ("1", 1), ("1 2", 2), ("1 2 3 4", 4)] {
        match refused(&origin(bad), 5, &[element, "needs 3"]) {
            Problem::Xml(XmlProblem::WrongCount { found, .. }) => assert_eq!(found, count),
            other => panic!("{other:?}"),
        }
    }
    let mass = |value: &str| robot(&[BASE, &ARM.replacen("'1'", value, 1), JOINT].concat());
    assert_problem!(
        refused(&mass("'1 2'"), 3, &["<mass>"]),
        Problem::Xml(XmlProblem::WrongCount { .. })
    );
    assert_problem!(
        refused(&mass("'  '"), 3, &["<mass>"]),
        Problem::Xml(XmlProblem::WrongCount { .. })
    );
    for (element, attribute) in [
        ("limit", "effort"),
        ("dynamics", "damping"),
        ("axis", "xyz"),
    ] {
        let joint = JOINT.replace("</joint>", &format!("<{element} {attribute}='x'/></joint>"));
        let text = robot(&[BASE, ARM, &joint].concat());
        let problem = refused(&text, 4, &[element, attribute]);
        assert_problem!(problem, Problem::Xml(XmlProblem::NotANumber { .. }));
    }
    let shape = |shape: &str| {
        let visual = format!("<link name='a'><visual><geometry>{shape}</geometry></visual></link>");
        assert_problem!(
            refused(&robot(&visual), 2, &["-1 m"]),
            Problem::NegativeSize { .. }
        );
    };
    shape("<box size='1 -1 1'/>");
    shape("<sphere radius='-1'/>");
    shape("<cylinder radius='1' length='-1'/>");
}

#[test]
fn references_must_form_one_tree() {
    let whole = [BASE, ARM, JOINT].concat();
    let with = |more: &str| robot(&(whole.clone() + more));
    let problem = refused(&with(BASE), 5, &["link `base`", "line 2"]);
    assert_problem!(problem, Problem::DuplicateName { first_line: 2 });
    let second = JOINT.replace("'arm'", "'tip'") + "<link name='tip'/>\n";
    let problem = refused(&with(&second), 5, &["joint `j`", "line 4"]);
    assert_problem!(problem, Problem::DuplicateName { first_line: 4 });
    for link in ["base", "arm"] {
        let joint = JOINT.replace(&format!("link='{link}'"), "link='nobody'");
        let text = robot(&[BASE, ARM, &joint].concat());
        let problem = refused(&text, 4, &["joint `j`", "`nobody`"]);
        assert_problem!(problem, Problem::UnknownLink { .. });
    }
    let problem = refused(
        &with("<link name='x'/><link name='y'/>"),
        1,
        &["`base`, `x`, `y`"],
    );
    assert_problem!(problem, Problem::SeveralRoots { .. });
    let many: String = (0..30).map(|i| format!("<link name='l{i}'/>")).collect();
    refused(&with(&many), 1, &["31 links", "`l8` and 21 more"]);

    let other = JOINT.replace("'j'", "'k'");
    let problem = refused(&with(&other), 5, &["joint `k`", "`arm`", "`j`", "line 4"]);
    assert_problem!(problem, Problem::TwoParents { .. });

    let cycle = |text: String, line, names: &[&str]| match refused(&text, line, &["circle"]) {
        Problem::Cycle { mut links } => {
            links.sort();
            assert_eq!(links, names);
        }
        other => panic!("{other:?}"),
    };
    let back = "<joint name='k' type='fixed'><parent link='arm'/><child link='base'/></joint>\n";
    cycle(with(back), 3, &["arm", "base"]);
    let own = JOINT.replace("'base'", "'arm'");
    cycle(robot(&[BASE, ARM, &own].concat()), 3, &["arm"]);
    // A circle beside a proper tree, with a tail.
    let beside = "<link name='a'/><link name='b'/><link name='tail'/>\
        <joint name='x' type='fixed'><parent link='a'/><child link='b'/></joint>\
        <joint name='y' type='fixed'><parent link='b'/><child link='a'/></joint>\
        <joint name='z' type='fixed'><parent link='b'/><child link='tail'/></joint>\n";
    cycle(with(beside), 5, &["a", "b"]);
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    for kind in ["Planar", "ball", "Revolute", "universal"] {
        let text = robot(&[BASE, ARM, &JOINT.replace("revolute", kind)].concat());
        let problem = refused(&text, 4, &["joint `j`", kind, "revolute"]);
        assert_problem!(problem, Problem::UnsupportedJoint { .. });
    }
    let fixed = robot(&[BASE, ARM, &JOINT.replace("revolute", "fixed")].concat());
    assert_problem!(
        refused(&fixed, 1, &["no link moves"]),
        Problem::NothingMoves
    );
    assert_problem!(refused(&robot(ARM), 1, &[]), Problem::NothingMoves);
    let floating = urdf::parse(&robot(ARM), &Options::default().floating_base()).unwrap();
    assert_eq!(floating.model.dof_count(), 6);
    for options in [Options::default(), Options::default().keep_fixed()] {
        let error = refusal_of(
            &robot(&[BASE, ARM, JOINT].concat()),
            &options.floating_base(),
        );
        assert_problem!(&error.problem, Problem::MasslessBase);
        assert!(
            error.to_string().starts_with("line 2: link `base`"),
            "{error}"
        );
    }

    // What the model itself refuses, at the link or joint it speaks of.
    let whole = [BASE, ARM, JOINT].concat();
    let model = |text: String, line, words: &[&str]| match refused(&text, line, words) {
        Problem::Model(error) => error,
        other => panic!("{other:?}"),
    };
    let inside = |element: &str| robot(&whole.replace("</joint>", &format!("{element}</joint>")));
    let error = model(inside("<axis xyz='0 0 0'/>"), 4, &["joint `j`", "axis"]);
    assert!(matches!(error, ModelError::ZeroAxis { .. }));
    let limited = inside("<limit lower='1' upper='0.5' effort='1' velocity='1'/>");
    let error = model(limited, 4, &["joint `j`", "lower position limit 1"]);
    assert!(matches!(error, ModelError::EmptyRange { .. }));
    for (element, words) in [
        ("<limit effort='-2' velocity='1'/>", "effort limit"),
        ("<limit effort='1' velocity='-2'/>", "velocity limit"),
        ("<dynamics damping='-2'/>", "damping"),
        ("<dynamics friction='-2'/>", "friction"),
    ] {
        let error = model(inside(element), 4, &["joint `j`", words, "-2"]);
        assert!(matches!(error, ModelError::Negative { .. }));
    }
    let massless = robot(&[BASE, "<link name='arm'/>\n", JOINT].concat());
    let error = model(massless, 4, &["joint `j`", "moves no inertia"]);
    assert!(matches!(error, ModelError::MasslessBody { .. }));
    let error = model(
        robot(&whole.replace("izz='1'", "izz='3'")),
        3,
        &["link `arm`", "sum"],
    );
    assert!(matches!(error, ModelError::NonPhysicalInertia { .. }));
    let error = model(
        robot(&whole.replace("izz='1'", "izz='-1'")),
        3,
        &["link `arm`"],
    );
    assert!(matches!(error, ModelError::NonPhysicalInertia { .. }));
    let error = model(
        robot(&whole.replace("mass value='1'", "mass value='-1'")),
        3,
        &["-1 kg"],
    );
    assert!(matches!(error, ModelError::NegativeMass { .. }));
    // Folding must not hide it.
    let hidden = "<link name='hook'><inertial><mass value='-0.1'/>\
        <inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial></link>\n\
        <joint name='f' type='fixed'><parent link='arm'/><child link='hook'/></joint>\n";
    let error = model(robot(&(whole.clone() + hidden)), 5, &["`hook`", "-0.1 kg"]);
    assert!(matches!(error, ModelError::NegativeMass { .. }));
    let far = |kind: &str| {
        let joint = JOINT.replace("</joint>", "<origin xyz='1e200 0 0'/></joint>");
        robot(&[BASE, ARM, &joint.replace("revolute", kind)].concat())
    };
    let error = model(far("revolute"), 4, &["joint `j`", "1e200"]);
    assert!(matches!(error, ModelError::AbsurdSize { .. }));
    let gravity = glam::DVec3::new(0.0, f64::NAN, 0.0);
    let error = refusal_of(&robot(&whole), &Options::default().gravity(gravity));
    assert_problem!(error.problem, Problem::Model(ModelError::NonFinite { .. }));
    assert_eq!(error.location.element, "robot `test`");
}

#[test]
fn files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.urdf");
    let error = Model::from_urdf(&path).unwrap_err();
    assert_problem!(&error.problem, Problem::Unreadable(_));
    assert!(error.to_string().contains("arm.urdf"), "{error}");

    fs::write(&path, robot(&[BASE, ARM, JOINT].concat())).unwrap();
    assert_eq!(Model::from_urdf(&path).unwrap().dof_count(), 1);
    fs::write(&path, robot(&[BASE, ARM, BASE].concat())).unwrap();
    let message = Model::from_urdf(&path).unwrap_err().to_string();
    assert!(message.contains("arm.urdf:4: link `base`: "), "{message}");
    fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
    let error = Model::from_urdf(&path).unwrap_err();
    assert_problem!(error.problem, Problem::Unreadable(_));
    assert!(
        Model::from_urdf(folder.path()).is_err(),
        "a folder is not a file"
    );
}

/// A robot with these meshes, in order.
fn with_meshes(files: &[&str]) -> String {
    let visual =
        |file: &&str| format!("<visual><geometry><mesh filename='{file}'/></geometry></visual>\n");
    let visuals: String = files.iter().map(visual).collect();
    let base = format!("<link name='base'>\n{visuals}</link>\n");
    robot(&[base.as_str(), ARM, JOINT].concat())
}

fn mesh(robot: &Robot, index: usize) -> &Mesh {
    match &robot.geometry[index].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

#[test]
fn meshes_are_found_where_they_lie() {
    let root = tempfile::tempdir().unwrap();
    let touch = |path: &str| {
        let path = root.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, "").unwrap();
        path
    };
    let near = touch("ws/arm_description/meshes/near.stl");
    let beside = touch("ws/hand_description/meshes/beside.stl");
    let elsewhere = touch("store/tool_description/meshes/tool.stl");
    let relative = touch("ws/arm_description/urdf/relative.stl");
    let stray = touch("store/stray.stl");
    let text = with_meshes(&[
        "package://arm_description/meshes/near.stl",
        "package:///arm_description/meshes/near.stl",
        "package://hand_description/meshes/beside.stl",
        "package://tool_description/meshes/tool.stl",
        "relative.stl",
        "../meshes/near.stl",
        "stray.stl",
        &format!("file://{}", near.display()),
        &near.display().to_string(),
        "model://arm_description/meshes/near.stl",
    ]);
    let path = root.path().join("ws/arm_description/urdf/arm.urdf");
    fs::write(&path, &text).unwrap();
    let expected = [
        &near, &near, &beside, &elsewhere, &relative, &near, &stray, &near, &near, &near,
    ];
    let same = |found: &std::path::Path, expected: &std::path::Path| {
        assert_eq!(
            fs::canonicalize(found).unwrap(),
            fs::canonicalize(expected).unwrap()
        );
    };
    let store = root.path().join("store");
    let robot = urdf::read(&path, &Options::default().search_path(&store)).unwrap();
    for (index, expected) in expected.iter().enumerate() {
        same(&robot.mesh_path(mesh(&robot, index)).unwrap(), expected);
    }
    // A search path may be the package itself, also for text without a file.
    let tool = store.join("tool_description");
    let robot = urdf::parse(&text, &Options::default().search_path(tool)).unwrap();
    same(&robot.mesh_path(mesh(&robot, 3)).unwrap(), &elsewhere);
    assert!(robot.mesh_path(mesh(&robot, 4)).is_err());
}

#[test]
fn missing_meshes_matter_only_when_asked_for() {
    let text = with_meshes(&[
        "package://arm/a.stl",
        "https://example.org/a.stl",
        "a.stl",
        "package://",
        "",
    ]);
    let empty = refusal_of(&text, &Options::default());
    assert_problem!(
        empty.problem,
        Problem::Xml(XmlProblem::MissingAttribute { .. })
    );
    let text = text.replace("filename=''", "filename='.'");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.urdf");
    fs::write(&path, &text).unwrap();
    let robot = urdf::read(&path, &Options::default().search_path("meshes")).unwrap();
    let refused = |index| robot.mesh_path(mesh(&robot, index)).unwrap_err();

    let error = refused(0);
    assert_eq!(error.location.line, Some(3));
    let message = error.to_string();
    for word in [
        "arm.urdf:3: ",
        "<mesh> of link `base`",
        "package://arm/a.stl",
        "search paths",
    ] {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
    match error.problem {
        Problem::MeshNotFound { looked, .. } => {
            assert_eq!(looked[0], std::path::Path::new("meshes/arm/a.stl"));
            assert!(looked.contains(&folder.path().join("arm/a.stl")));
        }
        other => panic!("{other:?}"),
    }
    assert_problem!(refused(1).problem, Problem::MeshAddress { .. });
    for index in [2, 3, 4] {
        assert_problem!(refused(index).problem, Problem::MeshNotFound { .. });
    }
    let robot = urdf::parse(&text, &Options::default()).unwrap();
    let message = robot.mesh_path(mesh(&robot, 2)).unwrap_err().to_string();
    assert!(message.starts_with("line 5: "), "{message}");
    assert!(message.contains("nowhere"), "{message}");
}
