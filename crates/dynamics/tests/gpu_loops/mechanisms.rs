//! Mechanisms closed by every kind of closure.

use glam::DVec3;
use vertebra_assembly::generate::{self, RandomTree, Rod};
use vertebra_assembly::{
    Closure, Joint, MassProperties, Model, ModelDescription, State, mechanism,
};
use vertebra_dynamics::Simulation;
use vertebra_spatial::Pose;

/// With the loops closed of a state that nearly closes them.
pub(crate) fn closed(model: Model, state: State) -> (Model, State) {
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state).unwrap();
    simulation.close_loops().unwrap();
    let state = simulation.state().unwrap().clone();
    (model, state)
}

/// Chain mail from a bulge: flat it is singular.
fn mail() -> (Model, State) {
    let (model, mut state) = mechanism::chain_mail(2, 3).unwrap();
    for ring in 0..6 {
        state.q[7 * ring + 1] = 0.03 * (1.0 + ring as f64).sin();
    }
    closed(model, state)
}

/// Two four-bar linkages on one frame that does not move, and a chain beside them that closes nothing.
fn side_by_side() -> (Model, State) {
    let (one, start) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let one = one.describe();
    let mut all = ModelDescription::new("side by side").body(
        "frame",
        None,
        Joint::fixed(),
        MassProperties::rod(1.0, 1.0, 0.1),
    );
    let mut state = Vec::new();
    let mut rates = Vec::new();
    for copy in ["a", "b"] {
        let named = |name: &str| format!("{copy} {name}");
        for body in &one.bodies {
            let mut body = body.clone();
            body.name = named(&body.name);
            body.parent = Some(
                body.parent
                    .map_or("frame".to_owned(), |parent| named(&parent)),
            );
            all.bodies.push(body);
        }
        for closure in &one.loops {
            let mut closure = closure.clone();
            closure.name = named(&closure.name);
            closure.bodies = closure.bodies.map(|body| body.map(|body| named(&body)));
            all.loops.push(closure);
        }
        state.extend(&start.q);
        rates.extend(
            start
                .qd
                .iter()
                .map(|rate| if copy == "a" { *rate } else { 0.0 }),
        );
    }
    let rod = MassProperties::rod(0.5, 0.3, 0.05);
    let all = all
        .body("upper", Some("frame"), Joint::revolute(DVec3::X), rod)
        .body("lower", Some("upper"), Joint::spherical(), rod);
    let model = all.build().unwrap();
    let mut start = State::neutral(&model);
    start.q[..state.len()].copy_from_slice(&state);
    start.qd[..rates.len()].copy_from_slice(&rates);
    closed(model, start)
}

/// Gears on an arm that swings, their shafts skew.
fn gears() -> (Model, State) {
    let wheel = MassProperties::rod(2.0, 0.1, 0.3);
    let at = |x: f64| Pose::from_translation(DVec3::new(x, 0.1, 0.0));
    let model = ModelDescription::new("gears")
        .body("arm", None, Joint::revolute(DVec3::Y), wheel)
        .body(
            "driver",
            Some("arm"),
            Joint::revolute(DVec3::Z).at(at(0.3)),
            wheel,
        )
        .body(
            "rack",
            Some("arm"),
            Joint::prismatic(DVec3::X).at(at(0.5)),
            wheel,
        )
        .body(
            "driven",
            Some("driver"),
            Joint::revolute(DVec3::X).at(at(0.2)),
            wheel,
        )
        .couple("mesh", "driven", "driver", -2.5, 0.3)
        .couple("pinion", "rack", "driver", 0.05, 0.1)
        .build()
        .unwrap();
    let mut state = State::neutral(&model);
    state.qd.fill(0.7);
    closed(model, state)
}

