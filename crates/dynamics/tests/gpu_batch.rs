//! A batch on a GPU gives every item what the CPU gives it.

#![cfg(feature = "gpu")]
#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

mod problems;

use glam::DVec3;
use problems::{problem, wrist};
use vertebra_assembly::{BodyId, ModelError, State, generate};
use vertebra_dynamics::gpu::{Batch, BatchOptions};
use vertebra_dynamics::{
    Algorithm, Error, Forces, Integrator, Precision, Simulation, Workspace, Wrench, aba,
    forward_error, forward_kinematics,
};
use vertebra_gpu::wgpu::{Features, Limits};
use vertebra_gpu::{Device, Options, tests_are_left_out};

fn device() -> Option<Device> {
    (!tests_are_left_out()).then(|| Device::auto().unwrap())
}

fn precisions(device: &Device) -> Vec<Precision> {
    let mut list = vec![Precision::F32];
    if device.features().contains(Features::SHADER_F64) {
        list.push(Precision::F64);
    }
    list
}

fn options(precision: Precision, lanes: u32) -> BatchOptions {
    BatchOptions {
        precision,
        lanes: Some(lanes),
        ..BatchOptions::default()
    }
}

/// The error against the reference is that of the CPU's recursion, which tells the condition, times some
/// tens, or rounding of as many bodies.
#[test]
fn accelerations_are_those_of_the_reference() {
    let Some(device) = device() else { return };
    let problems = [(1, 3, 2, 8), (3, 33, 3, 2), (12, 100, 4, 4), (25, 3, 7, 1)];
    for (bodies, items, seed, lanes) in problems {
        let (model, states, forces) = problem(bodies, items, seed);
        for precision in precisions(&device) {
            let mut batch = Batch::new(&device, &model, items, &options(precision, lanes)).unwrap();
            batch.set_states(&states).unwrap();
            batch.set_forces(&forces).unwrap();
            let qdd = batch.solve().unwrap();
            let dofs = model.dof_count();
            assert_eq!(qdd.len(), items * dofs);
            let mut reference = Workspace::new(&model, Precision::Reference);
            let mut same = Workspace::new(&model, precision);
            for item in 0..items {
                aba(&model, &states[item], &forces[item], &mut reference).unwrap();
                let cpu = aba(&model, &states[item], &forces[item], &mut same).unwrap();
                let cpu = forward_error(cpu, &reference).unwrap();
                let found = &qdd[item * dofs..(item + 1) * dofs];
                let error = forward_error(found, &reference).unwrap();
                let bound = 30.0 * cpu + 20.0 * bodies as f64 * precision.epsilon();
                assert!(
                    error <= bound,
                    "{bodies} bodies, item {item}, {precision}: {error:e}, bound {bound:e}"
                );
            }
        }
    }
}

/// Whatever stands beside it, and each time.
#[test]
fn every_item_has_the_bits_it_has_alone() {
    let Some(device) = device() else { return };
    let (model, states, forces) = problem(9, 70, 11);
    let solve = |items: core::ops::Range<usize>| {
        let mut batch =
            Batch::new(&device, &model, items.len(), &options(Precision::F32, 2)).unwrap();
        // All forces first, so that the same kernels run.
        batch.set_forces(&forces[..items.len()]).unwrap();
        batch.set_states(&states[items.clone()]).unwrap();
        batch.set_forces(&forces[items]).unwrap();
        let once = batch.solve().unwrap();
        assert_eq!(batch.solve().unwrap(), once);
        batch.steps(1e-3, 3).unwrap();
        (once, batch.states().unwrap())
    };
    let (all, moved) = solve(0..70);
    let (some, moved_some) = solve(30..67);
    assert_eq!(all[30 * model.dof_count()..67 * model.dof_count()], some);
    for (a, b) in moved[30..67].iter().zip(&moved_some) {
        assert_eq!((&a.q, &a.qd), (&b.q, &b.qd));
    }
}

