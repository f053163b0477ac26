//! Arbitrary and damaged input never panics, and what is accepted is a sound model.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use proptest::prelude::*;
use vertebra_assembly::generate::{self, RandomTree};
use vertebra_assembly::{Model, State};

/// What damage is done with.
const DEBRIS: [&str; 22] = [
    "nan",
    "inf",
    "-1",
    "1e999",
    "1e308",
    "-1e-320",
    "0",
    "",
    " ",
    "'",
    "\"",
    "<",
    ">",
    "/>",
    "${",
    "&lt;",
    "&b;",
    "<!--",
    "\0",
    "null",
    "\u{feff}",
    "<joint name='x' type='fixed'>",
];

/// One thing that happens to a text; positions are in 1/1024 of its length.
#[derive(Clone, Debug)]
enum Damage {
    Cut(usize, usize),
    Truncate(usize),
    Insert(usize, usize),
    /// A number becomes something else.
    Number(usize, usize),
    /// A stretch is written once more elsewhere.
    Copy(usize, usize, usize),
    /// Two neighbouring stretches change places.
    Swap(usize, usize, usize),
}

fn damages() -> impl Strategy<Value = Vec<Damage>> {
    let at = 0..1024_usize;
    let damage = prop_oneof![
        (at.clone(), 1..40_usize).prop_map(|(a, n)| Damage::Cut(a, n)),
        at.clone().prop_map(Damage::Truncate),
        (at.clone(), 0..DEBRIS.len()).prop_map(|(a, i)| Damage::Insert(a, i)),
        (at.clone(), 0..DEBRIS.len()).prop_map(|(a, i)| Damage::Number(a, i)),
        (at.clone(), 1..200_usize, at.clone()).prop_map(|(a, n, b)| Damage::Copy(a, n, b)),
        (at, 1..60_usize, 1..60_usize).prop_map(|(a, n, m)| Damage::Swap(a, n, m)),
    ];
    prop::collection::vec(damage, 1..4)
}

fn damaged(text: &str, damages: &[Damage]) -> String {
    let mut text: Vec<char> = text.chars().collect();
    for damage in damages {
        let length = text.len();
        let place = |at: &usize| at * length / 1024;
        let end = |from: usize, n: usize| (from + n).min(length);
        match damage {
            Damage::Cut(a, n) => drop(text.drain(place(a)..end(place(a), *n))),
            Damage::Truncate(a) => text.truncate(place(a)),
            Damage::Insert(a, i) => drop(text.splice(place(a)..place(a), DEBRIS[*i].chars())),
            Damage::Number(a, i) => {
                let is_number = |c: &char| c.is_ascii_digit() || "+-.".contains(*c);
                let from = (place(a)..length)
                    .find(|&at| is_number(&text[at]))
                    .unwrap_or(length);
                let to = (from..length)
                    .find(|&at| !is_number(&text[at]))
                    .unwrap_or(length);
                drop(text.splice(from..to, DEBRIS[*i].chars()));
            }
            Damage::Copy(a, n, b) => {
                let stretch = text[place(a)..end(place(a), *n)].to_vec();
                drop(text.splice(place(b)..place(b), stretch));
            }
            Damage::Swap(a, n, m) => {
                let from = place(a);
                let to = end(from, n + m);
                text[from..to].rotate_left((*n).min(to - from));
            }
        }
    }
    text.into_iter().collect()
}

