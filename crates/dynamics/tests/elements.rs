//! What acts in joints of its own accord, against closed forms and balances.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use glam::{DQuat, DVec3};
use vertebra_assembly::{
    Joint, MassProperties, Model, ModelDescription, Spring, State, Stop, generate,
};
use vertebra_dynamics::{
    Elements, Error, Forces, Integrator, Motor, Precision, Simulation, SolverOptions, Workspace,
    aba, mechanics, rnea,
};

const MASS: f64 = 2.0;

/// A mass on one joint, without gravity.
fn single(joint: Joint) -> Model {
    ModelDescription::new("single")
        .gravity(DVec3::ZERO)
        .body("body", None, joint, MassProperties::sphere(MASS, 0.1))
        .build()
        .unwrap()
}

fn slide() -> Joint {
    Joint::prismatic(DVec3::X)
}

fn started(model: &Model, q: f64, qd: f64) -> Simulation {
    let mut simulation = Simulation::new(model.clone()).unwrap();
    let mut state = State::neutral(model);
    (state.q[0], state.qd[0]) = (q, qd);
    simulation.set_state(state).unwrap();
    simulation
}

/// v' = ((m + I) v - h k (q - q0)) / (m + I + h c + h^2 k), whatever the stiffness.
#[test]
fn springs_dampers_and_rotors_are_implicit() {
    for (k, c, rotor) in [
        (3.0, 0.5, 0.0),
        (0.0, 2.0, 1.0),
        (1e12, 0.0, 0.0),
        (1e9, 1e12, 3.0),
    ] {
        let joint = slide()
            .with_spring(Spring::at(k, 0.25))
            .with_damping(c)
            .with_armature(rotor);
        let mut simulation = started(&single(joint), 0.5, -1.5);
        let h = 1e-2;
        for _ in 0..5 {
            let (q, qd) = (
                simulation.state().unwrap().q[0],
                simulation.state().unwrap().qd[0],
            );
            let m = MASS + rotor;
            let expected = (m * qd - h * k * (q - 0.25)) / (m + h * c + h * h * k);
            simulation.step(h).unwrap();
            let found = simulation.state().unwrap().qd[0];
            let rounding = 16.0 * f64::EPSILON * (qd.abs() + expected.abs() + (q.abs() + 0.25) / h);
            assert!(
                (found - expected).abs() <= rounding,
                "{k} {c}: {found} for {expected}"
            );
        }
        assert!((simulation.state().unwrap().q[0] - 0.25).abs() <= 0.3);
    }
}

/// Forces as they are now, where there is no step.
#[test]
fn accelerations_without_a_step_are_explicit() {
    let joint = slide()
        .with_spring(Spring::at(30.0, 0.25))
        .with_damping(4.0)
        .with_armature(1.0)
        .with_friction(0.5)
        .with_range(-1.0, 1.0);
    let mut simulation = started(&single(joint), 0.5, 1.5);
    let qdd = simulation.solve().unwrap().joint_accelerations().unwrap()[0];
    let expected = (-30.0 * 0.25 - 4.0 * 1.5 - 0.5) / (MASS + 1.0);
    assert!((qdd - expected).abs() <= 4.0 * f64::EPSILON * expected.abs());
}

/// A block stops where v^2 = 2 F s / m, to a step's way, stays there, and never turns round.
#[test]
fn friction_brings_to_rest_and_never_reverses() {
    let friction = 3.0;
    let model = single(slide().with_friction(friction));
    let h = 1e-3;
    for start in [1.0, -2.5, 1e-4] {
        let mut simulation = started(&model, 0.0, start);
        let mut before = start;
        for _ in 0..3000 {
            simulation.step(h).unwrap();
            let rate = simulation.state().unwrap().qd[0];
            assert!(
                rate * start >= 0.0 && rate.abs() <= before.abs(),
                "{before} to {rate}"
            );
            before = rate;
        }
        let way = start * start.abs() * MASS / (2.0 * friction);
        let found = simulation.state().unwrap().q[0];
        assert!((found - way).abs() <= h * start.abs(), "{found} for {way}");
        assert!(before.abs() <= 1e-5);
        let lost = 0.5 * MASS * start * start;
        assert!((simulation.work().unwrap().friction + lost).abs() <= 1e-9 * lost);
    }
}

