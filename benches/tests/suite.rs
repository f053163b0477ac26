//! The shared suite, every check a test of its own.

#![expect(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a check that fails fails its test, and says by how much"
)]

use vertebra_bench::suite::{self, Outcome};

fn assert_passes(name: &str, outcome: Outcome) {
    let figures = outcome.unwrap_or_else(|error| panic!("{name}: {error:#}"));
    assert!(!figures.is_empty(), "{name} measured nothing");
    let worst = figures
        .iter()
        .max_by(|a, b| (a.value / a.bound).total_cmp(&(b.value / b.bound)))
        .expect("not empty");
    println!(
        "{name}: worst {} = {:e} of {:e}",
        worst.name, worst.value, worst.bound
    );
    for figure in &figures {
        assert!(
            figure.passes(),
            "{name}: {} is {:e}, bound {:e}",
            figure.name,
            figure.value,
            figure.bound
        );
    }
}

fn dynamics(name: &str) {
    let check = suite::DYNAMICS
        .iter()
        .find(|check| check.name == name)
        .expect("known check");
    for solver in suite::solver::all() {
        if (check.applies)(solver.as_ref()) {
            let label = format!("{name} {} {}", solver.method(), solver.precision());
            assert_passes(&label, (check.run)(solver.as_ref()));
        }
    }
}

fn other(name: &str) {
    let (_, check) = suite::OTHERS
        .iter()
        .find(|(n, _)| *n == name)
        .expect("known check");
    assert_passes(name, check());
}

macro_rules! suite_tests {
    ($names:ident, $runner:ident: $($name:ident),*) => {
        const $names: &[&str] = &[$(stringify!($name)),*];
        $(#[test]
        fn $name() {
            $runner(stringify!($name));
        })*
    };
}

suite_tests!(DYNAMICS_TESTS, dynamics: gold_chains, gold_robots, gold_urdf, joint_torque_residual, own_equations, same_bits);
suite_tests!(OTHER_TESTS, other: robot_quantities, urdf_quantities, aba_against_crba, forward_errors, mesh_pairs, loop_violations, loaded_mechanisms, no_nan);

/// No check of the library is forgotten above.
#[test]
fn every_check_is_a_test() {
    let dynamics = suite::DYNAMICS.iter().map(|check| check.name);
    let others = suite::OTHERS.iter().map(|(name, _)| *name);
    assert!(dynamics.eq(DYNAMICS_TESTS.iter().copied()));
    assert!(others.eq(OTHER_TESTS.iter().copied()));
}
