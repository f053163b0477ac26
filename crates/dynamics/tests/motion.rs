//! Motion in time: conservation, order of convergence, closed forms, kinematics against differences.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use glam::{DMat3, DQuat, DVec3};
use vertebra_assembly::generate::{self, RandomTree, Rod};
use vertebra_assembly::{Joint, MassProperties, Model, ModelDescription, State};
use vertebra_dynamics::{
    Algorithm, Error, Forces, Integrator, Precision, Simulation, SolverOptions, Workspace, Wrench,
    aba, forward_kinematics, joint_wrenches,
};
use vertebra_spatial::Pose;

fn simulation(model: &Model, state: &State, integrator: Integrator) -> Simulation {
    let mut simulation = Simulation::new(model.clone())
        .unwrap()
        .with_integrator(integrator);
    simulation.set_state(state.clone()).unwrap();
    simulation
}

/// A tree with every kind of joint, floating, without gravity.
fn floating_tree(gravity: DVec3) -> (Model, State) {
    let tree = RandomTree {
        floating: true,
        ..RandomTree::mixed(14)
    };
    let mut description = generate::random_tree(&tree, 4).unwrap().describe();
    description.gravity = gravity;
    let model = description.build().unwrap();
    let state = State::random(&model, 9);
    (model, state)
}

#[test]
fn a_pendulum_swings_with_the_period_of_the_elliptic_integral() {
    let rod = MassProperties::rod(2.0, 1.0, 0.01);
    let model = ModelDescription::new("pendulum")
        .body("rod", None, Joint::revolute(DVec3::X), rod)
        .build()
        .unwrap();
    // From rest at 90 degrees to hanging and back: T = 4 sqrt(I / (m g l)) K(sin(pi/4)).
    let about_pivot = rod.about(DVec3::ZERO).x_axis.x;
    let complete_elliptic = 1.854_074_677_301_371_9;
    let period = 4.0 * (about_pivot / (2.0 * 9.81 * 0.5)).sqrt() * complete_elliptic;
    let mut state = State::neutral(&model);
    state.q[0] = 0.5 * core::f64::consts::PI;
    let mut simulation = simulation(&model, &state, Integrator::RungeKutta4);
    let steps = 2000;
    for _ in 0..steps {
        simulation.step(period / f64::from(steps)).unwrap();
    }
    let h = period / f64::from(steps);
    assert!((simulation.state().unwrap().q[0] - state.q[0]).abs() < 10.0 * h.powi(4));
    assert!(simulation.state().unwrap().qd[0].abs() < 100.0 * h.powi(4));
}

#[test]
fn orders_of_convergence() {
    let (model, start) = floating_tree(DVec3::new(0.0, 0.0, -9.81));
    let time = 0.04;
    let end = |integrator, steps: u32| {
        let mut simulation = simulation(&model, &start, integrator);
        for _ in 0..steps {
            simulation.step(time / f64::from(steps)).unwrap();
        }
        let state = simulation.state().unwrap();
        [state.q.clone(), state.qd.clone()].concat()
    };
    let exact = end(Integrator::RungeKutta4, 1024);
    let error = |integrator, steps| {
        end(integrator, steps)
            .iter()
            .zip(&exact)
            .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
    };
    for (integrator, order) in [
        (Integrator::SemiImplicitEuler, 1.0),
        (Integrator::RungeKutta4, 4.0),
        (Integrator::ImplicitMidpoint, 2.0),
    ] {
        let slope = (error(integrator, 16) / error(integrator, 64)).log2() / 2.0;
        assert!(
            (slope - order).abs() < 0.35,
            "{integrator:?}: order {slope}"
        );
    }
}