/// It holds against less than F, and lets go of the rest of what is more.
#[test]
fn friction_holds_up_to_its_size() {
    let model = single(slide().with_friction(3.0));
    for push in [2.9, 3.1, -20.0] {
        let mut simulation = started(&model, 0.0, 0.0);
        simulation.forces_mut().joint[0] = push;
        for _ in 0..100 {
            simulation.step(1e-2).unwrap();
        }
        let rest = f64::max(push.abs() - 3.0, 0.0).copysign(push) / MASS;
        let rate = simulation.state().unwrap().qd[0];
        // Below the rate at which friction has its size, a joint that holds creeps.
        assert!((rate - rest).abs() <= 2e-5, "{push}: {rate} for {rest}");
    }
}

/// A pendulum that falls onto a stop ends there to rounding of what the stop takes out, and leaves it when
/// it is pulled away.
#[test]
fn hard_stops_are_not_passed_and_do_not_pull() {
    for precision in [Precision::F64, Precision::F32] {
        let rod = MassProperties::rod(2.0, 1.0, 0.02);
        let joint = Joint::revolute(DVec3::X).with_range(-0.4, 2.0);
        let model = ModelDescription::new("pendulum")
            .gravity(DVec3::new(0.0, -4.0, -9.0))
            .body("rod", None, joint, rod)
            .build()
            .unwrap();
        let mut simulation = Simulation::new(model)
            .unwrap()
            .with_precision(precision)
            .unwrap();
        let h = 1e-3;
        // A stop takes out all but a part of the rate, of at most 6 rad/s here.
        let slack = 6.0 * 10.0 * precision.epsilon().sqrt() * h;
        let mut furthest = 0.0_f64;
        for _ in 0..6000 {
            simulation.step(h).unwrap();
            let q = simulation.state().unwrap().q[0];
            furthest = furthest.max(q);
            assert!(q <= 2.0 + slack, "{q} in {precision}");
        }
        let state = simulation.state().unwrap();
        assert!((state.q[0] - 2.0).abs() <= slack && state.qd[0].abs() <= slack / h);
        assert!(furthest >= 2.0 - slack, "{furthest}");
        // At rest one solution a step does.
        assert_eq!(simulation.elements().unwrap().solutions(), 1);
        simulation.forces_mut().joint[0] = -40.0;
        simulation.step(h).unwrap();
        let moved = rod.about(DVec3::ZERO).x_axis.x;
        let least = h * (40.0 - 2.0 * 0.5 * 97.0_f64.sqrt()) / moved;
        assert!(simulation.state().unwrap().qd[0] <= -0.9 * least);
    }
}

#[test]
fn impacts_restore_their_part_of_the_rate() {
    for restitution in [0.0, 0.5, 1.0] {
        let joint = slide()
            .with_range(-1.0, 0.5)
            .with_stop(Stop::Hard { restitution });
        let mut simulation = started(&single(joint), 0.0, 2.0);
        for _ in 0..300 {
            simulation.step(1e-3).unwrap();
        }
        let rate = simulation.state().unwrap().qd[0];
        assert!(
            (rate + 2.0 * restitution).abs() <= 1e-5,
            "{restitution}: {rate}"
        );
        let lost = 0.5 * MASS * (4.0 - rate * rate);
        assert!((simulation.work().unwrap().stops + lost).abs() <= 16.0 * f64::EPSILON.sqrt());
    }
}

/// What starts outside of its range comes back at a bounded rate, and one that cannot be passed stays so.
#[test]
fn a_joint_outside_its_range_is_brought_back_gently() {
    let model = single(slide().with_range(-1.0, 0.5));
    let mut simulation = started(&model, 0.9, 1.0);
    let bound = model.units().velocity();
    for _ in 0..10_000 {
        simulation.step(1e-3).unwrap();
        let rate = simulation.state().unwrap().qd[0];
        assert!((-1.001 * bound..=1e-5).contains(&rate), "{rate}");
    }
    let q = simulation.state().unwrap().q[0];
    assert!(q <= 0.5 + 1e-6, "{q}");
}