/// Several steps stay near the CPU's, for both integrators; and poses are those of the state reached.
#[test]
fn steps_and_poses_follow_the_host() {
    let Some(device) = device() else { return };
    let problems = [(7, 21, 4), (6, 22, 1)];
    for (precision, (bodies, seed, lanes)) in precisions(&device).into_iter().zip(problems) {
        let (model, states, forces) = problem(bodies, 5, seed);
        for integrator in [Integrator::SemiImplicitEuler, Integrator::RungeKutta4] {
            let mut batch = Batch::new(
                &device,
                &model,
                5,
                &BatchOptions {
                    integrator,
                    ..options(precision, lanes)
                },
            )
            .unwrap();
            batch.set_forces(&forces).unwrap();
            batch.set_states(&states).unwrap();
            batch.steps(1e-4, 4).unwrap();
            batch.step(2e-4).unwrap();
            let found = batch.states().unwrap();
            let poses = batch.poses().unwrap();
            for item in 0..5 {
                let mut cpu = Simulation::new(model.clone())
                    .unwrap()
                    .with_integrator(integrator);
                cpu.set_state(states[item].clone()).unwrap();
                *cpu.forces_mut() = forces[item].clone();
                let mut largest = 0.0_f64;
                for h in [1e-4, 1e-4, 1e-4, 1e-4, 2e-4] {
                    let qdd = cpu.solve().unwrap().joint_accelerations().unwrap().to_vec();
                    largest = qdd.iter().fold(largest, |m, x| m.max(x.abs()));
                    cpu.step(h).unwrap();
                }
                let state = cpu.state().unwrap();
                // Errors of accelerations act for the time of all steps; positions are rounded.
                let size = |v: &[f64]| v.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                let scale = 6e-4 * largest + size(&state.q) + size(&state.qd);
                let bound = 1e3 * bodies as f64 * precision.epsilon() * scale;
                let pairs = |a: &[f64], b: &[f64]| {
                    a.iter()
                        .zip(b)
                        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
                };
                let error = pairs(&found[item].q, &state.q).max(pairs(&found[item].qd, &state.qd));
                assert!(
                    error <= bound,
                    "{precision}, {integrator:?}: {error:e} > {bound:e}"
                );
                assert!((found[item].time - state.time).abs() < 1e-12);
                let mut workspace = Workspace::new(&model, Precision::F64);
                forward_kinematics(&model, &found[item], &mut workspace).unwrap();
                for (body, pose) in model
                    .body_ids()
                    .zip(&poses[item * bodies..(item + 1) * bodies])
                {
                    let exact = workspace.pose(body).unwrap();
                    let off = (exact.translation - pose.translation).length()
                        / (1.0 + exact.translation.length());
                    let turned = 1.0 - exact.rotation.dot(pose.rotation).abs();
                    let bound = 50.0 * bodies as f64 * precision.epsilon();
                    assert!(off <= bound && turned <= bound, "{off:e}, {turned:e}");
                }
            }
        }
    }
}

#[test]
fn a_singular_item_is_named_and_stands_still() {
    let Some(device) = device() else { return };
    let (model, mut states) = wrist(40, 36);
    for state in &mut states {
        state.qd = vec![0.5, 0.0, 0.0, 0.25];
        state.time = 5.0;
    }
    for precision in precisions(&device) {
        let mut batch = Batch::new(&device, &model, states.len(), &options(precision, 1)).unwrap();
        batch.set_states(&states).unwrap();
        let singular = Error::Item {
            item: 36,
            failed: 1,
            count: 40,
            source: Box::new(Error::SingularJoint {
                body: "first".to_owned(),
            }),
        };
        assert_eq!(batch.solve().unwrap_err(), singular);
        for (item, one) in batch
            .accelerations_of_each()
            .unwrap()
            .into_iter()
            .enumerate()
        {
            assert_eq!(one.is_err(), item == 36);
            assert!(one.is_ok_and(|qdd| qdd.iter().all(|x| x.is_finite())) || item == 36);
        }
        assert_eq!(batch.steps(1e-3, 3).unwrap_err(), singular);
        let moved = batch.states().unwrap();
        let expected = &states[36];
        assert_eq!(
            (&moved[36].q, &moved[36].qd, moved[36].time),
            (&expected.q, &expected.qd, 5.0)
        );
        assert!(moved[35].q != states[35].q && (moved[35].time - 5.003).abs() < 1e-12);
        // States that are set anew have not failed.
        batch.set_states(&vec![states[0].clone(); 40]).unwrap();
        batch.steps(1e-3, 3).unwrap();
    }
}

/// A rate near the end of the range: the step before is kept, the others go on.
#[test]
fn an_overflow_names_body_and_time() {
    let Some(device) = device() else { return };
    let model = generate::random_chain(5, &generate::Rod::default(), 3).unwrap();
    let mut states: Vec<_> = (0..34).map(|seed| State::random(&model, seed)).collect();
    states[33].qd[2] = 1e25;
    let mut batch = Batch::new(&device, &model, 34, &options(Precision::F32, 1)).unwrap();
    batch.set_states(&states).unwrap();
    let error = batch.steps(1e-3, 2).unwrap_err();
    let Error::Item {
        item: 33,
        failed: 1,
        source,
        ..
    } = &error
    else {
        panic!("{error}");
    };
    assert!(
        matches!(**source, Error::Overflow { time: 0.0, .. }),
        "{error}"
    );
    let moved = batch.states().unwrap();
    assert_eq!(moved[33].q.len(), 5);
    assert!(moved[33].qd[2] > 0.9e25);
    assert!(
        moved
            .iter()
            .all(|s| s.q.iter().chain(&s.qd).all(|x| x.is_finite()))
    );
    assert_ne!(moved[32].q, states[32].q);
}

