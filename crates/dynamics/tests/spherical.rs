//! What acts in spherical joints, against closed forms, balances and the dense solution.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use core::f64::consts::{PI, TAU};
use glam::{DQuat, DVec3};
use vertebra_assembly::schedule::ScheduleOptions;
use vertebra_assembly::{
    BallRange, Joint, JointKind, MassProperties, Model, ModelDescription, ModelError, Random,
    Spring, State, Stop, generate,
};
use vertebra_dynamics::{
    Algorithm, DcaOptions, DcaWorkspace, Derivatives, Elements, Error, Forces, Integrator,
    Precision, Simulation, SolverOptions, SphericalMotor, Workspace, aba, aba_derivatives,
    crba_forward_dynamics, dca, joint_wrenches, residual, rnea,
};

/// Inertia of the ball \[kg m^2\].
const INERTIA: f64 = 0.4 * 2.0 * 0.3 * 0.3;

/// A solid ball on a spherical joint in its middle, without gravity: w' = torque / inertia, whatever it does.
fn ball(joint: Joint) -> Model {
    ModelDescription::new("ball")
        .gravity(DVec3::ZERO)
        .body("ball", None, joint, MassProperties::sphere(2.0, 0.3))
        .build()
        .unwrap()
}

/// A rod that hangs from a spherical joint.
fn pendulum(joint: Joint) -> Model {
    let rod = MassProperties::rod(2.0, 1.0, 0.02);
    ModelDescription::new("pendulum")
        .gravity(DVec3::new(1.0, 2.0, -9.0))
        .body("rod", None, joint, rod)
        .build()
        .unwrap()
}

fn started(model: &Model, q: DQuat, w: DVec3) -> Simulation {
    let mut simulation = Simulation::new(model.clone()).unwrap();
    let mut state = State::neutral(model);
    state.q.copy_from_slice(&q.to_array());
    state.qd.copy_from_slice(&w.to_array());
    simulation.set_state(state).unwrap();
    simulation
}

fn rate(simulation: &mut Simulation) -> DVec3 {
    DVec3::from_slice(&simulation.state().unwrap().qd)
}

fn orientation(simulation: &mut Simulation) -> DQuat {
    DQuat::from_slice(&simulation.state().unwrap().q)
}

/// Twist about an axis and swing of it, as angles of the two turns one after the other.
fn twist_and_swing(q: DQuat, axis: DVec3) -> [f64; 2] {
    let along = axis * q.xyz().dot(axis);
    let twist = DQuat::from_xyzw(along.x, along.y, along.z, q.w).normalize();
    let swing = q * twist.inverse();
    let angle = 2.0 * (twist.xyz().dot(axis)).atan2(twist.w);
    let angle = angle - TAU * (angle / TAU).round();
    [angle, 2.0 * swing.w.abs().min(1.0).acos()]
}

/// A ball stops after the time I w / F about whatever axis, and never turns round.
#[test]
fn friction_brings_to_rest_about_any_axis() {
    let friction = 0.5;
    let model = ball(Joint::spherical().with_friction(friction));
    for start in [
        DVec3::X,
        DVec3::new(1.0, -2.0, 0.5),
        DVec3::new(0.0, 3.0, 4.0),
    ] {
        let mut simulation = started(&model, DQuat::IDENTITY, start);
        let h = 1e-3;
        let takes = INERTIA * start.length() / friction;
        let mut time = 0.0;
        while time < takes - h {
            simulation.step(h).unwrap();
            time += h;
            let expected = start * (1.0 - time / takes);
            let off = (rate(&mut simulation) - expected).length();
            assert!(off <= 2e-5 * start.length(), "{off:e} at {time}");
        }
        for _ in 0..10 {
            simulation.step(h).unwrap();
        }
        assert!(rate(&mut simulation).length() <= 1e-4);
        let lost = 0.5 * INERTIA * start.length_squared();
        assert!((simulation.work().unwrap().friction + lost).abs() <= 1e-7 * lost);
    }
}