/// A range without width is a lock.
#[test]
fn a_range_of_one_position_is_held() {
    let mut simulation = started(&single(slide().with_range(0.25, 0.25)), 0.25, 0.0);
    for push in [5.0, -7.0] {
        simulation.forces_mut().joint[0] = push;
        for _ in 0..200 {
            simulation.step(1e-3).unwrap();
            let q = simulation.state().unwrap().q[0];
            assert!((q - 0.25).abs() <= 1e-11, "{q}");
        }
    }
}

/// A mass pressed onto a soft stop comes to rest where k x = F.
#[test]
fn soft_stops_give_way_by_their_stiffness() {
    let (stiffness, damping) = (500.0, 40.0);
    let joint = slide()
        .with_range(-1.0, 0.5)
        .with_stop(Stop::Soft { stiffness, damping });
    let mut simulation = started(&single(joint), 0.0, 0.0);
    simulation.forces_mut().joint[0] = 10.0;
    for _ in 0..4000 {
        simulation.step(2e-3).unwrap();
    }
    assert!((simulation.state().unwrap().q[0] - (0.5 + 10.0 / stiffness)).abs() <= 1e-9);
    assert!(simulation.work().unwrap().stops < 0.0);
}

#[test]
fn motors_reach_their_targets_within_their_limits() {
    let model = single(slide().with_effort(4.0));
    let body = model.last_body();
    let h = 1e-2;
    // A gain beyond all explicit steps.
    let mut simulation = started(&model, 0.0, 0.0);
    simulation
        .set_motor(body, Motor::velocity(1.0, 1e9))
        .unwrap();
    let mut steps = 0;
    while simulation.state().unwrap().qd[0] < 1.0 - 1e-6 {
        simulation.step(h).unwrap();
        steps += 1;
        // The effort of the joint bounds it: v = F t / m.
        let free = 4.0 * h * f64::from(steps) / MASS;
        assert!(simulation.state().unwrap().qd[0] <= free * (1.0 + 1e-12));
    }
    assert_eq!(steps, 50);
    simulation
        .set_motor(body, Motor::position(-0.3, 1e8, 1e7).limited(3.0))
        .unwrap();
    for _ in 0..1000 {
        simulation.step(h).unwrap();
    }
    let state = simulation.state().unwrap();
    assert!((state.q[0] + 0.3).abs() <= 1e-6, "{}", state.q[0]);
    let kinetic = 0.5 * MASS * state.qd[0] * state.qd[0];
    assert!((simulation.work().unwrap().motors - kinetic).abs() <= 1e-9);
    simulation.set_motor(body, Motor::torque(-2.0)).unwrap();
    let before = simulation.state().unwrap().qd[0];
    simulation.step(h).unwrap();
    assert!((simulation.state().unwrap().qd[0] - before + 2.0 * h / MASS).abs() <= 1e-15);
}

/// A ball joint with a spring and a damper returns to its rest by the short way.
#[test]
fn spherical_springs_return() {
    let rest = DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5);
    let joint = Joint::spherical()
        .with_spring(Spring::turned(5.0, rest))
        .with_damping(1.0)
        .with_armature(0.1);
    let model = ModelDescription::new("ball")
        .gravity(DVec3::ZERO)
        .body("rod", None, joint, MassProperties::rod(1.0, 0.5, 0.05))
        .build()
        .unwrap();
    let mut simulation = Simulation::new(model.clone()).unwrap();
    simulation.set_state(State::random(&model, 4)).unwrap();
    let energy = |simulation: &mut Simulation| {
        let stored = simulation.stored().unwrap();
        stored.springs + stored.rotors + simulation.mechanics().unwrap().kinetic_energy
    };
    let mut before = energy(&mut simulation);
    for _ in 0..4000 {
        simulation.step(5e-3).unwrap();
        let now = energy(&mut simulation);
        assert!(now <= before * (1.0 + 1e-3) + 1e-12, "{before} to {now}");
        before = now;
    }
    let turned = DQuat::from_slice(&simulation.state().unwrap().q);
    assert!(turned.dot(rest).abs() >= 1.0 - 1e-12);
}

fn balance(simulation: &mut Simulation) -> f64 {
    let (stored, work) = (simulation.stored().unwrap(), simulation.work().unwrap());
    let mechanics = simulation.mechanics().unwrap();
    // What springs store is their work, to first order in the step.
    mechanics.kinetic_energy + mechanics.potential_energy + stored.rotors - work.total()
}