/// Steps back undo steps, of the symmetric method to rounding, on quaternions and floating bases too;
/// what others leave is their error.
#[test]
fn steps_back_undo_steps() {
    let (model, start) = floating_tree(DVec3::new(0.0, 0.0, -9.81));
    let (h, steps) = (1e-2, 20);
    let left = |integrator| {
        let mut simulation = simulation(&model, &start, integrator);
        for step in [h, -h] {
            for _ in 0..steps {
                simulation.step(step).unwrap();
            }
        }
        let state = simulation.state().unwrap();
        let q = state.q.iter().zip(&start.q);
        let qd = state.qd.iter().zip(&start.qd);
        let largest = |m: f64, (a, b): (&f64, &f64)| m.max((a - b).abs());
        q.fold(qd.fold(0.0, largest), largest)
    };
    let rates = start.qd.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    let rounding = 1e4 * f64::EPSILON * rates;
    let symmetric = left(Integrator::ImplicitMidpoint);
    assert!(symmetric <= rounding, "{symmetric:e}");
    for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
        let other = left(integrator);
        assert!(other > rounding, "{integrator:?}: {other:e}");
    }
}

/// A pendulum for 200 periods at 20 steps each: the midpoint rule's energy comes back, that of
/// Runge-Kutta drifts away.
#[test]
fn energy_stays_in_long_runs() {
    let rod = MassProperties::rod(2.0, 1.0, 0.01);
    let model = ModelDescription::new("pendulum")
        .body("rod", None, Joint::revolute(DVec3::X), rod)
        .build()
        .unwrap();
    let mut state = State::neutral(&model);
    state.q[0] = 1.5;
    let off = |integrator| {
        let mut simulation = simulation(&model, &state, integrator);
        let energy = |simulation: &mut Simulation| {
            let sums = simulation.mechanics().unwrap();
            sums.kinetic_energy + sums.potential_energy
        };
        let before = energy(&mut simulation);
        let mut ends = [0.0_f64; 2];
        for end in &mut ends {
            for _ in 0..2000 {
                simulation.step(0.09).unwrap();
                *end = end.max((energy(&mut simulation) - before).abs());
            }
        }
        ends
    };
    let [early, late] = off(Integrator::ImplicitMidpoint);
    assert!(late <= 1.01 * early, "{early:e}, {late:e}");
    let [early, late] = off(Integrator::RungeKutta4);
    assert!(late > 1.5 * early, "{early:e}, {late:e}");
}

/// A step too long to be solved is refused, and the state kept.
#[test]
fn implicit_steps_too_long_are_refused() {
    let (model, start) = floating_tree(DVec3::ZERO);
    let mut simulation = simulation(&model, &start, Integrator::ImplicitMidpoint);
    let refused = simulation.step(5.0);
    assert!(
        matches!(
            refused,
            Err(Error::NotConverged { .. } | Error::Overflow { .. })
        ),
        "{refused:?}"
    );
    assert_eq!(simulation.state().unwrap(), &start);
    simulation.step(1e-4).unwrap();
}

/// What should not change drifts by the method's error only: 16 times less for half the step, down to
/// rounding.
#[test]
fn momentum_and_energy_are_conserved() {
    let (model, state) = floating_tree(DVec3::ZERO);
    let time = 0.25;
    let drifts = |steps: u32| -> [f64; 4] {
        let mut simulation = simulation(&model, &state, Integrator::RungeKutta4);
        let before = simulation.mechanics().unwrap();
        for _ in 0..steps {
            simulation.step(time / f64::from(steps)).unwrap();
        }
        let after = simulation.mechanics().unwrap();
        let uniform = before.center + before.linear_momentum / before.mass * time;
        [
            (after.kinetic_energy - before.kinetic_energy).abs() / before.kinetic_energy,
            (after.linear_momentum - before.linear_momentum).length()
                / before.linear_momentum.length(),
            (after.angular_momentum - before.angular_momentum).length()
                / before.angular_momentum.length(),
            (after.center - uniform).length(),
        ]
    };
    let (coarse, fine) = (drifts(250), drifts(1000));
    for (what, (coarse, fine)) in ["energy", "linear momentum", "angular momentum", "centre"]
        .into_iter()
        .zip(coarse.into_iter().zip(fine))
    {
        // 4^4 = 256 times less, a factor 4 for higher orders, plus rounding of 1000 steps.
        let bound = coarse / 64.0 + 1000.0 * f64::EPSILON;
        assert!(fine <= bound, "{what}: {coarse:e} falls to {fine:e} only");
    }
}

