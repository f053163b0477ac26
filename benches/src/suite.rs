//! The test suite that every solver and backend passes: a library, so that `cargo test` and the
//! standalone `vertebra-bench selftest` run the same checks.
//!
//! A check measures figures and holds each against a bound that is a formula of the precision, the
//! size and the condition. Adding a backend means adding a [`solver::Solver`] to
//! [`solver::all`] and nothing else.

pub mod driven;
pub mod gold_chains;
pub mod gold_meshes;
pub mod gold_robots;
pub mod gold_urdf;
pub mod gpu;
pub mod loops;
pub mod seeds;
pub mod solver;
pub mod trees;

use solver::Solver;

/// One measured quantity and what it may be at most.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What was measured, and on what.
    pub name: String,
    /// The value measured.
    pub value: f64,
    /// The largest value that passes.
    pub bound: f64,
}

impl Figure {
    /// Names a value and its bound.
    #[must_use]
    pub fn new(name: impl Into<String>, value: f64, bound: f64) -> Self {
        Self {
            name: name.into(),
            value,
            bound,
        }
    }

    /// Whether the value keeps its bound; NaN does not.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.value <= self.bound
    }
}

/// What a check found: its figures, or why it could not be run through.
pub type Outcome = anyhow::Result<Vec<Figure>>;

/// A check of the dynamics, run with every solver.
pub struct DynamicsCheck {
    /// Name of the check.
    pub name: &'static str,
    /// Measures the figures.
    pub run: fn(&dyn Solver) -> Outcome,
    /// Whether a solver can be asked.
    pub applies: fn(&dyn Solver) -> bool,
}

/// A check that no solver takes part in.
pub type Check = fn() -> Outcome;

/// The checks that every solver they apply to passes.
pub const DYNAMICS: &[DynamicsCheck] = &[
    DynamicsCheck {
        name: "gold_chains",
        run: gold_chains::joint_accelerations,
        applies: |_| true,
    },
    DynamicsCheck {
        name: "gold_robots",
        run: gold_robots::joint_accelerations,
        applies: |_| true,
    },
    DynamicsCheck {
        name: "gold_urdf",
        run: gold_urdf::joint_accelerations,
        // Masses over seven decades leave single precision nothing to compare.
        applies: |solver| solver.precision() != vertebra::Precision::F32,
    },
    DynamicsCheck {
        name: "joint_torque_residual",
        run: trees::joint_torque_residual,
        applies: |_| true,
    },
    DynamicsCheck {
        name: "own_equations",
        run: trees::own_equations,
        applies: |solver| solver.keeps_body_forces(),
    },
    DynamicsCheck {
        name: "same_bits",
        run: trees::same_bits,
        applies: |_| true,
    },
];

/// The other checks, by name.
pub const OTHERS: &[(&str, Check)] = &[
    ("robot_quantities", gold_robots::quantities),
    ("urdf_quantities", gold_urdf::quantities),
    ("aba_against_crba", trees::aba_against_crba),
    ("forward_errors", seeds::forward_errors),
    ("mesh_pairs", gold_meshes::pairs),
    ("loop_violations", loops::violations),
    ("loaded_mechanisms", driven::loaded),
    ("no_nan", crate::fuzz::no_nan),
];

/// Checks that take minutes, by name: run where they are asked for.
pub const LONG: &[(&str, Check)] = &[("long_loop_violations", loops::violations_of_long_runs)];

/// The larger of two errors; NaN, which `f64::max` would drop, is the worst.
#[must_use]
pub fn worst_of(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// Largest difference between two vectors over the largest entry of the second.
#[must_use]
pub fn relative_error(found: &[f64], reference: &[f64]) -> f64 {
    if found.len() != reference.len() {
        return f64::INFINITY;
    }
    let largest = reference.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let difference = found
        .iter()
        .zip(reference)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, worst_of);
    if difference == 0.0 {
        0.0
    } else {
        difference / largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A solver that returns NaN must not pass.
    #[test]
    fn nan_is_the_worst_error() {
        assert!(worst_of(f64::NAN, 1.0).is_nan() && worst_of(1.0, f64::NAN).is_nan());
        assert_eq!((worst_of(1.0, 2.0), worst_of(2.0, 1.0)), (2.0, 2.0));
        let figure = |value| Figure::new("figure", value, 1.0);
        assert!(!figure(relative_error(&[f64::NAN, 1.0], &[1.0, 1.0])).passes());
        assert!(!figure(relative_error(&[1.0], &[1.0, 1.0])).passes());
        assert!(figure(relative_error(&[0.0], &[0.0])).passes());
    }
}