#[test]
fn bad_input_leaves_everything_as_it_was() {
    let Some(device) = device() else { return };
    let (model, mut states, mut forces) = problem(4, 6, 2);
    let mut batch = Batch::new(&device, &model, 6, &options(Precision::F32, 1)).unwrap();
    batch.set_states(&states).unwrap();
    batch.set_forces(&forces).unwrap();
    let before = (batch.states().unwrap(), batch.solve().unwrap());
    states[4].q[0] = f64::NAN;
    let Error::Item {
        item: 4, source, ..
    } = batch.set_states(&states).unwrap_err()
    else {
        panic!("not refused");
    };
    assert!(matches!(
        *source,
        Error::Model(ModelError::NonFinite { .. })
    ));
    forces[2].joint[0] = f64::INFINITY;
    assert!(matches!(
        batch.set_forces(&forces).unwrap_err(),
        Error::Item { item: 2, .. }
    ));
    assert!(matches!(
        batch.set_states(&states[..3]).unwrap_err(),
        Error::ItemCount {
            expected: 6,
            given: 3
        }
    ));
    assert!(matches!(
        batch.steps(f64::NAN, 1).unwrap_err(),
        Error::NonFiniteInput { .. }
    ));
    assert_eq!((batch.states().unwrap(), batch.solve().unwrap()), before);
}

#[test]
fn what_the_device_lacks_is_named() {
    let (model, ..) = problem(4, 1, 2);
    let plain = Device::open(Options {
        wanted: Features::empty(),
        ..Options::default()
    })
    .unwrap();
    let new = |device: &Device, items, precision| {
        Batch::new(device, &model, items, &options(precision, 1))
            .err()
            .unwrap()
    };
    for precision in [Precision::F64, Precision::Reference] {
        let error = new(&plain, 1, precision);
        assert!(
            matches!(error, Error::PrecisionUnavailable { precision: p, .. } if p == precision),
            "{error}"
        );
    }
    let small = Device::open(Options {
        limits: Limits {
            max_storage_buffer_binding_size: 1 << 20,
            max_storage_buffers_per_shader_stage: 8,
            ..Limits::downlevel_defaults()
        },
        exact_limits: true,
        ..Options::default()
    })
    .unwrap();
    let error = new(&small, 100_000, Precision::F32);
    let Error::BatchTooLarge {
        fit,
        limit: "max_storage_buffer_binding_size",
        ..
    } = error
    else {
        panic!("{error}");
    };
    assert!(fit > 1000 && fit % 32 == 0);
    Batch::new(&small, &model, fit, &options(Precision::F32, 1)).unwrap();
    assert!(matches!(
        new(&small, fit + 1, Precision::F32),
        Error::BatchTooLarge { .. }
    ));
}

/// Forces on bodies that had none take other kernels and buffers, and nothing else changes.
#[test]
fn new_forces_act_on_the_state_reached() {
    let Some(device) = device() else { return };
    let (model, mut states, forces) = problem(5, 8, 3);
    states[7].qd[0] = 1e25;
    let mut batch = Batch::new(&device, &model, 8, &options(Precision::F32, 2)).unwrap();
    batch.set_states(&states).unwrap();
    let failed = batch.steps(1e-3, 2).unwrap_err();
    let before = batch.states().unwrap();
    batch.solve_on_device().unwrap();
    let solved = batch.accelerations_of_each().unwrap();
    assert!(solved[0].as_ref().unwrap().iter().any(|a| *a != 0.0));
    batch.set_forces(&forces).unwrap();
    assert_eq!(batch.states().unwrap(), before);
    assert_eq!(batch.accelerations_of_each().unwrap(), solved);
    assert_eq!(batch.steps(1e-3, 1).unwrap_err(), failed);
    let mut alone = Batch::new(&device, &model, 8, &options(Precision::F32, 2)).unwrap();
    alone.set_forces(&forces).unwrap();
    alone.set_states(&before).unwrap();
    alone.steps_on_device(1e-3, 1).unwrap();
    let (after, expected) = (batch.states().unwrap(), alone.states().unwrap());
    for item in 0..7 {
        assert_eq!(after[item].q, expected[item].q);
        assert_ne!(after[item].q, before[item].q);
    }
    assert_eq!(after[7], before[7]);
}