/// Kinetic energy and rotors change by the work of all elements: exactly, where inertia is constant.
#[test]
fn work_balances_to_rounding_on_slides() {
    let mut description = ModelDescription::new("slides").gravity(DVec3::ZERO);
    let axes = [
        DVec3::X,
        DVec3::new(0.6, 0.8, 0.0),
        DVec3::new(0.0, 0.6, 0.8),
    ];
    let mut parent: Option<String> = None;
    for (index, axis) in axes.into_iter().enumerate() {
        let joint = Joint::prismatic(axis)
            .with_damping(0.5)
            .with_friction(0.3)
            .with_armature(0.7)
            .with_spring(Spring::at(20.0, 0.1))
            .with_range(-0.2, 0.3);
        let name = format!("slide {index}");
        let mass = MassProperties::sphere(1.0, 0.1);
        description = description.body(&name, parent.as_deref(), joint, mass);
        parent = Some(name);
    }
    let model = description.build().unwrap();
    let mut simulation = started(&model, 0.0, 3.0);
    let body = model.last_body();
    simulation
        .set_motor(body, Motor::position(0.25, 300.0, 2.0).limited(5.0))
        .unwrap();
    let start = balance(&mut simulation);
    let mut largest = start;
    for _ in 0..2000 {
        simulation.step(1e-3).unwrap();
        let now = balance(&mut simulation);
        largest = largest.max(simulation.work().unwrap().motors);
        assert!(
            (now - start).abs() <= f64::EPSILON.sqrt() * largest,
            "{start} to {now}"
        );
    }
    let work = simulation.work().unwrap();
    assert!(work.friction < 0.0 && work.dampers < 0.0 && work.stops < 0.0 && work.motors > 0.0);
}

/// And to the order of the step on mechanisms of every kind of joint and element.
#[test]
fn work_balances_to_first_order_on_mechanisms() {
    for seed in 0..6 {
        let model = generate::random_mechanism(6, true, seed).unwrap();
        let mut state = State::neutral(&model);
        let random = State::random(&model, seed);
        state.qd.copy_from_slice(&random.qd);
        let off = |steps: u32| {
            let mut simulation = Simulation::new(model.clone()).unwrap();
            simulation.set_state(state.clone()).unwrap();
            let start = balance(&mut simulation);
            let mut largest = start.abs();
            for _ in 0..steps {
                simulation.step(0.1 / f64::from(steps)).unwrap();
                largest = largest.max(simulation.mechanics().unwrap().kinetic_energy);
            }
            (balance(&mut simulation) - start).abs() / largest
        };
        let (coarse, fine) = (off(200), off(1600));
        assert!(
            fine <= 0.25 * coarse + 1e-9,
            "seed {seed}: {coarse:e} to {fine:e}"
        );
        assert!(fine <= 1e-2, "seed {seed}: {fine:e}");
    }
}

/// The dense solution of the same step is the same, and inverse dynamics give the forces back.
#[test]
fn algorithms_agree_on_loaded_mechanisms() {
    for seed in 0..10 {
        let model = generate::random_mechanism(12, true, seed).unwrap();
        let state = State::random(&model, seed);
        let mut elements = Elements::new(&model);
        let loaded = elements.load(&state, &Forces::none(&model), 1e-3).unwrap();
        let mut workspace = Workspace::new(&model, Precision::F64);
        let qdd = aba(&model, &state, loaded, &mut workspace)
            .unwrap()
            .to_vec();
        let tau = rnea(&model, &state, &qdd, loaded, &mut workspace).unwrap();
        for (dof, (&tau, &given)) in tau.iter().zip(&loaded.joint).enumerate() {
            let own = loaded.joint_inertia[dof] * qdd[dof].abs();
            assert!(
                (tau - given).abs() <= 1e-9 * (1.0 + own + given.abs()),
                "seed {seed} dof {dof}"
            );
        }
    }
}

/// Steps by divide and conquer and in one thread are those of the recursion to rounding.
#[test]
fn solvers_agree_on_steps() {
    let model = generate::random_mechanism(40, true, 3).unwrap();
    let run = |options: &SolverOptions| {
        let mut simulation = Simulation::new(model.clone())
            .unwrap()
            .with_solver(options)
            .unwrap();
        for _ in 0..20 {
            simulation.step(1e-3).unwrap();
        }
        simulation.state().unwrap().clone()
    };
    let reference = run(&SolverOptions::default());
    let options = SolverOptions {
        algorithm: Some(vertebra_dynamics::Algorithm::Dca),
        ..SolverOptions::default()
    };
    let largest = reference.qd.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    for (a, b) in run(&options).qd.iter().zip(&reference.qd) {
        assert!((a - b).abs() <= 1e-7 * largest, "{a} and {b}");
    }
}

