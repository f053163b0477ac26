//! Rows against differences, forces against dense matrices.

use super::*;
use crate::integrate::{displace, to_displacement_axes};
use crate::{Precision, Workspace, crba};
use faer::Mat;
use glam::{DQuat, DVec3};
use vertebra_assembly::generate::{self, RandomTree};
use vertebra_assembly::{Closure, Random, mechanism};
use vertebra_spatial::Pose;

/// The articulated-body algorithm in f64.
fn method(model: &Model) -> Method {
    Method::Aba(Box::new(Workspace::of_tree(model, Precision::F64)))
}

fn vector(random: &mut Random) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| random.symmetric()))
}

fn placement(random: &mut Random) -> Pose {
    let turn = DQuat::from_scaled_axis(vector(random) * 3.0);
    Pose::new(turn, vector(random))
}

/// A random tree with a closure between two of its bodies, and one between one of them and the world.
fn closed_tree(closure: Closure, seed: u64) -> Model {
    let tree = RandomTree {
        floating: seed.is_multiple_of(2),
        reach: 3,
        ..RandomTree::mixed(9)
    };
    let description = generate::random_tree(&tree, seed).unwrap().describe();
    let name = |k: usize| description.bodies[k].name.clone();
    let (one, other) = (name(4), name(8));
    let mut random = Random::new(seed + 77);
    let mut places = || [placement(&mut random), placement(&mut random)];
    let (inner, outer) = (places(), places());
    description
        .close("inner", [Some(&one), Some(&other)], inner, closure)
        .close("outer", [Some(&other), None], outer, closure)
        .build()
        .unwrap()
}

fn closures() -> [Closure; 8] {
    let axis = DVec3::new(0.3, -1.0, 0.4);
    let second = DVec3::new(1.0, 0.2, -0.3);
    [
        Closure::Weld,
        Closure::Ball,
        Closure::Revolute { axis },
        Closure::Prismatic { axis },
        Closure::Cylindrical { axis },
        Closure::Universal {
            first: axis,
            second,
        },
        Closure::Planar { normal: axis },
        Closure::Distance { length: 0.7 },
    ]
}

/// e, J qd and e'' of a state with given accelerations in the model's units.
fn measure(loops: &mut Loops, model: &Model, state: &State, qdd: &[f64]) -> [Vec<f64>; 3] {
    loops.place(model, state);
    loops.kinematics.u.copy_from_slice(qdd);
    loops.kinematics.accelerate();
    loops.evaluate(true);
    let rates = loops.kinematics.rates.clone();
    let mut products = Vec::new();
    for constraint in &loops.constraints {
        for row in constraint.rows.clone() {
            products.push(constraint.times(row, &loops.jacobian, &rates));
        }
    }
    [loops.values.clone(), products, loops.second_rates.clone()]
}

/// The state after a short while h in the model's units, to second order.
fn later(loops: &Loops, model: &Model, state: &State, qdd: &[f64], h: f64) -> State {
    let mut moved = state.clone();
    let time = h * model.units().time;
    let mut displacement: Vec<f64> = state.qd.iter().map(|rate| rate * time).collect();
    to_displacement_axes(model, state, &mut displacement);
    displace(model, state, &displacement, &mut moved);
    for (k, rate) in moved.qd.iter_mut().enumerate() {
        *rate += h * qdd[k] / loops.scales.rate[k];
    }
    moved
}

/// `first` is 1 where the rates that J gives are only those of closed loops.
fn check_rates(model: &Model, state: &State, seed: u64, first: usize) {
    let mut loops = Loops::of_model(model).unwrap();
    let mut random = Random::new(seed);
    let qdd: Vec<f64> = state.qd.iter().map(|_| random.symmetric()).collect();
    let [_, rates, second] = measure(&mut loops, model, state, &qdd);
    let h = 1e-5;
    let [ahead, behind] = [h, -h].map(|h| {
        let state = later(&loops, model, state, &qdd, h);
        measure(&mut loops, model, &state, &qdd)
    });
    for (exact, k) in [(&rates, 0), (&second, 1)].into_iter().skip(first) {
        let size = largest(exact).max(1.0);
        for row in 0..exact.len() {
            let difference = (ahead[k][row] - behind[k][row]) / (2.0 * h);
            let off = (difference - exact[row]).abs();
            assert!(
                off <= 1e-6 * size,
                "row {row} of rate {k}: {difference} or {}",
                exact[row]
            );
        }
    }
}

#[test]
fn rows_are_the_rates_of_their_equations() {
    for (seed, closure) in (0..).zip(closures()) {
        let model = closed_tree(closure, seed);
        check_rates(&model, &State::random(&model, seed), seed, 0);
    }
    let axis = DVec3::new(0.3, -1.0, 0.4);
    for seed in 8..12 {
        let model = closed_tree(Closure::Screw { axis, pitch: 0.3 }, seed);
        check_rates(&model, &State::random(&model, seed), seed, 1);
    }
}

/// A body on a screw of its own kind: a cylindrical pair of joints, held by a screw closure.
#[test]
fn screws_turn_and_slide_in_proportion() {
    use vertebra_assembly::{Joint, MassProperties, ModelDescription};
    let (axis, pitch) = (DVec3::new(0.6, 0.0, 0.8), 0.25);
    let mass = MassProperties::rod(1.0, 0.5, 0.1);
    let model = ModelDescription::new("screw")
        .body("nut", None, Joint::prismatic(axis), mass)
        .body("turn", Some("nut"), Joint::revolute(axis), mass)
        .close(
            "thread",
            [None, Some("turn")],
            [Pose::IDENTITY; 2],
            Closure::Screw { axis, pitch },
        )
        .build()
        .unwrap();
    let mut state = State::neutral(&model);
    // Ten turns on.
    state.q = vec![
        10.3 * core::f64::consts::TAU * pitch,
        10.3 * core::f64::consts::TAU,
    ];
    state.qd = vec![0.2 * pitch, 0.2];
    let mut loops = Loops::of_model(&model).unwrap();
    let found = loops.violation(&model, &state);
    assert!(found.position <= 1e-13 && found.rate <= 1e-13, "{found:?}");
    check_rates(&model, &state, 3, 0);
    state.qd[0] += 0.1;
    assert!(loops.violation(&model, &state).rate > 1e-2);
}

