use super::*;
use crate::aba;
use vertebra_assembly::generate::{self, Rod};

/// The choice follows the number of threads and can be forced; results agree.
#[test]
fn many_threads_divide_and_conquer() {
    let model = generate::random_chain(20_000, &Rod::default(), 1).unwrap();
    let (state, forces) = (State::random(&model, 2), Forces::none(&model));
    let solve = |threads: usize, algorithm| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let options = SolverOptions {
                algorithm,
                ..SolverOptions::default()
            };
            let mut solver = Solver::new(&model, &options).unwrap();
            let qdd = solver
                .forward_dynamics(&model, &state, &forces)
                .unwrap()
                .to_vec();
            (*solver.choice(), qdd)
        })
    };
    let (one, reference) = solve(1, None);
    let (many, found) = solve(16, None);
    let (forced, same) = solve(16, Some(Algorithm::Aba));
    assert_eq!((one.algorithm, one.forced), (Algorithm::Aba, false));
    assert_eq!((many.algorithm, many.threads), (Algorithm::Dca, 16));
    assert_eq!((forced.algorithm, forced.forced), (Algorithm::Aba, true));
    assert!(
        many.dca_s < many.aba_s && many.to_string().contains("16 threads"),
        "{many}"
    );
    assert_eq!(reference, same);
    let largest = reference.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (a, b) in found.iter().zip(&reference) {
        assert!((a - b).abs() <= 1e5 * f64::EPSILON * largest);
    }
}

/// What divide and conquer refuses although it can be computed is computed, unless it was asked for.
#[test]
fn the_recursion_has_the_last_word() {
    let masses = generate::Masses::HeavyTips(1e12);
    let model = generate::uneven_tree(20_000, 3, &Rod::default(), &masses, 1).unwrap();
    let (state, forces) = (State::random(&model, 2), Forces::none(&model));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(16)
        .build()
        .unwrap();
    let solve = |algorithm| {
        pool.install(|| {
            let options = SolverOptions {
                algorithm,
                tree: Some(Precision::F32),
                schedule: Some(ScheduleOptions::with_window(2)),
                ..SolverOptions::default()
            };
            let mut solver = Solver::new(&model, &options).unwrap();
            assert_eq!(solver.choice().algorithm, Algorithm::Dca);
            let qdd = solver.forward_dynamics(&model, &state, &forces);
            qdd.map(<[f64]>::to_vec)
        })
    };
    let refused = solve(Some(Algorithm::Dca)).unwrap_err();
    assert!(matches!(refused, Error::Unjoined { .. }), "{refused}");
    let mut workspace = Workspace::new(&model, Precision::F64);
    let reference = aba(&model, &state, &forces, &mut workspace).unwrap();
    assert_eq!(solve(None).unwrap(), reference);
}

#[test]
fn a_tree_more_precise_than_its_chunks_is_refused() {
    let model = generate::random_chain(3, &Rod::default(), 1).unwrap();
    let options = SolverOptions {
        algorithm: Some(Algorithm::Dca),
        precision: Precision::F32,
        tree: Some(Precision::F64),
        ..SolverOptions::default()
    };
    assert!(matches!(
        Solver::new(&model, &options),
        Err(Error::TreePrecision { .. })
    ));
}