#[test]
fn power_of_the_forces_is_the_rate_of_the_energy() {
    let (model, state) = floating_tree(DVec3::new(1.0, 2.0, -9.81));
    let mut simulation = simulation(&model, &state, Integrator::RungeKutta4);
    for dof in 0..model.dof_count() {
        simulation.forces_mut().joint[dof] = (dof as f64).sin();
    }
    let wrench = Wrench::at_point([1.0, -2.0, 3.0], [0.1, 0.2, 0.3]).with_torque([0.5, 0.0, -0.5]);
    simulation.forces_mut().push(model.last_body(), wrench);
    let power: f64 = {
        let joint = &simulation.forces().joint;
        let joints: f64 = joint.iter().zip(&state.qd).map(|(tau, qd)| tau * qd).sum();
        let mut workspace = Workspace::new(&model, Precision::F64);
        forward_kinematics(&model, &state, &mut workspace).unwrap();
        let v = workspace.velocity(model.last_body()).unwrap();
        let pose = workspace.pose(model.last_body()).unwrap();
        let (w, origin) = (v.angular, v.linear);
        let at_point = origin + w.cross(pose.rotation * wrench.point.unwrap());
        joints + wrench.force.dot(at_point) + wrench.torque.dot(w)
    };
    let mut energy_after = |h: f64| {
        simulation.set_state(state.clone()).unwrap();
        simulation.step(h).unwrap();
        let sums = simulation.mechanics().unwrap();
        sums.kinetic_energy + sums.potential_energy
    };
    let scale = energy_after(0.0).abs() + power.abs();
    let mut rate = |h: f64| (energy_after(h) - energy_after(-h)) / (2.0 * h);
    let (coarse, fine) = (rate(2e-4), rate(1e-4));
    assert!((fine - power).abs() <= quotient_error((coarse - fine).abs(), scale, 1e-4));
}

/// Bound of the error of a central difference quotient with step h: its truncation error is a third of
/// what it changed by when the step was halved (doubled here, for higher orders), and rounding.
fn quotient_error(change: f64, scale: f64, h: f64) -> f64 {
    2.0 / 3.0 * change + 64.0 * f64::EPSILON * scale / h
}

/// Pose, angular and linear velocity of a body.
type Sample = (Pose, DVec3, DVec3);

#[test]
fn velocities_and_accelerations_are_the_derivatives_of_poses() {
    let (model, state) = floating_tree(DVec3::new(0.0, 0.0, -9.81));
    let forces = Forces::none(&model);
    let mut simulation = simulation(&model, &state, Integrator::RungeKutta4);
    let h = 1e-4;
    let mut at = |h: f64| -> Vec<Sample> {
        simulation.set_state(state.clone()).unwrap();
        simulation.step(h).unwrap();
        let mut workspace = Workspace::new(&model, Precision::F64);
        forward_kinematics(&model, simulation.state().unwrap(), &mut workspace).unwrap();
        model
            .body_ids()
            .map(|id| {
                let v = workspace.velocity(id).unwrap();
                (workspace.pose(id).unwrap(), v.angular, v.linear)
            })
            .collect()
    };
    let now = at(0.0);
    let (near, far) = ((at(-h), at(h)), (at(-2.0 * h), at(2.0 * h)));
    let mut workspace = Workspace::new(&model, Precision::F64);
    aba(&model, &state, &forces, &mut workspace).unwrap();
    for (i, id) in model.body_ids().enumerate() {
        let acceleration = workspace.acceleration(id).unwrap();
        let scale = acceleration.linear.length() + acceleration.angular.length() + 10.0;
        let check = |what: &str, value: DVec3, f: &dyn Fn(&Sample, &Sample) -> DVec3| {
            let fine = f(&near.0[i], &near.1[i]) / (2.0 * h);
            let coarse = f(&far.0[i], &far.1[i]) / (4.0 * h);
            let bound = quotient_error((coarse - fine).length(), scale, h);
            let error = (fine - value).length();
            assert!(error <= bound, "{what} of {i}: {error:e} beyond {bound:e}");
        };
        check("velocity", now[i].2, &|a, b| {
            b.0.translation - a.0.translation
        });
        check("spin", now[i].1, &|a, b| {
            (b.0.rotation * a.0.rotation.conjugate()).to_scaled_axis()
        });
        check("acceleration", acceleration.linear, &|a, b| b.2 - a.2);
        check("angular acceleration", acceleration.angular, &|a, b| {
            b.1 - a.1
        });
    }
}

