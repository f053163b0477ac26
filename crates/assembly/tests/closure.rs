//! Loops and couplings: what is refused, and that models are saved with them.

use glam::DVec3;
use vertebra_assembly::{
    Closure, Joint, MassProperties, Model, ModelDescription, ModelError, mechanism,
};
use vertebra_spatial::Pose;

fn arms() -> ModelDescription {
    let rod = MassProperties::rod(1.0, 0.5, 0.05);
    ModelDescription::new("arms")
        .body("a", None, Joint::revolute(DVec3::X), rod)
        .body("b", Some("a"), Joint::prismatic(DVec3::X), rod)
        .body("ball", Some("b"), Joint::spherical(), rod)
}

fn close(ends: [Option<&str>; 2], closure: Closure) -> Result<Model, ModelError> {
    arms()
        .close("loop", ends, [Pose::IDENTITY; 2], closure)
        .build()
}

#[test]
fn impossible_closures_are_refused_by_name() {
    let ends = [Some("a"), Some("ball")];
    let named = |error: ModelError| {
        let message = error.to_string();
        assert!(
            message.contains("`loop`") || message.contains("closure"),
            "{message}"
        );
        error
    };
    let unknown = named(close([Some("a"), Some("c")], Closure::Weld).unwrap_err());
    assert!(matches!(
        unknown,
        ModelError::UnknownBody { meant: None, .. }
    ));
    let slip = named(close([Some("a"), Some("bal")], Closure::Weld).unwrap_err());
    assert!(slip.to_string().contains("is `ball` meant?"), "{slip}");
    for itself in [[Some("a"); 2], [None; 2]] {
        let error = named(close(itself, Closure::Ball).unwrap_err());
        assert!(matches!(error, ModelError::SelfLoop { .. }));
    }
    let zero = named(
        close(
            ends,
            Closure::Planar {
                normal: DVec3::ZERO,
            },
        )
        .unwrap_err(),
    );
    assert!(matches!(zero, ModelError::ZeroAxis { .. }));
    let nan = Closure::Screw {
        axis: DVec3::X,
        pitch: f64::NAN,
    };
    assert!(matches!(
        named(close(ends, nan).unwrap_err()),
        ModelError::NonFinite { .. }
    ));
    let infinite = Closure::Universal {
        first: DVec3::X,
        second: DVec3::INFINITY,
    };
    assert!(matches!(
        named(close(ends, infinite).unwrap_err()),
        ModelError::NonFinite { .. }
    ));
    for length in [0.0, -1.0] {
        let error = named(close(ends, Closure::Distance { length }).unwrap_err());
        assert!(matches!(error, ModelError::OutOfRange { .. }));
    }
    let twice = arms()
        .close("loop", ends, [Pose::IDENTITY; 2], Closure::Ball)
        .couple("loop", "a", "b", 1.0, 0.0)
        .build();
    assert!(matches!(twice, Err(ModelError::DuplicateName { .. })));
    let mut stretched = Pose::IDENTITY;
    stretched.rotation.w = 2.0;
    let error = arms()
        .close("loop", ends, [stretched; 2], Closure::Ball)
        .build();
    assert!(matches!(error, Err(ModelError::NonUnitQuaternion { .. })));
}

#[test]
fn impossible_couplings_are_refused_by_name() {
    let couple = |body: &str, other: &str, ratio, offset| {
        arms()
            .couple("gears", body, other, ratio, offset)
            .build()
            .unwrap_err()
    };
    assert!(matches!(
        couple("a", "c", 1.0, 0.0),
        ModelError::UnknownBody { .. }
    ));
    assert!(matches!(
        couple("a", "a", 1.0, 0.0),
        ModelError::SelfLoop { .. }
    ));
    assert!(matches!(
        couple("a", "b", f64::NAN, 0.0),
        ModelError::NonFinite { .. }
    ));
    let error = couple("a", "ball", 1.0, 0.0);
    assert!(matches!(
        error,
        ModelError::CoupledFreedoms { freedoms: 3, .. }
    ));
    assert!(error.to_string().contains("`ball`"), "{error}");
}

#[test]
fn models_are_saved_with_their_loops() {
    let (leg, _) = mechanism::jansen_leg().unwrap();
    let mut description = leg.describe().couple("belt", "crank", "arm", -0.5, 0.25);
    for closure in [
        Closure::Weld,
        Closure::Prismatic { axis: DVec3::X },
        Closure::Screw {
            axis: DVec3::Y,
            pitch: 0.1,
        },
        Closure::Cylindrical { axis: DVec3::Z },
        Closure::Universal {
            first: DVec3::X,
            second: DVec3::Y,
        },
        Closure::Planar { normal: DVec3::Z },
        Closure::Distance { length: 2.0 },
    ] {
        let name = format!("{closure:?}");
        let ends = [Some("arm"), None];
        description = description.close(name, ends, [Pose::IDENTITY; 2], closure);
    }
    let model = description.build().unwrap();
    let text = serde_json::to_string(&model).unwrap();
    let read: Model = serde_json::from_str(&text).unwrap();
    assert_eq!(read.describe(), model.describe());
    assert_eq!((read.loops().len(), read.couplings().count()), (10, 1));
    // A model without loops is written as before.
    let plain = serde_json::to_string(&arms().build().unwrap()).unwrap();
    assert!(!plain.contains("loops") && !plain.contains("couplings"));
}

#[test]
fn linkages_that_do_not_meet_are_refused() {
    let refused = mechanism::four_bar(5.0, 0.3, 0.9, 0.7, 0.4);
    assert!(matches!(refused, Err(ModelError::BadParameter { .. })));
}

#[test]
fn loops_stay_while_their_bodies_do() {
    let (leg, state) = mechanism::jansen_leg().unwrap();
    let leg = leg
        .describe()
        .couple("belt", "crank", "shin", 2.0, 0.0)
        .build()
        .unwrap();
    let mut edit = leg.edit(&state).unwrap();
    edit.remove(leg.find("lower").unwrap()).unwrap();
    edit.weld(leg.find("crank").unwrap()).unwrap();
    let model = edit.finish().unwrap().model;
    let name = |body: Option<vertebra_assembly::BodyId>| &model.body(body.unwrap()).unwrap().name;
    let ends: Vec<_> = model
        .loops()
        .iter()
        .map(|closed| closed.bodies.map(name))
        .collect();
    assert_eq!(ends, [["upper", "shoulder"], ["strut", "shin"]]);
    // What is welded follows nothing.
    assert_eq!(model.couplings().count(), 0);
}
