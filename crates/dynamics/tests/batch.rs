//! A batch gives every state what it gets alone.

mod problems;

use problems::{problem, wrist};
use vertebra_assembly::{Model, ModelError, State};
use vertebra_dynamics::{Batch, Error, Forces, Precision, Workspace, aba, aba_batch};

const PRECISIONS: [Precision; 3] = [Precision::F32, Precision::F64, Precision::Reference];

fn singly(
    model: &Model,
    states: &[State],
    forces: &[Forces],
    precision: Precision,
) -> Vec<Result<Vec<f64>, Error>> {
    let mut workspace = Workspace::new(model, precision);
    let items = states.iter().zip(forces);
    items
        .map(|(state, forces)| aba(model, state, forces, &mut workspace).map(<[f64]>::to_vec))
        .collect()
}

/// Bit by bit, whatever the number of items leaves of the last lanes, and however many threads.
#[test]
fn every_item_has_the_bits_it_has_alone() {
    for (bodies, items, seed) in [(1, 1, 1), (3, 7, 2), (12, 8, 3), (20, 33, 4), (40, 100, 5)] {
        let (model, states, forces) = problem(bodies, items, seed);
        for precision in PRECISIONS {
            let alone = singly(&model, &states, &forces, precision);
            let alone: Vec<_> = alone.into_iter().map(Result::unwrap).collect();
            for threads in [1, 2, 0] {
                let mut batch = Batch::with_threads(&model, precision, threads);
                let qdd = aba_batch(&model, &states, &forces, &mut batch).unwrap();
                assert_eq!(
                    qdd,
                    alone.concat(),
                    "{bodies} bodies, {items} items, {precision}"
                );
                assert_eq!(batch.len(), items);
            }
        }
    }
}

/// Items that cannot be computed are named, with what a state alone would say, and the items that
/// share their lanes are not touched.
#[test]
fn bad_items_fail_alone() {
    let (model, mut states, mut forces) = problem(9, 21, 6);
    states[2].q[0] = f64::NAN;
    states[9].qd.pop();
    states[10].qd[1] = 1e300;
    forces[17].joint[0] = f64::INFINITY;
    for precision in PRECISIONS {
        let mut batch = Batch::new(&model, precision);
        let error = aba_batch(&model, &states, &forces, &mut batch).unwrap_err();
        let Error::Item {
            item,
            failed,
            count,
            source,
        } = error.clone()
        else {
            panic!("{error}");
        };
        assert_eq!((item, failed, count), (2, 4, 21));
        assert!(matches!(
            *source,
            Error::Model(ModelError::NonFinite { .. })
        ));
        assert!(error.to_string().contains("item 2 of the batch"), "{error}");
        let failures: Vec<_> = batch.failures().map(|(item, _)| item).collect();
        assert_eq!(failures, [2, 9, 10, 17]);
        for (item, alone) in singly(&model, &states, &forces, precision)
            .into_iter()
            .enumerate()
        {
            match (batch.joint_accelerations(item), alone) {
                (Ok(qdd), Ok(alone)) => assert_eq!(qdd, alone, "item {item}"),
                (Err(error), Err(alone)) => assert_eq!(error.to_string(), alone.to_string()),
                (found, alone) => panic!("item {item}: {found:?}, alone {alone:?}"),
            }
        }
        // The next call forgets them.
        let good = [0, 1, 3].map(|item| states[item].clone());
        let qdd = aba_batch(&model, &good, &forces[..3], &mut batch).unwrap();
        assert!(qdd.iter().all(|qdd| qdd.is_finite()));
        assert_eq!(batch.failures().count(), 0);
        let unknown = Error::UnknownItem { item: 3, count: 3 };
        assert_eq!(batch.joint_accelerations(3), Err(unknown));
    }
}

#[test]
fn a_singular_item_is_named() {
    let (model, states) = wrist(11, 6);
    let forces = vec![Forces::none(&model); states.len()];
    for precision in [Precision::F32, Precision::F64] {
        let mut batch = Batch::new(&model, precision);
        let error = aba_batch(&model, &states, &forces, &mut batch).unwrap_err();
        let Error::Item {
            item: 6,
            failed: 1,
            source,
            ..
        } = error
        else {
            panic!("{error}");
        };
        assert_eq!(
            *source,
            Error::SingularJoint {
                body: "first".to_owned()
            }
        );
        assert!(batch.joint_accelerations(5).is_ok());
    }
}

#[test]
fn lengths_and_models_must_fit() {
    let (model, states, forces) = problem(4, 5, 7);
    let mut batch = Batch::new(&model, Precision::F64);
    let lengths = Error::BatchLengths {
        states: 5,
        forces: 4,
    };
    assert_eq!(
        aba_batch(&model, &states, &forces[..4], &mut batch),
        Err(lengths)
    );
    let (other, ..) = problem(4, 5, 7);
    assert!(matches!(
        aba_batch(&other, &states, &forces, &mut batch),
        Err(Error::WrongWorkspace { .. })
    ));
    assert_eq!(aba_batch(&model, &[], &[], &mut batch), Ok(&[][..]));
    assert!(batch.is_empty());
}
