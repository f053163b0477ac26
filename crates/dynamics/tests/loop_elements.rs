//! Elements of joints and motors in random mechanisms with closed loops.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use glam::{DQuat, DVec3};
use vertebra_assembly::{Closure, JointKind, Model, Random, Spring, State, generate, mechanism};
use vertebra_dynamics::{
    Algorithm, Integrator, Motor, Precision, Simulation, SolverOptions, Workspace,
    forward_kinematics,
};
use vertebra_spatial::Pose;

/// Bodies that carry mass; between the joints of compound ones there are more.
const BODIES: usize = 9;

fn vector(random: &mut Random) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| random.symmetric()))
}

fn closure(index: usize, random: &mut Random) -> Closure {
    let axis = random.direction();
    match index % 9 {
        0 => Closure::Distance {
            length: 0.5 + random.unit(),
        },
        1 => Closure::Ball,
        2 => Closure::Planar { normal: axis },
        3 => Closure::Cylindrical { axis },
        4 => Closure::Universal {
            first: axis,
            second: axis.any_orthonormal_vector(),
        },
        5 => Closure::Revolute { axis },
        6 => Closure::Prismatic { axis },
        7 => Closure::Screw {
            axis,
            pitch: 0.2 * random.symmetric(),
        },
        _ => Closure::Weld,
    }
}

/// A random mechanism with random elements, all joints at 0 (within their ranges) and in motion, in which two bodies, and
/// another and the world, are connected as they are: by a closure of the seed's kind and one of one or three equations.
fn closed(seed: u64) -> (Model, State) {
    let open = generate::random_mechanism(BODIES, true, seed).unwrap();
    let mut random = Random::new(seed ^ 0x0010_0095);
    let mut state = State::neutral(&open);
    let mut workspace = Workspace::new(&open, Precision::F64);
    forward_kinematics(&open, &state, &mut workspace).unwrap();
    let massive = |index: usize| {
        let name = format!("body-{index}");
        let id = open.find(&name).unwrap();
        (name, workspace.pose(id).unwrap())
    };
    let mut description = open.describe();
    let kind = usize::try_from(seed).unwrap();
    for (name, kind, ends) in [
        ("inner", kind, [Some(BODIES - 1), Some(BODIES / 2)]),
        ("outer", kind % 3, [Some(BODIES - 2), None]),
    ] {
        let closure = closure(kind, &mut random);
        let ends = ends.map(|end| end.map(massive));
        let here = ends[0].as_ref().map_or(Pose::IDENTITY, |end| end.1);
        let turn = DQuat::from_scaled_axis(vector(&mut random));
        let place = here * Pose::new(turn, 0.3 * vector(&mut random));
        let mut places = [place; 2];
        if let Closure::Distance { length } = closure {
            places[1].translation += length * random.direction();
        }
        let frames = [0, 1].map(|end| match &ends[end] {
            Some((_, pose)) => pose.inverse() * places[end],
            None => places[end],
        });
        let names = [0, 1].map(|end| ends[end].as_ref().map(|end| end.0.as_str()));
        description = description.close(name, names, frames, closure);
    }
    let model = description.build().unwrap();
    state.qd.fill_with(|| 2.0 * random.symmetric());
    (model, state)
}

/// The mechanism in motion, every other joint of one freedom driven.
fn simulation(seed: u64, options: &SolverOptions) -> Simulation {
    let (model, state) = closed(seed);
    let driven: Vec<_> = model.body_ids().zip(model.bodies()).collect();
    let mut simulation = Simulation::new(model.clone())
        .unwrap()
        .with_solver(options)
        .unwrap();
    simulation.set_state(state).unwrap();
    simulation.close_loops().unwrap();
    let mut random = Random::new(seed ^ 0x0003_0702);
    for (id, body) in driven {
        if body.dof_range().len() == 1 && random.below(2) == 0 {
            let motor = match random.below(3) {
                0 => Motor::torque(random.symmetric()),
                1 => Motor::velocity(random.symmetric(), random.unit()),
                _ => Motor::position(random.symmetric(), 10.0 * random.unit(), random.unit()),
            };
            simulation.set_motor(id, motor.limited(3.0)).unwrap();
        }
    }
    simulation
}

/// What would be constant but for the work of elements other than springs, whose work is what they store, to first order.
fn balance(simulation: &mut Simulation) -> f64 {
    let (stored, work) = (simulation.stored().unwrap(), simulation.work().unwrap());
    let mechanics = simulation.mechanics().unwrap();
    mechanics.kinetic_energy + mechanics.potential_energy + stored.rotors - work.total()
}