/// It holds against torques below F in any direction, and lets go of the rest of what is more.
#[test]
fn friction_holds_up_to_its_size() {
    let model = ball(Joint::spherical().with_friction(0.5));
    let direction = DVec3::new(0.6, 0.0, -0.8);
    for push in [0.49, 0.51, 5.0] {
        let mut simulation = started(&model, DQuat::IDENTITY, DVec3::ZERO);
        let torque = direction * push;
        simulation
            .forces_mut()
            .joint
            .copy_from_slice(&torque.to_array());
        for _ in 0..50 {
            simulation.step(1e-3).unwrap();
        }
        let expected = direction * (f64::max(push - 0.5, 0.0) * 0.05 / INERTIA);
        let off = (rate(&mut simulation) - expected).length();
        assert!(off <= 2e-5 * (1.0 + expected.length()), "{push}: {off:e}");
    }
}

#[test]
fn motors_reach_orientations_and_rates_within_their_limits() {
    let model = ball(Joint::spherical().with_effort(0.3));
    let body = model.last_body();
    let (h, wanted) = (1e-3, DVec3::new(3.0, 0.0, 4.0));
    // A gain beyond all explicit steps; the effort of the joint bounds the torque.
    let mut simulation = started(&model, DQuat::IDENTITY, DVec3::ZERO);
    simulation
        .set_spherical_motor(body, SphericalMotor::velocity(wanted, 1e7))
        .unwrap();
    for step in 1..=100 {
        simulation.step(h).unwrap();
        let expected = wanted.normalize() * (0.3 * h * f64::from(step) / INERTIA);
        let off = (rate(&mut simulation) - expected).length();
        assert!(off <= 1e-5 * expected.length(), "{off:e} in step {step}");
    }
    for _ in 0..1500 {
        simulation.step(h).unwrap();
    }
    assert!((rate(&mut simulation) - wanted).length() <= 1e-6);
    // To a target the short way, and there it stays.
    let target = DQuat::from_scaled_axis(DVec3::new(1.0, -2.0, 0.5));
    let servo = SphericalMotor::orientation(target, 1e4, 1e3);
    simulation.set_spherical_motor(body, servo).unwrap();
    for _ in 0..4000 {
        simulation.step(5e-3).unwrap();
    }
    assert!(orientation(&mut simulation).angle_between(target) <= 1e-4);
    let kinetic = 0.5 * INERTIA * rate(&mut simulation).length_squared();
    assert!((simulation.work().unwrap().motors - kinetic).abs() <= 1e-5);
    assert_eq!(
        simulation
            .elements()
            .unwrap()
            .spherical_motor(body)
            .unwrap(),
        &servo
    );
    // A torque is given as it is.
    let before = rate(&mut simulation);
    let torque = DVec3::new(0.1, -0.2, 0.05);
    simulation
        .set_spherical_motor(body, SphericalMotor::torque(torque))
        .unwrap();
    simulation.step(h).unwrap();
    let gained = rate(&mut simulation) - before;
    assert!((gained - torque * (h / INERTIA)).length() <= 1e-9);
}

