//! Loops in batches.

use crate::remote::device;
use crate::{largest, off};
use vertebra_assembly::mechanism;
use vertebra_dynamics::gpu::{Batch, BatchOptions};
use vertebra_dynamics::{Algorithm, Error, Precision, Simulation};

/// Items of a batch are each a mechanism of its own; one that is open is named.
#[test]
fn batches_keep_loops_closed() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::bennett().unwrap();
    let mut states = vec![state; 5];
    for (item, state) in states.iter_mut().enumerate() {
        state.qd.iter_mut().for_each(|rate| *rate *= item as f64);
    }
    let options = BatchOptions {
        precision: Precision::F64,
        ..BatchOptions::default()
    };
    let mut batch = Batch::new(&device, &model, states.len(), &options).unwrap();
    assert_eq!(batch.choice().algorithm, Algorithm::Dca);
    batch.set_states(&states).unwrap();
    let solved = batch.solve().unwrap();
    batch.steps(1e-3, 20).unwrap();
    let dofs = model.dof_count();
    for (item, found) in batch.states().unwrap().iter().enumerate() {
        let mut alone = Simulation::new(model.clone()).unwrap();
        alone.set_state(states[item].clone()).unwrap();
        let qdd = alone.accelerations().unwrap();
        let off_by = off(&solved[item * dofs..], &qdd);
        assert!(off_by <= 1e-11 * largest(&qdd), "{item}: {off_by:e}");
        alone.steps(1e-3, 20).unwrap();
        let rates = &alone.state().unwrap().qd;
        let off_by = off(&found.qd, rates);
        assert!(
            off_by <= 1e-11 * largest(rates).max(1.0),
            "{item}: {off_by:e}"
        );
    }
    states[3].q[1] += 0.3;
    batch.set_states(&states).unwrap();
    let error = batch.step(1e-3).unwrap_err();
    assert!(
        matches!(&error, Error::Item { item: 3, source, .. }
            if matches!(&**source, Error::LoopOpen { name, .. } if *name == model.loops()[0].name)),
        "{error}"
    );
    let options = BatchOptions {
        algorithm: Some(Algorithm::Aba),
        ..options
    };
    let refused = Batch::new(&device, &model, 5, &options).err();
    assert!(
        matches!(refused, Some(Error::LoopsUnavailable { .. })),
        "{refused:?}"
    );
}
