//! Elements of joints and motors in random mechanisms with closed loops.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use glam::DVec3;
use vertebra_assembly::{BodyId, JointKind, Random, Spring, mechanism};
use vertebra_dynamics::{
    Algorithm, Integrator, Motor, Precision, Simulation, SolverOptions, Workspace, crba,
};

/// Bodies that carry mass.
const BODIES: usize = 9;

/// The mechanism in motion, every other joint of one freedom driven.
fn simulation(seed: u64, options: &SolverOptions) -> Simulation {
    let (model, state) = mechanism::random(BODIES, true, seed).unwrap();
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

/// Rates are closed by the least change in the metric of all inertia, that of rotors included: what is taken away has no part along
/// any rates that loops allow.
#[test]
fn loops_are_closed_with_the_inertia_of_rotors() {
    let mut rotors_matter = false;
    for seed in 0..18 {
        for options in methods() {
            let mut simulation = simulation(seed, &options);
            let model = simulation.model().clone();
            let state = simulation.state().unwrap().clone();
            let mut random = Random::new(seed);
            let mut closed = || {
                let mut open = state.clone();
                open.qd.fill_with(|| random.symmetric());
                simulation.set_state(open.clone()).unwrap();
                simulation.close_loops().unwrap();
                let closed = simulation.state().unwrap();
                let taken: Vec<f64> = open.qd.iter().zip(&closed.qd).map(|(a, b)| a - b).collect();
                (closed.qd.clone(), taken)
            };
            let (allowed, (_, taken)) = (closed().0, closed());
            let mut workspace = Workspace::new(&model, Precision::F64);
            let mass = crba(&model, &state, &mut workspace).unwrap();
            let product = |a: &[f64], b: &[f64]| -> [f64; 2] {
                let (mut bodies, mut rotors) = (0.0, 0.0);
                for i in 0..a.len() {
                    for j in 0..b.len() {
                        bodies += a[i] * mass[(i, j)] * b[j];
                    }
                }
                for body in model.bodies() {
                    for i in body.dof_range() {
                        rotors += a[i] * body.joint.armature * b[i];
                    }
                }
                [bodies, rotors]
            };
            let sum = |a: &[f64], b: &[f64]| product(a, b).iter().sum::<f64>();
            let size = (sum(&allowed, &allowed) * sum(&taken, &taken)).sqrt();
            let off = sum(&allowed, &taken).abs() / size;
            assert!(off <= 1e-6, "seed {seed} {options:?}: {off:e}");
            rotors_matter |= product(&allowed, &taken)[1].abs() > 1e-3 * size;
        }
    }
    assert!(rotors_matter);
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
            let first_order = |coarse: f64, fine: f64| fine <= 0.25 * coarse + 1e-9;
            let (coarse, fine) = (off(100), off(800));
            // A stop that coarse steps do not reach, or meet at a lucky instant, hides the order: finer ones then show it.
            assert!(
                first_order(coarse, fine) || first_order(fine, off(6400)),
                "seed {seed} {options:?}: {coarse:e} to {fine:e}"
            );
            assert!(fine <= 1e-2, "seed {seed} {options:?}: {fine:e}");
        }
    }
    assert_eq!(seen, [true; 5], "each kind of element does work somewhere");
}

/// What loops take stands in the account: of mechanisms without elements all of what semi-implicit steps lose but what the
/// tree's own steps are off by. Of the other integrators the loss is their own: loops add no more to it.
#[test]
fn loops_account_for_what_they_take() {
    let mechanisms = [
        mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4),
        mechanism::five_bar(),
        mechanism::bennett(),
        mechanism::jansen_leg(),
    ];
    for (model, start) in mechanisms.map(Result::unwrap) {
        for (integrator, part, rest) in [
            (Integrator::SemiImplicitEuler, 0.1, 1e-3),
            (Integrator::RungeKutta4, 1.0, 1e-8),
            (Integrator::ImplicitMidpoint, 1.0, 1e-4),
        ] {
            let mut simulation = Simulation::new(model.clone())
                .unwrap()
                .with_integrator(integrator);
            simulation.set_state(start.clone()).unwrap();
            let energy = |simulation: &mut Simulation| {
                let mechanics = simulation.mechanics().unwrap();
                (
                    mechanics.kinetic_energy + mechanics.potential_energy,
                    mechanics.kinetic_energy,
                )
            };
            let (before, mut largest) = energy(&mut simulation);
            for _ in 0..5000 {
                simulation.step(1e-3).unwrap();
                largest = largest.max(energy(&mut simulation).1);
            }
            let lost = energy(&mut simulation).0 - before;
            let taken = simulation.work().unwrap().loops;
            assert!(taken != 0.0, "{}: loops do nothing", model.name());
            let off = (lost - taken) / largest;
            let (lost, off) = (lost.abs() / largest, off.abs());
            assert!(
                off <= part * lost + rest,
                "{}: {lost:e}, {off:e}",
                model.name()
            );
        }
    }
}

/// Stiff motors drive closed linkages: what they do is their work, and loops take next to nothing.
#[test]
fn loops_take_no_work_of_stiff_motors() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let model = model.describe().gravity(DVec3::ZERO).build().unwrap();
    for motor in [
        Motor::torque(1.0),
        Motor::velocity(6.0, 1e3),
        Motor::velocity(6.0, 1e5),
        Motor::position(2.0, 1e4, 100.0),
    ] {
        let off = |steps: u32| {
            let mut simulation = Simulation::new(model.clone()).unwrap();
            simulation.set_state(state.clone()).unwrap();
            simulation.set_motor(BodyId(0), motor).unwrap();
            let start = balance(&mut simulation);
            let mut largest = 0.0_f64;
            for _ in 0..steps {
                simulation.step(1.0 / f64::from(steps)).unwrap();
                largest = largest.max(simulation.mechanics().unwrap().kinetic_energy);
            }
            let loops = simulation.work().unwrap().loops;
            [(balance(&mut simulation) - start).abs(), loops.abs()].map(|x| x / largest)
        };
        let (coarse, fine) = (off(1000), off(8000));
        for (coarse, fine) in coarse.into_iter().zip(fine) {
            // Steps that do not yet resolve how a motor starts gain less than an eighth.
            assert!(
                fine <= 0.5 * coarse && fine <= 1e-2,
                "{motor:?}: {coarse:e} to {fine:e}"
            );
        }
    }
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
