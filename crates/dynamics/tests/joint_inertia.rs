//! Inertia of the freedoms' own in every algorithm, on mechanisms of every kind of joint.

use vertebra_assembly::{Model, Random, State, generate};
use vertebra_dynamics::{
    Batch, DcaOptions, DcaWorkspace, Derivatives, Forces, Precision, Workspace, aba, aba_batch,
    crba, crba_forward_dynamics, dca, forward_error, joint_wrenches, refine, residual,
    rnea_derivatives,
};

/// Rotors over six decades in two freedoms of three.
fn forces(model: &Model, seed: u64) -> Forces {
    let mut random = Random::new(seed);
    let mut forces = Forces::none(model);
    forces.joint.fill_with(|| random.symmetric());
    let own = |_| match random.below(3) {
        0 => 0.0,
        _ => 1e-3 * 1e6_f64.powf(random.unit()),
    };
    forces.joint_inertia = (0..model.dof_count()).map(own).collect();
    forces
}

/// The dense solution, within eps n cond(M + E), and the reference of the recursion.
#[test]
fn all_algorithms_agree() {
    for (seed, count) in (0..24).zip([1, 4, 20].into_iter().cycle()) {
        let model = generate::random_mechanism(count, false, seed).unwrap();
        let (state, forces) = (State::random(&model, seed), forces(&model, seed));
        let n = model.dof_count();
        if n == 0 {
            continue;
        }
        let mut reference = Workspace::new(&model, Precision::Reference);
        aba(&model, &state, &forces, &mut reference).unwrap();
        let mut workspace = Workspace::new(&model, Precision::F64);
        let mut mass = crba(&model, &state, &mut workspace).unwrap().to_owned();
        for (dof, own) in forces.joint_inertia.iter().enumerate() {
            mass[(dof, dof)] += own;
        }
        let values = mass.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(0.0, f64::max);
        let bound = 8.0 * f64::EPSILON * n as f64 * (most / least);
        let check = |qdd: &[f64], bound: f64, what: &str| {
            let off = forward_error(qdd, &reference).unwrap();
            assert!(off <= bound, "{what}, seed {seed}: {off:e} > {bound:e}");
        };
        let dense = crba_forward_dynamics(&model, &state, &forces, &mut workspace).unwrap();
        check(&dense, bound, "dense");
        let qdd = aba(&model, &state, &forces, &mut workspace)
            .unwrap()
            .to_vec();
        check(&qdd, bound, "recursion");
        let mut tree = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
        check(
            dca(&model, &state, &forces, &mut tree).unwrap(),
            bound,
            "tree",
        );
        let mixed = DcaOptions {
            tree: Precision::F32,
            ..DcaOptions::default()
        };
        let mut tree = DcaWorkspace::new(&model, &mixed).unwrap();
        dca(&model, &state, &forces, &mut tree).unwrap();
        for _ in 0..2 {
            refine(&forces, &mut tree).unwrap();
        }
        check(
            tree.joint_accelerations().unwrap(),
            bound.max(1e-13),
            "refined tree",
        );
        aba(&model, &state, &forces, &mut workspace).unwrap();
        refine(&forces, &mut workspace).unwrap();
        check(
            workspace.joint_accelerations().unwrap(),
            bound,
            "refined recursion",
        );
        // Side by side with others that have none, every one gets the bits it has alone.
        let mut batch = Batch::with_threads(&model, Precision::F64, 1);
        let none = Forces::none(&model);
        let (states, all) = (
            vec![state.clone(); 3],
            [forces.clone(), none.clone(), forces.clone()],
        );
        let together = aba_batch(&model, &states, &all, &mut batch).unwrap();
        assert_eq!((&together[..n], &together[2 * n..]), (&qdd[..], &qdd[..]));
        let alone = aba(&model, &state, &none, &mut workspace).unwrap();
        assert_eq!(&together[n..2 * n], alone);
    }
}

/// Residuals of the bodies' own equations stay at rounding, whatever the size. Body by body: between the
/// joints of a compound one there is no mass, and rows that are rounding alone.
#[test]
fn the_equations_of_the_bodies_hold() {
    for count in [2, 17, 300, 3000] {
        for seed in 0..3 {
            let model = generate::random_mechanism(count, false, seed).unwrap();
            let (state, forces) = (State::random(&model, seed), forces(&model, seed));
            let bound = 64.0 * f64::EPSILON * model.depth() as f64;
            let mut workspace = Workspace::new(&model, Precision::F64);
            aba(&model, &state, &forces, &mut workspace).unwrap();
            joint_wrenches(&mut workspace).unwrap();
            let found = residual(&model, &state, &forces, &workspace).unwrap();
            assert!(
                found.by_body <= bound,
                "{count} by recursion, seed {seed}: {found:?}"
            );
            let mut tree = DcaWorkspace::new(&model, &DcaOptions::default()).unwrap();
            dca(&model, &state, &forces, &mut tree).unwrap();
            tree.compute_joint_wrenches(&forces).unwrap();
            let found = residual(&model, &state, &forces, &tree).unwrap();
            assert!(
                found.by_body <= bound,
                "{count} by tree, seed {seed}: {found:?}"
            );
        }
    }
}

/// By accelerations, inverse dynamics has the derivative M + E.
#[test]
fn derivatives_have_it() {
    let model = generate::random_mechanism(12, false, 3).unwrap();
    let (state, forces) = (State::random(&model, 3), forces(&model, 3));
    let mut workspace = Workspace::new(&model, Precision::F64);
    let mut mass = crba(&model, &state, &mut workspace).unwrap().to_owned();
    for (dof, own) in forces.joint_inertia.iter().enumerate() {
        mass[(dof, dof)] += own;
    }
    let still = vec![0.0; model.dof_count()];
    let mut found = Derivatives::new(&model);
    rnea_derivatives(&model, &state, &still, &forces, &mut workspace, &mut found).unwrap();
    let off = (&found.drive - &mass).norm_max();
    assert!(off <= 1e-12 * mass.norm_max(), "{off:e}");
}
