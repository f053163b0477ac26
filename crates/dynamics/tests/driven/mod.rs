//! Chains with all that can act in joints, driven by motors, wherever they run.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use vertebra_assembly::{
    BallRange, BodyId, Joint, JointKind, MassProperties, Model, ModelDescription, Random, Spring,
    State, Stop,
};
use vertebra_dynamics::{Motor, Simulation, SphericalMotor, Work};
use vertebra_spatial::Pose;

/// A chain whose joints are of every kind, with every element there is.
///
/// Branches would need kernels of their own, which take a software driver minutes to compile: the checks of
/// `selftest` have them.
pub(crate) fn chain(count: usize, seed: u64) -> Model {
    let mut random = Random::new(seed);
    let mut description = ModelDescription::new("chain").body(
        "body-0",
        None,
        Joint::free(),
        MassProperties::sphere(1.0, 0.3),
    );
    let stops = [
        Stop::HARD,
        Stop::Hard { restitution: 0.6 },
        Stop::Soft {
            stiffness: 500.0,
            damping: 0.5,
        },
    ];
    for index in 1..count {
        let axis = random.direction();
        let joint = match index % 5 {
            0 => ball(index, &mut random)
                .with_spring(Spring::turned(5.0 * random.unit(), random.rotation())),
            1 => Joint::screw(axis, 0.3 * random.symmetric()).with_friction(0.2),
            2 => Joint::prismatic(axis)
                .with_spring(Spring::at(20.0, 0.1))
                .with_friction(0.3),
            3 => Joint::revolute(axis).with_spring(Spring::at(5.0, -0.4)),
            _ => Joint::fixed(),
        };
        let joint = match index % 5 {
            4 => joint,
            _ => joint
                .with_damping(0.1 * random.unit())
                .with_armature(0.2 * random.unit()),
        };
        let joint = match index % 5 {
            1..=3 => {
                let stop = stops[random.below(3)];
                joint.with_range(-4e-3, 5e-3).with_stop(stop)
            }
            0 => joint.with_stop(stops[index / 5 % 3]),
            _ => joint,
        };
        let at = Pose::new(random.rotation(), random.direction() * 0.5);
        let mass = MassProperties::rod(0.5 + random.unit(), 0.4, 0.1);
        let parent = format!("body-{}", index - 1);
        description = description.body(format!("body-{index}"), Some(&parent), joint.at(at), mass);
    }
    description.build().unwrap()
}

/// A spherical joint that rubs and has a range of each kind in turn.
fn ball(index: usize, random: &mut Random) -> Joint {
    let axis = random.direction();
    let range = match index / 5 % 3 {
        0 => BallRange::turn(0.01),
        1 => BallRange::cone_and_twist(axis, 0.01, -4e-3, 5e-3),
        _ => BallRange::cone(axis, 0.01),
    };
    Joint::spherical().with_ball_range(range).with_friction(0.3)
}

/// A motor of each kind on bodies with one freedom, and on spherical joints, if there are any.
pub(crate) fn drive(simulation: &mut Simulation, model: &Model, seed: u64) {
    let mut random = Random::new(seed);
    let driven: Vec<BodyId> = (model.body_ids().zip(model.bodies()))
        .filter(|(_, body)| body.dof_range().len() == 1)
        .map(|(id, _)| id)
        .collect();
    for motor in [
        Motor::torque(0.3),
        Motor::velocity(1.0, 2.0),
        Motor::position(0.4, 50.0, 1.0),
        Motor::position(-0.4, 500.0, 1.0).limited(0.5),
    ] {
        let body = driven[random.below(driven.len())];
        simulation.set_motor(body, motor).unwrap();
    }
    let balls: Vec<BodyId> = (model.body_ids().zip(model.bodies()))
        .filter(|(_, body)| body.joint.kind == JointKind::Spherical)
        .map(|(id, _)| id)
        .collect();
    for motor in [
        SphericalMotor::velocity(random.direction(), 2.0),
        SphericalMotor::orientation(random.rotation(), 5.0, 0.5).limited(0.5),
        SphericalMotor::torque(random.direction() * 0.3),
    ] {
        if !balls.is_empty() {
            let body = balls[random.below(balls.len())];
            simulation.set_spherical_motor(body, motor).unwrap();
        }
    }
}

/// The state and the work after some steps, with motors that change on the way.
pub(crate) fn moved(
    mut simulation: Simulation,
    state: &State,
    h: f64,
    count: usize,
) -> (State, Work) {
    moved_by(&mut simulation, state, h, count)
}

pub(crate) fn moved_by(
    simulation: &mut Simulation,
    state: &State,
    h: f64,
    count: usize,
) -> (State, Work) {
    let model = simulation.model().clone();
    simulation.set_state(state.clone()).unwrap();
    drive(simulation, &model, 1);
    simulation.steps(h, count).unwrap();
    drive(simulation, &model, 2);
    simulation.steps(h, count).unwrap();
    let work = simulation.work().unwrap();
    (simulation.state().unwrap().clone(), work)
}

pub(crate) fn largest(v: &[f64]) -> f64 {
    v.iter().fold(1.0_f64, |m, x| m.max(x.abs()))
}

pub(crate) fn assert_alike(
    found: &(State, Work),
    expected: &(State, Work),
    bound: f64,
    what: &str,
) {
    for (found, expected) in [(&found.0.q, &expected.0.q), (&found.0.qd, &expected.0.qd)] {
        let scale = largest(expected);
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() <= bound * scale, "{what}: {a} and {b}");
        }
    }
    let works = |work: &Work| {
        [
            work.motors,
            work.springs,
            work.dampers,
            work.friction,
            work.stops,
            work.loops,
        ]
    };
    let (found, expected) = (works(&found.1), works(&expected.1));
    let scale = largest(&expected);
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= bound * scale, "work, {what}: {a} and {b}");
    }
}