/// Pendulums thrown about stay in their ranges, but for the square of what a step turns.
#[test]
fn hard_stops_keep_swings_twists_and_turns() {
    let axis = DVec3::new(0.0, 0.6, 0.8);
    let ranges = [
        BallRange::turn(0.7),
        BallRange::cone(axis, 0.5),
        BallRange::cone_and_twist(axis, 0.9, -0.2, 0.4),
        BallRange::cone_and_twist(axis, 1.2, 0.1, 0.1),
    ];
    for precision in [Precision::F64, Precision::F32] {
        for range in ranges {
            let model = pendulum(Joint::spherical().with_ball_range(range));
            let start = match range {
                BallRange::Cone {
                    twist: Some([least, most]),
                    ..
                } => DQuat::from_axis_angle(axis, 0.5 * (least + most)),
                _ => DQuat::IDENTITY,
            };
            let mut simulation = started(&model, start, DVec3::new(2.0, -1.0, 3.0))
                .with_precision(precision)
                .unwrap();
            let h = 5e-4;
            let mut touched = [false; 2];
            for _ in 0..2000 {
                simulation.step(h).unwrap();
                let fastest = rate(&mut simulation).length().max(2.0);
                let slack = (h * fastest).powi(2) * 2.0 + 60.0 * precision.epsilon().sqrt() * h;
                let q = orientation(&mut simulation);
                let [twist, swing] = twist_and_swing(q, axis);
                let (values, bounds) = match range {
                    BallRange::Turn { angle } => (
                        [q.angle_between(DQuat::IDENTITY), 0.0],
                        [[-9.0, angle], [-9.0, 9.0]],
                    ),
                    BallRange::Cone {
                        swing: most,
                        twist: bounds,
                        ..
                    } => (
                        [swing, twist],
                        [[-9.0, most], bounds.unwrap_or([-9.0, 9.0])],
                    ),
                };
                for ((value, [least, most]), touched) in
                    values.into_iter().zip(bounds).zip(&mut touched)
                {
                    let inside = least - slack <= value && value <= most + slack;
                    assert!(
                        inside,
                        "{range:?} in {precision}: {value} for {least} to {most}"
                    );
                    *touched |= value > most - 0.05 || value < least + 0.05;
                }
            }
            let twists = matches!(range, BallRange::Cone { twist: Some(_), .. });
            assert!(
                touched[0] && (touched[1] || !twists),
                "{range:?}: {touched:?}"
            );
            assert!(simulation.work().unwrap().stops <= 1e-9);
        }
    }
}

/// A range of twists that ends at half a turn is left on neither side, though angles there jump by a whole one.
#[test]
fn twists_up_to_half_a_turn() {
    for (range, rate) in [([2.0, PI], 3.0), ([-PI, -2.0], -3.0)] {
        let range = BallRange::cone_and_twist(DVec3::Z, 1.0, range[0], range[1]);
        let model = ball(Joint::spherical().with_ball_range(range));
        let start = DQuat::from_axis_angle(DVec3::Z, 2.5_f64.copysign(rate));
        let mut simulation = started(&model, start, DVec3::new(0.0, 0.0, rate));
        let h = 1e-3;
        for _ in 0..3000 {
            simulation.step(h).unwrap();
            let [twist, _] = twist_and_swing(orientation(&mut simulation), DVec3::Z);
            // Counted on from where it started: in 2 to pi, or as far on the other side.
            let turned = (twist * rate.signum()).rem_euclid(TAU);
            let slack = 2.0 * (3.0 * h).powi(2) + 1e-6;
            assert!((2.0 - slack..=PI + slack).contains(&turned), "{turned}");
        }
    }
    // A whole turn is no bound.
    let range = BallRange::cone_and_twist(DVec3::Z, 1.0, -PI, PI);
    let model = ball(Joint::spherical().with_ball_range(range));
    let mut simulation = started(&model, DQuat::IDENTITY, DVec3::new(0.0, 0.0, 3.0));
    for _ in 0..3000 {
        simulation.step(1e-3).unwrap();
    }
    assert!((rate(&mut simulation).z - 3.0).abs() <= 1e-12 * 3000.0);
}

