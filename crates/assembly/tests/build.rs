//! Models as they are built and saved: order, size, JSON.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::Digest;
use glam::DVec3;
use serde_json::Value;
use vertebra_assembly::generate::{self, RandomTree, Rod};
use vertebra_assembly::{
    Joint, JointLimits, MassProperties, Mimic, Model, ModelDescription, Random, State,
};
use vertebra_spatial::Pose;

fn rod() -> MassProperties {
    MassProperties::rod(1.0, 0.5, 0.02)
}

/// Two bodies and a frame that have all there is to save.
fn an_arm() -> Model {
    let mut lower = Joint::revolute(DVec3::new(0.1, 0.2, 0.3))
        .at(Pose::from_translation(DVec3::new(0.0, 0.0, 0.5)))
        .on_child(Pose::from_translation(DVec3::new(0.1, 0.0, 0.0)));
    lower.limits = Some(JointLimits {
        position: Some([-1.0 / 3.0, 1.0 / 7.0]),
        velocity: Some(0.1),
        effort: None,
        orientation: None,
    });
    lower.damping = 0.1;
    lower.friction = 1e-320;
    lower.mimic = Some(Mimic {
        body: "upper".to_owned(),
        multiplier: 2.0 / 3.0,
        offset: -0.0,
    });
    ModelDescription::new("arm")
        .body("upper", None, Joint::prismatic(DVec3::X), rod())
        .body("lower", Some("upper"), lower, rod())
        .frame("tool", Some("lower"), Pose::IDENTITY)
        .build()
        .unwrap()
}

fn some_models() -> Vec<Model> {
    let mut models = vec![an_arm()];
    for case in 0..40 {
        let tree = RandomTree {
            articulations: 1 + case % 3,
            ..RandomTree::mixed(1 + 3 * case)
        };
        models.push(generate::random_tree(&tree, case as u64).unwrap());
    }
    models
}

#[test]
fn models_and_states_survive_json_bit_for_bit() {
    for model in some_models() {
        let text = serde_json::to_string(&model).unwrap();
        let back: Model = serde_json::from_str(&text).unwrap();
        assert_eq!(model.describe(), back.describe());
        assert_eq!(Digest::of(&model.describe()), Digest::of(&back.describe()));
        assert_eq!(text, serde_json::to_string(&back).unwrap());
        assert_eq!(model.units(), back.units());

        let mut state = State::random(&model, 9);
        state.time = 0.1 + 0.2;
        let text = serde_json::to_string(&state).unwrap();
        let back: State = serde_json::from_str(&text).unwrap();
        assert_eq!(Digest::of_state(&state), Digest::of_state(&back));
    }
}

#[test]
fn malformed_json_is_refused_with_a_reason() {
    let good = serde_json::to_string(&an_arm()).unwrap();
    let reason = |text: &str| serde_json::from_str::<Model>(text).unwrap_err().to_string();
    let replaced = |from: &str, to: &str| {
        assert!(good.contains(from), "{from} is not in {good}");
        reason(&good.replacen(from, to, 1))
    };
    for text in ["", "{", "[]", "null", "7", "\"model\"", "{\"version\":1}"] {
        assert!(!reason(text).is_empty());
    }
    for length in 0..good.len() {
        assert!(serde_json::from_str::<Model>(&good[..length]).is_err());
    }
    assert!(replaced("\"version\":1", "\"version\":9").contains("version 9"));
    assert!(replaced("\"version\":1", "\"version\":-1").contains("-1"));
    assert!(replaced("\"prismatic\"", "\"planar\"").contains("planar"));
    assert!(replaced("\"parent\":\"upper\"", "\"parent\":\"lower\"").contains("own ancestor"));
    assert!(replaced("\"mass\":1.0", "\"mass\":null").contains("null"));
    assert!(replaced("\"mass\":1.0", "\"mass\":1e999").contains("number out of range"));
    assert!(replaced("\"mass\":1.0", "\"mass\":-1.0").contains("negative mass"));

    let state = serde_json::to_string(&State::neutral(&an_arm())).unwrap();
    let state_reason = |text: &str| serde_json::from_str::<State>(text).unwrap_err().to_string();
    assert!(state_reason(&state.replace("\"version\":1", "\"version\":2")).contains("version 2"));
    assert!(state_reason(&state.replace("\"time\":0.0", "\"time\":null")).contains("null"));
}