/// Few long chains go by divide and conquer, as a forest: the same verbs, the same answers.
#[test]
fn few_long_items_are_divided_and_conquered() {
    let Some(device) = device() else { return };
    let model = generate::random_chain(300, &generate::Rod::default(), 3).unwrap();
    let states: Vec<_> = (0..3).map(|seed| State::random(&model, seed)).collect();
    let mut forces = vec![Forces::none(&model); 3];
    forces[1].push(model.last_body(), Wrench::at_center([3.0, -1.0, 2.0]));
    forces[2]
        .set_gravity(&model, BodyId(0), DVec3::new(1.0, 2.0, 3.0))
        .unwrap();
    for precision in precisions(&device) {
        let chosen = BatchOptions {
            precision,
            ..BatchOptions::default()
        };
        let mut batch = Batch::new(&device, &model, 3, &chosen).unwrap();
        let choice = *batch.choice();
        assert_eq!((choice.algorithm, choice.forced), (Algorithm::Dca, false));
        assert!(
            choice
                .to_string()
                .starts_with("dca over all items, expected"),
            "{choice}"
        );
        batch.set_states(&states).unwrap();
        batch.set_forces(&forces).unwrap();
        let found = batch.solve().unwrap();
        let mut reference = Workspace::new(&model, Precision::Reference);
        for item in 0..3 {
            aba(&model, &states[item], &forces[item], &mut reference).unwrap();
            let error = forward_error(&found[300 * item..300 * (item + 1)], &reference).unwrap();
            assert!(error <= 1e5 * precision.epsilon(), "{precision}: {error:e}");
        }
        let each = batch.accelerations_of_each().unwrap();
        assert!(
            each.iter()
                .zip(found.chunks(300))
                .all(|(a, b)| a.as_deref() == Ok(b))
        );
        batch.steps(1e-5, 5).unwrap();
        let (moved, poses) = (batch.states().unwrap(), batch.poses().unwrap());
        for item in 0..3 {
            let mut cpu = Simulation::new(model.clone()).unwrap();
            cpu.set_state(states[item].clone()).unwrap();
            *cpu.forces_mut() = forces[item].clone();
            cpu.steps(1e-5, 5).unwrap();
            let tip = cpu.pose(model.last_body()).unwrap().translation;
            let off = (poses[300 * item + 299].translation - tip).length();
            assert!(off <= 300.0 * 100.0 * precision.epsilon(), "{off:e}");
            assert!((moved[item].time - 5e-5).abs() < 1e-15);
            assert_eq!(batch.pose_place(item, BodyId(299)), 300 * item + 299);
        }
    }
    // Forced, it is the recursion.
    let recursion = BatchOptions {
        algorithm: Some(Algorithm::Aba),
        precision: Precision::F32,
        ..BatchOptions::default()
    };
    let batch = Batch::new(&device, &model, 3, &recursion).unwrap();
    assert_eq!(
        (batch.choice().algorithm, batch.choice().forced),
        (Algorithm::Aba, true)
    );
    // Robots are for the recursion by themselves.
    let (robot, ..) = problem(9, 1, 2);
    let many = Batch::new(&device, &robot, 500, &options(Precision::F32, 1)).unwrap();
    assert_eq!(many.choice().algorithm, Algorithm::Aba);
}

/// By divide and conquer all items stop with the one that fails, which is named with its own body.
#[test]
fn a_failing_item_stops_the_forest() {
    let Some(device) = device() else { return };
    let model = generate::random_chain(300, &generate::Rod::default(), 3).unwrap();
    let mut states: Vec<_> = (0..3).map(|seed| State::random(&model, seed)).collect();
    let good = states.clone();
    states[1].qd[200] = 1e30;
    let conquer = BatchOptions {
        precision: Precision::F32,
        algorithm: Some(Algorithm::Dca),
        ..BatchOptions::default()
    };
    let mut batch = Batch::new(&device, &model, 3, &conquer).unwrap();
    batch.set_states(&states).unwrap();
    let error = batch.steps(1e-3, 4).unwrap_err();
    let Error::Item {
        item: 1, source, ..
    } = &error
    else {
        panic!("{error}");
    };
    let Error::Overflow {
        body, time: 0.0, ..
    } = &**source
    else {
        panic!("{error}");
    };
    assert!(model.find(body).is_some(), "{body}");
    let kept = batch.states().unwrap();
    assert_eq!(kept[0].time, 0.0);
    assert!((kept[1].qd[200] - 1e30).abs() < 1e24 && kept[2].q.len() == 300);
    assert!(batch.solve().is_err());
    let each = batch.accelerations_of_each().unwrap();
    assert!(each.iter().all(Result::is_err));
    batch.set_states(&good).unwrap();
    batch.steps(1e-5, 4).unwrap();
    assert!(batch.failures().unwrap().is_empty());
}
