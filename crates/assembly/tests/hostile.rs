//! Arbitrary and damaged input never panics, and what is accepted is a sound model.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;
#[path = "common/damage.rs"]
mod damage;

use damage::{damaged, damages};
use proptest::prelude::*;
use vertebra_assembly::generate::{self, RandomTree};
use vertebra_assembly::{Model, State};

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
