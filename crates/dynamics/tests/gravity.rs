//! Gravity of its own for an articulation of a forest: as if the model had it.

#![expect(clippy::unwrap_used, reason = "a failure is the test's")]

use glam::DVec3;
use vertebra_assembly::generate::{self, RandomTree};
use vertebra_assembly::{BodyId, Model, State};
use vertebra_dynamics::{
    Batch, DcaOptions, DcaWorkspace, Error, Forces, Precision, Workspace, aba, aba_batch, crba,
    crba_forward_dynamics, dca, joint_wrenches, residual, rnea,
};

const MOON: DVec3 = DVec3::new(0.4, -0.3, -1.62);

/// Three trees side by side, the second under its own gravity; and the same under that gravity
/// throughout, which for the second must be the same.
fn forests(seed: u64) -> (Model, Model, Forces, core::ops::Range<usize>) {
    let tree = RandomTree {
        articulations: 3,
        floating: seed.is_multiple_of(2),
        ..RandomTree::mixed(21)
    };
    let model = generate::random_tree(&tree, seed).unwrap();
    let mut description = model.describe();
    description.gravity = MOON;
    let everywhere = description.build().unwrap();
    let mut forces = Forces::none(&model);
    forces
        .set_gravity(&model, BodyId(7), [9.0, 9.0, 9.0])
        .unwrap();
    // The last word counts.
    forces.set_gravity(&model, BodyId(7), MOON).unwrap();
    let dofs = model.bodies()[7].dof_start..model.bodies()[14].dof_start;
    (model, everywhere, forces, dofs)
}

/// By the second gravity in the second tree, by the first elsewhere, in every algorithm.
#[test]
fn an_articulation_moves_as_if_the_model_had_its_gravity() {
    for seed in 0..6 {
        let (model, everywhere, forces, second) = forests(seed);
        let state = State::random(&model, seed);
        let none = Forces::none(&model);
        let solve = |model: &Model| {
            let mut workspace = Workspace::new(model, Precision::Reference);
            aba(model, &state, &none, &mut workspace).unwrap().to_vec()
        };
        let (mut expected, moon) = (solve(&model), solve(&everywhere));
        expected[second.clone()].copy_from_slice(&moon[second]);
        let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let close = |found: &[f64], what: &str| {
            for (a, b) in found.iter().zip(&expected) {
                let bound = 1e6 * f64::EPSILON * largest;
                assert!((a - b).abs() <= bound, "{what}, seed {seed}: {a} {b}");
            }
        };
        let mut workspace = Workspace::new(&model, Precision::F64);
        let qdd = aba(&model, &state, &forces, &mut workspace)
            .unwrap()
            .to_vec();
        close(&qdd, "aba");
        joint_wrenches(&mut workspace).unwrap();
        assert!(residual(&model, &state, &forces, &workspace).unwrap().max() < 1e-11);
        let tau = rnea(&model, &state, &qdd, &forces, &mut workspace).unwrap();
        assert!(tau.iter().all(|x| x.abs() < 1e-8 * largest));
        let mut tree = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
        close(dca(&model, &state, &forces, &mut tree).unwrap(), "dca");
        crba(&model, &state, &mut workspace).unwrap();
        let dense = crba_forward_dynamics(&model, &state, &forces, &mut workspace);
        close(&dense.unwrap(), "crba");
        let mut batch = Batch::new(&model, Precision::F64);
        let states = vec![state.clone(); 3];
        let found = aba_batch(&model, &states, &vec![forces.clone(); 3], &mut batch).unwrap();
        close(&found[2 * model.dof_count()..], "batch");
    }
}

#[test]
fn gravity_is_that_of_a_root() {
    let (model, _, mut forces, _) = forests(0);
    let before = forces.clone();
    let child = model.bodies().iter().position(|body| body.parent.is_some());
    let child = BodyId(u32::try_from(child.unwrap()).unwrap());
    let error = forces.set_gravity(&model, child, MOON).unwrap_err();
    assert!(
        matches!(&error, Error::NotARoot { root, .. } if root == "body-0"),
        "{error}"
    );
    let error = forces.set_gravity(&model, BodyId(99), MOON);
    assert!(matches!(error, Err(Error::UnknownBody { body: 99, .. })));
    let error = forces.set_gravity(&model, BodyId(0), DVec3::NAN);
    assert!(matches!(
        error,
        Err(Error::NonFiniteInput {
            quantity: "gravity",
            ..
        })
    ));
    assert_eq!(forces, before);
    // The model's own takes it back, and forces on bodies come and go beside it.
    forces.clear_external();
    assert_eq!(forces, before);
    forces
        .set_gravity(&model, BodyId(7), model.gravity())
        .unwrap();
    assert_eq!(forces, Forces::none(&model));
}