fn methods() -> [SolverOptions; 3] {
    let method = |algorithm, tolerance| SolverOptions {
        algorithm: Some(algorithm),
        tolerance,
        ..SolverOptions::default()
    };
    [
        method(Algorithm::Aba, None),
        method(Algorithm::Dca, None),
        method(Algorithm::Aba, Some(1e-9)),
    ]
}

/// Loops stay closed and take no work but what the order of the step allows, whatever acts in the joints.
#[test]
fn work_balances_in_closed_loops() {
    let mut seen = [false; 5];
    for seed in 0..18 {
        for options in methods() {
            let mut off = |steps: u32| {
                let mut simulation = simulation(seed, &options);
                let start = balance(&mut simulation);
                let mut largest = start.abs();
                let mut open = 0.0_f64;
                for _ in 0..steps {
                    simulation.step(0.1 / f64::from(steps)).unwrap();
                    largest = largest.max(simulation.mechanics().unwrap().kinetic_energy);
                    open = open.max(simulation.loop_violation().unwrap().unwrap().position);
                }
                assert!(open <= 1e-9, "seed {seed} {options:?}: open by {open:e}");
                let work = simulation.work().unwrap();
                let parts = [
                    work.motors,
                    work.springs,
                    work.dampers,
                    work.friction,
                    work.stops,
                ];
                for (seen, part) in seen.iter_mut().zip(parts) {
                    *seen |= part.abs() > 1e-3 * largest;
                }
                (balance(&mut simulation) - start).abs() / largest
            };
            let (coarse, fine) = (off(100), off(800));
            assert!(
                fine <= 0.25 * coarse + 1e-9,
                "seed {seed} {options:?}: {coarse:e} to {fine:e}"
            );
            assert!(fine <= 1e-2, "seed {seed} {options:?}: {fine:e}");
        }
    }
    assert_eq!(seen, [true; 5], "each kind of element does work somewhere");
}

/// Steps by divide and conquer and to a tolerance are those of the recursion.
#[test]
fn methods_agree_on_loaded_loops() {
    for seed in 0..18 {
        let run = |options: &SolverOptions| {
            let mut simulation = simulation(seed, options);
            simulation.steps(1e-3, 20).unwrap();
            simulation.state().unwrap().qd.clone()
        };
        let [reference, others @ ..] = methods();
        let reference = run(&reference);
        let largest = reference.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for options in others {
            for (a, b) in run(&options).iter().zip(&reference) {
                assert!(
                    (a - b).abs() <= 1e-6 * largest,
                    "seed {seed} {options:?}: {a} and {b}"
                );
            }
        }
    }
}

/// Accelerations of a platform on legs are rounded to more than an epsilon: that does not stop the iterations of the
/// midpoint rule, whose energy is right to second order.
#[test]
fn midpoint_steps_carry_a_stewart_platform() {
    let (model, mut state) = mechanism::stewart_platform().unwrap();
    let mut description = model.describe();
    for body in &mut description.bodies {
        if matches!(body.joint.kind, JointKind::Prismatic { .. }) {
            body.joint.spring = Some(Spring::at(4e3, 0.0));
        }
    }
    let model = description.build().unwrap();
    state.qd[..6].copy_from_slice(&[0.3, -0.2, 0.5, 0.4, 0.1, -0.2]);
    let off = |steps: u32| {
        let mut simulation = Simulation::new(model.clone())
            .unwrap()
            .with_integrator(Integrator::ImplicitMidpoint);
        simulation.set_state(state.clone()).unwrap();
        simulation.close_loops().unwrap();
        let energy = |simulation: &mut Simulation| {
            let springs = simulation.stored().unwrap().springs;
            let mechanics = simulation.mechanics().unwrap();
            springs + mechanics.kinetic_energy + mechanics.potential_energy
        };
        let start = energy(&mut simulation);
        let (mut off, mut largest) = (0.0_f64, 0.0_f64);
        for _ in 0..steps {
            simulation.step(1.0 / f64::from(steps)).unwrap();
            off = off.max((energy(&mut simulation) - start).abs());
            largest = largest.max(simulation.mechanics().unwrap().kinetic_energy);
        }
        off / largest
    };
    let (coarse, fine) = (off(256), off(1024));
    assert!(
        fine <= 0.1 * coarse && fine <= 1e-3,
        "{coarse:e} to {fine:e}"
    );
}