/// A name misspelt must not pass for a default. (A pose has no defaults.)
#[test]
fn unknown_fields_are_refused() {
    fn count_objects(value: &Value) -> usize {
        match value {
            Value::Object(map) if map.contains_key("rotation") => 0,
            Value::Object(map) => 1 + map.values().map(count_objects).sum::<usize>(),
            Value::Array(list) => list.iter().map(count_objects).sum(),
            _ => 0,
        }
    }
    /// Adds the field to the object of that number, in depth-first order.
    fn misspell(value: &mut Value, number: &mut usize) {
        match value {
            Value::Object(map) if map.contains_key("rotation") => {}
            Value::Object(map) => {
                map.values_mut().for_each(|value| misspell(value, number));
                if *number == 0 {
                    map.insert("dampng".to_owned(), 3.into());
                }
                *number = number.wrapping_sub(1);
            }
            Value::Array(list) => list.iter_mut().for_each(|value| misspell(value, number)),
            _ => {}
        }
    }
    let model = serde_json::to_value(an_arm()).unwrap();
    // The model, two bodies with joint and mass each, limits, a mimic, a frame.
    assert_eq!(count_objects(&model), 10);
    for number in 0..10 {
        let mut damaged = model.clone();
        misspell(&mut damaged, &mut number.clone());
        let reason = serde_json::from_value::<Model>(damaged)
            .unwrap_err()
            .to_string();
        assert!(reason.contains("unknown field `dampng`"), "{reason}");
    }
    let mut state = serde_json::to_value(State::neutral(&an_arm())).unwrap();
    misspell(&mut state, &mut 0);
    let reason = serde_json::from_value::<State>(state)
        .unwrap_err()
        .to_string();
    assert!(reason.contains("unknown field `dampng`"), "{reason}");
}

#[test]
fn joints_have_the_axis_of_their_kind() {
    let read = |text: &str| serde_json::from_str::<Joint>(text).map_err(|e| e.to_string());
    assert_eq!(read(r#"{"type":"spherical"}"#), Ok(Joint::spherical()));
    assert_eq!(
        read(r#"{"type":"revolute","axis":[0,0,1]}"#),
        Ok(Joint::revolute(DVec3::Z))
    );
    for text in [
        r#"{"type":"prismatic"}"#,
        r#"{"type":"fixed","axis":[0,0,1]}"#,
    ] {
        let reason = read(text).unwrap_err();
        assert!(reason.contains("axis"), "{reason}");
    }
}

/// Bodies written in any order: parents come first, and nothing moves that need not.
#[test]
fn unordered_descriptions_are_ordered_stably() {
    for (seed, model) in some_models().into_iter().enumerate() {
        let mut random = Random::new(seed as u64);
        let mut shuffled = model.describe();
        for index in (1..shuffled.bodies.len()).rev() {
            shuffled.bodies.swap(index, random.below(index + 1));
        }
        let written: Vec<String> = shuffled.bodies.iter().map(|b| b.name.clone()).collect();
        let position = |name: &str| written.iter().position(|other| other == name).unwrap();
        let built = shuffled.build().unwrap();
        let bodies = built.bodies();
        assert_eq!(bodies.len(), written.len());
        for (index, body) in bodies.iter().enumerate() {
            assert!(body.parent.is_none_or(|parent| parent.index() < index));
            // Whoever stands behind one that was written later had to wait for it, as for an
            // ancestor, or for an ancestor written later still.
            let latest_ancestor = core::iter::successors(body.parent, |p| bodies[p.index()].parent)
                .map(|ancestor| position(&bodies[ancestor.index()].name))
                .max();
            for before in &bodies[..index] {
                let late = position(&before.name) > position(&body.name);
                assert!(!late || latest_ancestor >= Some(position(&before.name)));
            }
        }
        // The result is in order, so building it again keeps it.
        let again = built.describe().build().unwrap();
        assert_eq!(built.describe(), again.describe());
    }
}

#[test]
fn several_articulations_stand_side_by_side() {
    let joint = Joint::revolute(DVec3::X);
    let model = ModelDescription::new("forest")
        .body("a", None, joint.clone(), rod())
        .body("b", None, joint.clone(), rod())
        .body("b2", Some("b"), joint.clone(), rod())
        .body("a2", Some("a"), joint.clone(), rod())
        .body("b3", Some("b2"), joint, rod())
        .build()
        .unwrap();
    assert_eq!(model.depth(), 3);
    let names: Vec<_> = model.bodies().iter().map(|b| b.name.as_str()).collect();
    assert_eq!(names, ["a", "b", "b2", "a2", "b3"]);
    assert_eq!(model.last_body(), model.find("b3").unwrap());
    assert_eq!(model.find("c"), None);
}

/// Nothing recurses: a chain may be as deep as it is long, in either order of writing.
#[test]
fn long_chains_build() {
    let count = 200_000;
    let joint = Joint::revolute(DVec3::X);
    let model = generate::chain(count, &joint, &Rod::default()).unwrap();
    assert_eq!(model.depth(), count);
    let mut description = model.describe();
    description.bodies.reverse();
    let model = description.build().unwrap();
    assert_eq!(model.depth(), count);
    assert_eq!(model.bodies()[0].name, "body-0");
    // And where the mass is only at the very end.
    let mut description = model.describe();
    for body in &mut description.bodies[..count - 1] {
        body.mass = MassProperties::MASSLESS;
    }
    description.build().unwrap();
}