/// Springs and dampers keep the order of an integrator that takes them as forces.
#[test]
fn smooth_elements_keep_the_order_of_runge_kutta() {
    let joint = slide().with_spring(Spring::at(8.0, 0.0)).with_damping(0.4);
    let model = single(joint);
    let off = |steps: u32| {
        let mut simulation = started(&model, 1.0, 0.0).with_integrator(Integrator::RungeKutta4);
        for _ in 0..steps {
            simulation.step(1.0 / f64::from(steps)).unwrap();
        }
        // q'' + 2 g q' + w0^2 q = 0 with g = 0.1, w0 = 2.
        let (g, w) = (0.1_f64, (4.0_f64 - 0.01).sqrt());
        let exact = (-g).exp() * (w.cos() + g / w * w.sin());
        (simulation.state().unwrap().q[0] - exact).abs()
    };
    let ratio = off(20) / off(40);
    assert!((14.0..18.0).contains(&ratio), "{ratio}");
}

/// And the work that is counted is right to second order in their steps.
#[test]
fn work_of_smooth_elements_balances_under_runge_kutta() {
    let soft = Stop::Soft {
        stiffness: 300.0,
        damping: 0.0,
    };
    let joint = slide()
        .with_spring(Spring::at(8.0, 0.0))
        .with_damping(0.4)
        .with_range(-0.5, 0.5)
        .with_stop(soft);
    let model = single(joint);
    let off = |steps: u32| {
        let mut simulation = started(&model, 0.3, 2.0).with_integrator(Integrator::RungeKutta4);
        let motor = Motor::position(0.2, 5.0, 0.3);
        simulation.set_motor(model.last_body(), motor).unwrap();
        let start = balance(&mut simulation);
        for _ in 0..steps {
            simulation.step(1.0 / f64::from(steps)).unwrap();
        }
        assert!(
            simulation.work().unwrap().stops != 0.0 && simulation.work().unwrap().motors != 0.0
        );
        (balance(&mut simulation) - start).abs()
    };
    let (coarse, fine) = (off(200), off(800));
    assert!(
        fine <= 0.2 * coarse && fine <= 1e-3,
        "{coarse:e} to {fine:e}"
    );
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let rough = single(slide().with_friction(1.0));
    let mut simulation = started(&rough, 0.0, 1.0).with_integrator(Integrator::RungeKutta4);
    let error = simulation.step(1e-3).unwrap_err();
    assert!(matches!(error, Error::RoughElement { .. }), "{error}");
    let before = simulation.state().unwrap().clone();
    let mut simulation = simulation.with_integrator(Integrator::SemiImplicitEuler);
    let error = simulation.step(-1e-3).unwrap_err();
    assert!(matches!(error, Error::StepBack { .. }) && error.to_string().contains("`body`"));
    assert_eq!(*simulation.state().unwrap(), before);
    let body = rough.last_body();
    let error = simulation
        .set_motor(body, Motor::velocity(1.0, -1.0))
        .unwrap_err();
    assert!(
        error.to_string().contains("damping of the motor"),
        "{error}"
    );
    let error = simulation.set_motor(body, Motor::torque(1.0).limited(f64::NAN));
    assert!(error.is_err());
    let ball = single(Joint::spherical());
    let mut simulation = Simulation::new(ball.clone()).unwrap();
    let error = simulation
        .set_motor(ball.last_body(), Motor::OFF)
        .unwrap_err();
    assert!(matches!(error, Error::NoMotor { .. }));
    assert!(Simulation::new(rough.bare()).unwrap().elements().is_none());
    let mut forces = Forces::none(&rough);
    forces.joint_inertia = vec![-1.0];
    assert!(forces.check(&rough).is_err());
    let mut workspace = Workspace::new(&rough, Precision::F64);
    assert!(mechanics(&rough, &before, &mut workspace).is_ok());
}