/// A ball that turns into its bound leaves it with its part of the rate; what it turns along the bound stays.
#[test]
fn impacts_restore_their_part_of_the_rate_across() {
    for restitution in [0.0, 0.5, 1.0] {
        let joint = Joint::spherical()
            .with_ball_range(BallRange::cone(DVec3::Z, 0.5))
            .with_stop(Stop::Hard { restitution });
        // The axis swings about x; the twist goes on.
        let mut simulation = started(&ball(joint), DQuat::IDENTITY, DVec3::X * 2.0);
        for _ in 0..400 {
            simulation.step(1e-3).unwrap();
        }
        let expected = DVec3::X * (-2.0 * restitution);
        let off = (rate(&mut simulation) - expected).length();
        assert!(off <= 1e-5, "{restitution}: {off:e}");
        let lost = 0.5 * INERTIA * 4.0 * (1.0 - restitution * restitution);
        assert!((simulation.work().unwrap().stops + lost).abs() <= 1e-6);
    }
}

/// A torque against a soft stop comes to rest where k x is the torque.
#[test]
fn soft_stops_give_way_by_their_stiffness() {
    let stop = Stop::Soft {
        stiffness: 50.0,
        damping: 2.0,
    };
    let joint = Joint::spherical()
        .with_ball_range(BallRange::turn(0.5))
        .with_stop(stop)
        .with_damping(0.05);
    let mut simulation = started(&ball(joint), DQuat::IDENTITY, DVec3::ZERO);
    let torque = DVec3::new(0.0, 1.0, 0.0);
    simulation
        .forces_mut()
        .joint
        .copy_from_slice(&torque.to_array());
    for _ in 0..4000 {
        simulation.step(2e-3).unwrap();
    }
    let angle = orientation(&mut simulation).angle_between(DQuat::IDENTITY);
    assert!((angle - (0.5 + 1.0 / 50.0)).abs() <= 1e-6, "{angle}");
}

/// A chain, or a tree of unlike masses, of spherical joints with everything, and motors in some.
fn loaded_tree(count: usize, smooth: bool, seed: u64) -> Model {
    let mut random = Random::new(seed);
    let tree = generate::RandomTree {
        floating: seed.is_multiple_of(3),
        ..generate::RandomTree::mixed(count)
    };
    let model = generate::random_tree(&tree, seed).unwrap();
    let mut description = model.describe();
    for body in &mut description.bodies {
        if body.parent.is_some() {
            body.joint.kind = JointKind::Spherical;
        }
        if body.joint.kind != JointKind::Spherical {
            continue;
        }
        body.joint.limits = None;
        if random.below(4) == 0 {
            // Heavy bodies end chunks as leaves of their own.
            body.mass.mass *= 1e3;
            body.mass.inertia *= 1e3;
        }
        let mut joint = body.joint.clone().with_damping(0.1 * random.unit());
        joint = joint.with_spring(Spring::turned(5.0 * random.unit(), random.rotation()));
        joint = match random.below(3) {
            0 => joint.with_ball_range(BallRange::turn(0.3 + random.unit())),
            1 => joint.with_ball_range(BallRange::cone(random.direction(), 0.3 + random.unit())),
            _ => {
                let (axis, swing) = (random.direction(), 0.3 + random.unit());
                joint.with_ball_range(BallRange::cone_and_twist(axis, swing, -0.3, 0.2))
            }
        };
        body.joint = if smooth {
            let stiffness = 30.0 * random.unit();
            joint.with_stop(Stop::Soft {
                stiffness,
                damping: 0.0,
            })
        } else {
            joint
                .with_friction(0.2 * random.unit())
                .with_stop(Stop::HARD)
        };
    }
    description.build().unwrap()
}