/// A nut on a thread, and a rod between two sliders: closures that mechanisms seldom have.
fn threads() -> (Model, State) {
    let mass = MassProperties::rod(1.0, 0.5, 0.1);
    let axis = DVec3::new(0.6, 0.0, 0.8);
    let side = Pose::from_translation(DVec3::new(1.0, 0.4, 0.2));
    let screw = Closure::Screw { axis, pitch: 0.25 };
    let universal = Closure::Universal {
        first: DVec3::X,
        second: DVec3::Y,
    };
    let model = ModelDescription::new("threads")
        .body("nut", None, Joint::prismatic(axis), mass)
        .body("turn", Some("nut"), Joint::revolute(axis), mass)
        .body("bob", None, Joint::free().at(side), mass)
        .body("kite", None, Joint::free(), mass)
        .close("thread", [None, Some("turn")], [Pose::IDENTITY; 2], screw)
        .close(
            "wire",
            [Some("turn"), Some("bob")],
            [Pose::from_translation(DVec3::X * 0.3), Pose::IDENTITY],
            Closure::Distance { length: 0.8 },
        )
        .close(
            "joint",
            [Some("bob"), Some("kite")],
            [Pose::IDENTITY, side],
            universal,
        )
        .close(
            "plane",
            [None, Some("kite")],
            [Pose::IDENTITY; 2],
            Closure::Planar {
                normal: DVec3::new(0.1, -0.2, 1.0),
            },
        )
        .build()
        .unwrap();
    let mut state = State::neutral(&model);
    state.q[..2].copy_from_slice(&[0.1, 0.4]);
    state.qd[..2].copy_from_slice(&[0.05, 0.2]);
    closed(model, state)
}

/// Two bodies of a tree that are where they are, held together by a ball; and one of them by the world.
fn held(model: &Model, seed: u64, [one, other]: [usize; 2]) -> (Model, State) {
    let mut state = State::random(model, seed);
    state.qd.iter_mut().for_each(|rate| *rate *= 0.1);
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let ids: Vec<_> = model.body_ids().collect();
    let [a, b] = [one, other].map(|body| simulation.pose(ids[body]).unwrap());
    let [one, other] = [one, other].map(|body| model.bodies()[body].name.clone());
    let on_a = Pose::from_translation(a.rotation.inverse() * (b.translation - a.translation));
    let world = Pose::from_translation(a.translation);
    let model = (model.describe())
        .close(
            "clasp",
            [Some(&one), Some(&other)],
            [on_a, Pose::IDENTITY],
            Closure::Ball,
        )
        .close(
            "hook",
            [None, Some(&one)],
            [world, Pose::IDENTITY],
            Closure::Ball,
        )
        .build()
        .unwrap();
    closed(model, state)
}

/// Closes a loop between two bodies of a model that are where they are.
pub(crate) fn tie(
    description: ModelDescription,
    name: &str,
    [one, other]: [usize; 2],
    poses: &[Pose],
    closure: Closure,
) -> ModelDescription {
    let pair = [one, other].map(|body| description.bodies[body].name.clone());
    let on_one = poses[one].inverse() * poses[other];
    description.close(
        name,
        [Some(&pair[0]), Some(&pair[1])],
        [on_one, Pose::IDENTITY],
        closure,
    )
}

/// Bodies of a tree held where they are by closures of every kind, most of which let them slide past each other.
fn every_closure() -> (Model, State) {
    let tree = RandomTree {
        reach: 5,
        floating: true,
        ..RandomTree::mixed(40)
    };
    let model = generate::random_tree(&tree, 9).unwrap();
    let axis = DVec3::new(0.3, -1.0, 0.4);
    let closures = [
        Closure::Prismatic { axis },
        Closure::Cylindrical { axis },
        Closure::Planar { normal: axis },
        Closure::Screw { axis, pitch: 0.2 },
        Closure::Revolute { axis },
        Closure::Universal {
            first: axis,
            second: DVec3::new(1.0, 0.3, 0.0),
        },
    ];
    let mut state = State::random(&model, 10);
    state.qd.iter_mut().for_each(|rate| *rate *= 0.3);
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let poses = simulation.poses().unwrap().to_vec();
    let mut description = model.describe();
    for (k, closure) in closures.into_iter().enumerate() {
        let pair = [5 * k + 4, 5 * k + 9];
        description = tie(description, &format!("closure {k}"), pair, &poses, closure);
    }
    closed(description.build().unwrap(), state)
}

/// All closed by every kind of closure, some of them twice over.
pub(crate) fn all() -> Vec<(Model, State)> {
    let (twice, start) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let mut twice = twice.describe();
    let mut again = twice.loops[0].clone();
    again.name += " again";
    twice.loops.push(again);
    let chain = generate::random_chain(40, &Rod::default(), 1).unwrap();
    let tree = RandomTree {
        reach: 4,
        floating: true,
        ..RandomTree::mixed(60)
    };
    let tree = generate::random_tree(&tree, 4).unwrap();
    vec![
        closed(twice.build().unwrap(), start),
        mechanism::bennett().unwrap(),
        mechanism::jansen_leg().unwrap(),
        mechanism::stewart_platform().unwrap(),
        mail(),
        side_by_side(),
        gears(),
        threads(),
        every_closure(),
        held(&chain, 2, [10, 39]),
        held(&tree, 3, [20, 58]),
    ]
}