/// A model that was accepted has nothing but finite numbers, before and after it moves.
fn assert_sound(model: &Model) {
    let state = State::random(model, 1);
    state.check(model).unwrap();
    for placement in common::body_placements(model, &state.q) {
        assert!(placement.is_finite(), "{placement}");
    }
    for body in model.bodies() {
        assert!(body.mass.mass >= 0.0 && body.mass.violation().is_none());
        assert!(
            body.parent
                .is_none_or(|parent| model.body(parent).is_some())
        );
    }
    model.describe().build().unwrap();
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 5000,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn json() -> &'static str {
    static TEXT: std::sync::OnceLock<String> = std::sync::OnceLock::new();
    TEXT.get_or_init(|| {
        let model = generate::random_tree(&RandomTree::mixed(4), 3).unwrap();
        serde_json::to_string_pretty(&model).unwrap()
    })
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn damaged_json_is_refused_or_sound(damages in damages()) {
        match serde_json::from_str::<Model>(&damaged(json(), &damages)) {
            Ok(model) => assert_sound(&model),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }

    #[test]
    fn arbitrary_json_is_refused(text in any::<String>()) {
        assert!(serde_json::from_str::<Model>(&text).is_err());
        assert!(serde_json::from_str::<State>(&text).is_err());
    }
}

#[cfg(feature = "urdf")]
mod urdf {
    use super::{assert_sound, config, damaged, damages};
    use proptest::prelude::*;
    use vertebra_assembly::urdf::{Options, Shape, parse};

    /// A small robot that has one of everything.
    const ROBOT: &str = "<?xml version='1.0'?>
<robot name='small' xmlns:sensor='http://example.org/sensor'>
  <material name='grey'><color rgba='0.5 0.5 0.5 1'/></material>
  <link name='base'>
    <inertial><origin xyz='0 0 0.1' rpy='0.1 0 0'/><mass value='3'/>
      <inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.15'/></inertial>
    <visual><origin xyz='0 0 0.5'/><geometry><box size='1 1 1'/></geometry></visual>
    <collision><geometry><mesh filename='package://small/base.stl' scale='1 1 1'/></geometry></collision>
  </link>
  <link name='upper'>
    <inertial><mass value='1.5e0'/><inertia ixx='0.01' ixy='0.001' ixz='0' iyy='0.02' iyz='0' izz='0.02'/></inertial>
    <visual><geometry><cylinder radius='0.1' length='0.4'/></geometry><material name='grey'/></visual>
  </link>
  <link name='plate'/>
  <link name='finger'>
    <inertial><origin xyz='0.01 0 0'/><mass value='0.2'/><inertia ixx='1e-3' ixy='0' ixz='0' iyy='1e-3' iyz='0' izz='1e-3'/></inertial>
    <collision><geometry><sphere radius='0.02'/></geometry></collision>
  </link>
  <joint name='shoulder' type='revolute'><parent link='base'/><child link='upper'/>
    <origin xyz='0 0.2 1' rpy='0 1.57 0'/><axis xyz='0 1 0'/>
    <limit lower='-2' upper='2' velocity='3' effort='40'/><dynamics damping='0.1' friction='0.2'/></joint>
  <joint name='weld' type='fixed'><parent link='upper'/><child link='plate'/><origin xyz='0 0 0.4'/></joint>
  <joint name='grip' type='prismatic'><parent link='plate'/><child link='finger'/><axis xyz='0 0 1'/>
    <limit upper='0.05' velocity='1' effort='1'/><mimic joint='shoulder' multiplier='0.1' offset='0'/></joint>
  <gazebo reference='base'><sensor:camera/></gazebo>
</robot>";

    fn refused_or_sound(text: &str) {
        let plain = Options::default;
        for options in [plain(), plain().floating_base(), plain().keep_fixed()] {
            match parse(text, &options) {
                Ok(robot) => {
                    assert_sound(&robot.model);
                    for geometry in &robot.geometry {
                        assert!(geometry.placement.is_valid());
                        if let Shape::Mesh(mesh) = &geometry.shape {
                            let error = robot.mesh_path(mesh).unwrap_err();
                            assert!(!error.to_string().is_empty());
                        }
                    }
                }
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }

    #[test]
    fn the_undamaged_robot_is_read() {
        let robot = parse(ROBOT, &Options::default().floating_base()).unwrap();
        assert_eq!(robot.model.dof_count(), 8);
        assert_sound(&robot.model);
    }

    proptest! {
        #![proptest_config(config())]

        #[test]
        fn damaged_files_are_refused_or_sound(damages in damages()) {
            refused_or_sound(&damaged(ROBOT, &damages));
        }

        #[test]
        fn arbitrary_text_is_refused(text in any::<String>()) {
            assert!(parse(&text, &Options::default()).is_err());
        }

        /// Elements of URDF in no order at all.
        #[test]
        fn arbitrary_elements_are_refused_or_sound(
            pieces in prop::collection::vec(0..ROBOT.lines().count(), 0..30),
        ) {
            let lines: Vec<&str> = ROBOT.lines().collect();
            let body: String = pieces.iter().map(|&line| lines[line]).collect();
            refused_or_sound(&format!("<robot name='r'>{body}</robot>"));
        }
    }
}