/// Bounds that have inertia between freedoms are the same in every algorithm, and solve the equations.
#[test]
fn algorithms_agree_on_stops() {
    for seed in 0..12 {
        let model = loaded_tree(14, seed % 2 == 0, seed);
        let state = State::random(&model, seed);
        let mut elements = Elements::new(&model);
        let loaded = elements
            .load(&state, &Forces::none(&model), 1e-2)
            .unwrap()
            .clone();
        let mut workspace = Workspace::new(&model, Precision::F64);
        let qdd = aba(&model, &state, &loaded, &mut workspace)
            .unwrap()
            .to_vec();
        joint_wrenches(&mut workspace).unwrap();
        let left = residual(&model, &state, &loaded, &workspace)
            .unwrap()
            .by_body;
        assert!(left <= 1e-12, "seed {seed}: {left:e}");
        let largest = qdd.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let agree = |name: &str, found: &[f64], digits: f64| {
            for (a, b) in found.iter().zip(&qdd) {
                assert!(
                    (a - b).abs() <= digits * largest,
                    "{name}, seed {seed}: {a} for {b}"
                );
            }
        };
        let dense = crba_forward_dynamics(&model, &state, &loaded, &mut workspace).unwrap();
        agree("dense", &dense, 1e-7);
        for window in [1, 4, 32] {
            let options = DcaOptions {
                schedule: Some(ScheduleOptions {
                    window,
                    longest_chunk: 2 * window,
                }),
                ..DcaOptions::default()
            };
            let mut tree = DcaWorkspace::new(&model, &options).unwrap();
            let found = dca(&model, &state, &loaded, &mut tree).unwrap().to_vec();
            agree("divide and conquer", &found, 1e-7);
            tree.compute_joint_wrenches(&loaded).unwrap();
            let left = residual(&model, &state, &loaded, &tree).unwrap().by_body;
            assert!(left <= 1e-8, "seed {seed}: {left:e} by divide and conquer");
        }
        let tau = rnea(&model, &state, &qdd, &loaded, &mut workspace).unwrap();
        let most = loaded.joint_inertia.iter().fold(1.0_f64, |m, x| m.max(*x));
        for (tau, given) in tau.iter().zip(&loaded.joint) {
            assert!((tau - given).abs() <= 1e-9 * (most * largest + given.abs()));
        }
        // H^-1 of the derivatives: times H it is 1.
        let mut derivatives = Derivatives::new(&model);
        aba_derivatives(&model, &state, &loaded, &mut workspace, &mut derivatives).unwrap();
        let mut pushed = loaded.clone();
        pushed.joint[2] += 1.0;
        let more = aba(&model, &state, &pushed, &mut workspace).unwrap();
        for (dof, (more, qdd)) in more.iter().zip(&qdd).enumerate() {
            let expected = derivatives.drive[(dof, 2)];
            assert!((more - qdd - expected).abs() <= 1e-7 * (1.0 + largest));
        }
    }
}

/// Steps by divide and conquer are those of the recursion to what laws are followed to.
#[test]
fn solvers_agree_on_steps() {
    let model = loaded_tree(30, false, 5);
    let run = |options: &SolverOptions| {
        let mut simulation = Simulation::new(model.clone())
            .unwrap()
            .with_solver(options)
            .unwrap();
        for _ in 0..30 {
            simulation.step(1e-3).unwrap();
        }
        simulation.state().unwrap().clone()
    };
    let reference = run(&SolverOptions::default());
    let options = SolverOptions {
        algorithm: Some(Algorithm::Dca),
        ..SolverOptions::default()
    };
    let largest = reference.qd.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    for (a, b) in run(&options).qd.iter().zip(&reference.qd) {
        assert!((a - b).abs() <= 1e-4 * largest, "{a} and {b}");
    }
}