/// The same mechanism described in other frames, units or order moves the same way.
#[test]
fn descriptions_do_not_matter() {
    let (model, state) = floating_tree(DVec3::new(0.0, 0.0, -9.81));
    let mut workspace = Workspace::new(&model, Precision::F64);
    let forces = Forces::none(&model);
    let qdd = aba(&model, &state, &forces, &mut workspace)
        .unwrap()
        .to_vec();

    // Body frames moved: only child placements and what is given in body frames change.
    let mut description = model.describe();
    let shift = Pose::new(
        DQuat::from_scaled_axis(DVec3::new(0.3, -0.8, 0.5)),
        DVec3::new(0.2, 0.1, -0.4),
    );
    for body in &mut description.bodies {
        body.mass = body.mass.placed(&shift);
        body.joint.child_placement = shift * body.joint.child_placement;
        if body.parent.is_some() {
            body.joint.parent_placement = shift * body.joint.parent_placement;
        }
    }
    let moved = description.build().unwrap();
    let mut workspace = Workspace::new(&moved, Precision::F64);
    let other = aba(&moved, &state, &forces, &mut workspace).unwrap();
    let largest = qdd.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // A different route through rounding: condition of a 14-body tree below 1e6.
    for (a, b) in qdd.iter().zip(other) {
        assert!((a - b).abs() <= 1e6 * f64::EPSILON * largest);
    }
}

/// Model units are powers of two, so a model a million times smaller and lighter moves alike, bit for
/// bit, in both precisions; in plain SI its f32 solution would underflow.
#[test]
fn small_models_lose_nothing() {
    let scale = 2.0_f64.powi(-30);
    let molecule = |mass: f64, length: f64| {
        let body = |m: f64| MassProperties {
            mass: m * mass,
            center: DVec3::new(0.1, 0.2, 0.3) * length,
            inertia: DMat3::from_diagonal(DVec3::new(0.5, 0.6, 0.7)) * (m * mass * length * length),
        };
        let joint = |axis| Joint::revolute(axis).at(Pose::from_translation(DVec3::Z * length));
        ModelDescription::new("molecule")
            .gravity(DVec3::ZERO)
            .body("a", None, Joint::free(), body(1.0))
            .body("b", Some("a"), joint(DVec3::X), body(2.0))
            .body("c", Some("b"), joint(DVec3::Y), body(0.5))
            .build()
            .unwrap()
    };
    let (big, small) = (molecule(1.0, 1.0), molecule(2.0_f64.powi(-86), scale));
    let mut state = State::random(&big, 3);
    for precision in [Precision::F64, Precision::F32] {
        state = State::random(&big, 3);
        let mut workspace = Workspace::new(&big, precision);
        let qdd = aba(&big, &state, &Forces::none(&big), &mut workspace)
            .unwrap()
            .to_vec();
        for coordinate in 0..3 {
            state.q[coordinate] *= scale;
            state.qd[3 + coordinate] *= scale;
        }
        let mut workspace = Workspace::new(&small, precision);
        let small_qdd = aba(&small, &state, &Forces::none(&small), &mut workspace).unwrap();
        for (dof, (a, b)) in qdd.iter().zip(small_qdd).enumerate() {
            let linear = (3..6).contains(&dof);
            assert_eq!(
                a * if linear { scale } else { 1.0 },
                *b,
                "{precision} dof {dof}"
            );
        }
    }
    assert_eq!(state.q.len(), 9);
}