/// Against the dense pseudo-inverse, with every closure there twice: forces, and the accelerations that they
/// make.
#[test]
fn redundant_loops_share_their_forces_as_the_pseudo_inverse_does() {
    for (seed, closure) in (0..).zip(closures()) {
        let description = closed_tree(closure, seed).describe();
        let mut twice = description.clone();
        for closed in &description.loops {
            let mut again = closed.clone();
            again.name += " again";
            twice.loops.push(again);
        }
        let model = twice.build().unwrap();
        let mut state = State::random(&model, seed);
        state.qd.iter_mut().for_each(|rate| *rate *= 0.1);
        let forces = Forces::none(&model);
        let mut workspace = Workspace::new(&model, Precision::F64);
        let mut loops = Loops::of_model(&model).unwrap();
        let mass = crba(&model, &state, &mut workspace).unwrap().to_owned();
        let mut method = method(&model);
        let free = method.solve(&model, &state, &forces).unwrap().to_vec();
        let qdd = loops
            .constrain(&model, &state, &mut method)
            .unwrap()
            .to_vec();
        loops.take_least_norm(&mut method);

        let (rows, dofs) = (loops.values.len(), model.dof_count());
        let mut jacobian = Mat::<f64>::zeros(rows, dofs);
        for constraint in &loops.constraints {
            for row in constraint.rows.clone() {
                for (&dof, &entry) in constraint
                    .dofs
                    .iter()
                    .zip(constraint.row(row, &loops.jacobian))
                {
                    jacobian[(row, dof)] = entry * loops.row_scales[row];
                }
            }
        }
        // The mass matrix in the model's units.
        let scales = &loops.scales;
        let mass = Mat::from_fn(dofs, dofs, |i, j| {
            mass[(i, j)] * scales.acceleration[j] / scales.force[i]
        });
        use faer::linalg::solvers::Solve;
        let responses = mass.full_piv_lu().solve(jacobian.transpose());
        let delassus = &jacobian * &responses;
        let svd = delassus.svd().unwrap();
        let target = Mat::from_fn(rows, 1, |row, _| {
            -loops.second_rates[row] * loops.row_scales[row]
        });
        let turned = svd.U().transpose() * &target;
        let values = svd.S();
        let largest_value = values[0];
        let solved = Mat::from_fn(rows, 1, |k, _| {
            let value = values[k];
            if value > 1e-11 * largest_value {
                turned[(k, 0)] / value
            } else {
                0.0
            }
        });
        let expected = svd.V() * solved;
        let size = expected.norm_max();
        for row in 0..rows {
            let off = (loops.multipliers[row] - expected[(row, 0)]).abs();
            assert!(
                off <= 1e-6 * size,
                "{closure:?}, row {row}: off by {:e}",
                off / size
            );
        }
        let change = &responses * &expected;
        let size = qdd.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for k in 0..dofs {
            let expected = free[k] + change[(k, 0)] * scales.acceleration[k];
            assert!((qdd[k] - expected).abs() <= 1e-7 * size, "{closure:?}: {k}");
        }
    }
}

/// The forces put on the bodies from outside make the same accelerations.
#[test]
fn loop_forces_are_forces() {
    for (seed, closure) in (0..).zip(closures()) {
        let model = closed_tree(closure, seed);
        let state = State::random(&model, seed);
        let mut forces = Forces::none(&model);
        let mut loops = Loops::of_model(&model).unwrap();
        let mut method = method(&model);
        method.solve(&model, &state, &forces).unwrap();
        let qdd = loops
            .constrain(&model, &state, &mut method)
            .unwrap()
            .to_vec();
        loops.act(&model, &mut method, &mut forces);
        let found = loops.forces(&model, &mut method);
        let again = method.solve(&model, &state, &forces).unwrap();
        let size = largest(&qdd);
        for (a, b) in qdd.iter().zip(again) {
            assert!((a - b).abs() <= 1e-7 * size, "{closure:?}: {a} or {b}");
        }
        assert_eq!((found.loops.len(), found.couplings.len()), (2, 0));
    }
}

/// Factors of the position before close a loop with more equations than matter, where each of these two pulls a little
/// on the other's: no new ones are needed.
#[test]
fn old_factors_close_redundant_loops() {
    let (model, start) = mechanism::bennett().unwrap();
    let mut state = start;
    state.qd = vec![2.0, -1.0, -2.0];
    let mut method = method(&model);
    let mut loops = Loops::of_model(&model).unwrap();
    let forces = Forces::none(&model);
    method.solve(&model, &state, &forces).unwrap();
    let qdd = loops
        .constrain(&model, &state, &mut method)
        .unwrap()
        .to_vec();
    for (qd, qdd) in state.qd.iter_mut().zip(&qdd) {
        *qd += 1e-3 * qdd;
    }
    for (q, qd) in state.q.iter_mut().zip(&state.qd) {
        *q += 1e-3 * qd;
    }
    assert!(loops.violation(&model, &state).position > 1e-8);
    assert_eq!(loops.close(&model, &mut state, &mut method, false), None);
    assert!(loops.violation(&model, &state).position <= 1e-13);
}