/// Energy changes by the work of all elements, to first order in implicit steps and to second in others.
#[test]
fn work_balances() {
    for (seed, smooth) in [(1, false), (2, true), (3, false), (4, true)] {
        let model = loaded_tree(6, smooth, seed);
        let mut state = State::neutral(&model);
        state.qd.copy_from_slice(&State::random(&model, seed).qd);
        let off = |steps: u32, integrator| {
            let mut simulation = Simulation::new(model.clone())
                .unwrap()
                .with_integrator(integrator);
            simulation.set_state(state.clone()).unwrap();
            let driven: Vec<_> = (model.body_ids().zip(model.bodies()))
                .filter(|(_, body)| body.joint.kind == JointKind::Spherical)
                .map(|(id, _)| id)
                .collect();
            let target = DQuat::from_scaled_axis(DVec3::new(0.2, 0.1, -0.1));
            for (id, limit) in driven.into_iter().zip([0.3, f64::INFINITY]) {
                let motor = SphericalMotor::orientation(target, 20.0, 0.5).limited(limit);
                simulation.set_spherical_motor(id, motor).unwrap();
            }
            let held = |simulation: &mut Simulation| {
                let sums = simulation.mechanics().unwrap();
                let stored = simulation.stored().unwrap();
                let work = simulation.work().unwrap().total();
                sums.kinetic_energy + sums.potential_energy + stored.rotors - work
            };
            let start = held(&mut simulation);
            let mut largest = start.abs();
            for _ in 0..steps {
                simulation.step(0.1 / f64::from(steps)).unwrap();
                largest = largest.max(simulation.mechanics().unwrap().kinetic_energy);
            }
            let work = simulation.work().unwrap();
            assert!(work.motors != 0.0 && work.friction <= 0.0 && work.dampers < 0.0);
            (held(&mut simulation) - start).abs() / largest
        };
        // Errors of two signs may meet at one length of steps, not at three.
        let euler = [200, 300, 400, 1600].map(|steps| off(steps, Integrator::SemiImplicitEuler));
        let coarse = euler[..3].iter().copied().fold(0.0, f64::max);
        assert!(euler[3] <= 0.4 * coarse + 1e-8, "seed {seed}: {euler:?}");
        assert!(euler[3] <= 1e-2, "seed {seed}: {euler:?}");
        if smooth {
            // Of second order, as limits of motors bend what acts: a sixteenth of the step leaves 1/256.
            let others = [25, 50, 100, 400].map(|steps| off(steps, Integrator::RungeKutta4));
            let coarse = others[..3].iter().copied().fold(0.0, f64::max);
            let bound = 8.0 / 256.0 * coarse + 1e-10;
            assert!(others[3] <= bound, "seed {seed}: {others:?}");
        }
    }
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let refused = |joint: Joint| {
        let model =
            ModelDescription::new("m").body("b", None, joint, MassProperties::sphere(1.0, 0.1));
        let error = model.build().unwrap_err();
        assert!(matches!(error, ModelError::BadBallRange { .. }), "{error}");
        assert!(error.to_string().contains("`b`"));
    };
    let spherical = Joint::spherical;
    refused(spherical().with_ball_range(BallRange::turn(0.0)));
    refused(spherical().with_ball_range(BallRange::turn(f64::NAN)));
    refused(spherical().with_ball_range(BallRange::cone(DVec3::X, 3.2)));
    refused(spherical().with_ball_range(BallRange::cone_and_twist(DVec3::X, 1.0, 0.3, 0.2)));
    refused(spherical().with_ball_range(BallRange::cone_and_twist(DVec3::X, 1.0, 0.3, 4.0)));
    refused(Joint::revolute(DVec3::X).with_ball_range(BallRange::turn(1.0)));
    let model = ball(spherical().with_ball_range(BallRange::turn(1.0)));
    let mut simulation = Simulation::new(model.clone())
        .unwrap()
        .with_integrator(Integrator::RungeKutta4);
    let error = simulation.step(1e-3).unwrap_err();
    assert!(matches!(error, Error::RoughElement { .. }), "{error}");
    let bad = SphericalMotor::orientation(DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0), 1.0, 1.0);
    let error = simulation
        .set_spherical_motor(model.last_body(), bad)
        .unwrap_err();
    assert!(
        error.to_string().contains("length of the quaternion"),
        "{error}"
    );
    let hinge = ball(Joint::revolute(DVec3::X));
    let mut simulation = Simulation::new(hinge.clone()).unwrap();
    let error = simulation
        .set_spherical_motor(hinge.last_body(), SphericalMotor::OFF)
        .unwrap_err();
    assert!(matches!(error, Error::NoMotor { .. }));
}