/// Bodies that do not move against each other are one body.
#[test]
fn fixed_joints_weld() {
    let rod = Rod::default();
    let mass = MassProperties::rod(rod.mass, rod.length, rod.radius);
    let tip = Pose::new(
        DQuat::from_scaled_axis(DVec3::new(0.4, 0.1, 0.0)),
        DVec3::new(0.0, 0.0, rod.length),
    );
    let apart = ModelDescription::new("apart")
        .body("a", None, Joint::spherical(), mass)
        .body("b", Some("a"), Joint::fixed().at(tip), mass)
        .body("c", Some("b"), Joint::revolute(DVec3::Y).at(tip), mass)
        .build()
        .unwrap();
    let welded = ModelDescription::new("welded")
        .body(
            "ab",
            None,
            Joint::spherical(),
            mass.combined(&mass.placed(&tip)),
        )
        .body(
            "c",
            Some("ab"),
            Joint::revolute(DVec3::Y).at(tip * tip),
            mass,
        )
        .build()
        .unwrap();
    for seed in 0..20 {
        let state = State::random(&apart, seed);
        let [a, b] = [&apart, &welded].map(|model| {
            let mut workspace = Workspace::new(model, Precision::F64);
            aba(model, &state, &Forces::none(model), &mut workspace)
                .unwrap()
                .to_vec()
        });
        let largest = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() <= 1e4 * f64::EPSILON * largest);
        }
    }
}

/// A chain that hangs at rest: each joint carries the weight below it, upwards, through its origin.
#[test]
fn joints_carry_what_hangs_from_them() {
    let rod = Rod::default();
    let model = generate::chain(5, &Joint::spherical(), &rod).unwrap();
    let mut state = State::neutral(&model);
    // Turned head down at the first joint.
    state.q[..4].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
    let mut workspace = Workspace::new(&model, Precision::F64);
    let qdd = aba(&model, &state, &Forces::none(&model), &mut workspace).unwrap();
    assert!(qdd.iter().all(|qdd| qdd.abs() < 1e-13));
    joint_wrenches(&mut workspace).unwrap();
    for (below, id) in model.body_ids().rev().enumerate() {
        let weight = (below + 1) as f64 * rod.mass * 9.81;
        let carried = workspace.joint_wrench(id).unwrap();
        assert!((carried.force - DVec3::Z * weight).length() < 1e-13 * weight);
        assert!(carried.moment.length() < 1e-13 * weight);
    }
}

/// The same motion by either algorithm, poses and energies included, which the tree's own memory does
/// not have.
#[test]
fn either_solver_moves_alike() {
    let tree = RandomTree {
        floating: true,
        ..RandomTree::mixed(60)
    };
    let model = generate::random_tree(&tree, 5).unwrap();
    let mut found = Vec::new();
    for algorithm in [Algorithm::Aba, Algorithm::Dca] {
        let options = SolverOptions {
            algorithm: Some(algorithm),
            ..SolverOptions::default()
        };
        let mut simulation = Simulation::new(model.clone())
            .unwrap()
            .with_integrator(Integrator::RungeKutta4)
            .with_solver(&options)
            .unwrap();
        assert_eq!(simulation.choice().algorithm, algorithm);
        simulation.set_state(State::random(&model, 3)).unwrap();
        for _ in 0..20 {
            simulation.step(1e-3).unwrap();
        }
        let tip = simulation.pose(model.last_body()).unwrap().translation;
        let mechanics = simulation.mechanics().unwrap();
        found.push((tip, mechanics.kinetic_energy + mechanics.potential_energy));
    }
    let ((a, energy), (b, other)) = (found[0], found[1]);
    assert!((a - b).length() <= 1e-11 * a.length(), "{a} and {b}");
    assert!((energy - other).abs() <= 1e-11 * energy.abs().max(1.0));
}
