//! Accelerations that were computed elsewhere, held against the bodies' own equations.

use crate::forces::check_dofs;
use crate::refine::Loads;
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Refinement, Workspace, aba};
use vertebra_assembly::{Model, State};
use vertebra_spatial::Real;

/// How exact joint accelerations `qdd` [rad/s^2 or m/s^2] are, whatever computed them: what they leave of the
/// bodies' own equations in the precision of `workspace`, and the forward error that one correction of them
/// shows. The workspace then has the corrected accelerations.
///
/// Takes about one and a half solutions by [`aba`](crate::aba), whose factors correct; [`refine`](crate::refine) again
/// to see how exact the correction was.
///
/// # Errors
/// As [`aba`](crate::aba); [`Error::Model`] or [`Error::NonFiniteInput`] if `qdd` does not fit the model.
///
/// ```
/// use vertebra_assembly::{State, generate};
/// use vertebra_dynamics::{Forces, Precision, Workspace, aba, check_accelerations};
///
/// let model = generate::random_chain(64, &generate::Rod::default(), 7)?;
/// let (state, forces) = (State::random(&model, 8), Forces::none(&model));
/// let mut single = Workspace::new(&model, Precision::F32);
/// let qdd = aba(&model, &state, &forces, &mut single)?;
/// let mut workspace = Workspace::new(&model, Precision::F64);
/// let found = check_accelerations(&model, &state, &forces, qdd, &mut workspace)?;
/// assert!(found.change > 1e-9 && found.change < 1e-3); // f32
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
pub fn check_accelerations(
    model: &Model,
    state: &State,
    forces: &Forces,
    qdd: &[f64],
    workspace: &mut Workspace,
) -> Result<Refinement, Error> {
    check_dofs(model, "joint accelerations", "joint acceleration", qdd)?;
    aba(model, state, forces, workspace)?;
    let scales = &workspace.scales.acceleration;
    in_precision!(&mut workspace.arrays, s => s.accelerate_by(qdd, scales));
    workspace.correct(forces, Loads::Left)
}

impl<T: Real> Sweeps<T> {
    /// Puts given accelerations in the place of the solution: a = X a_parent + c + S qdd.
    fn accelerate_by(&mut self, qdd: &[f64], scales: &[f64]) {
        for (u, (&qdd, &scale)) in self.u.iter_mut().zip(qdd.iter().zip(scales)) {
            *u = T::from_f64(qdd / scale);
        }
        for i in 0..self.links.len() {
            let above = match self.links[i].parent {
                Some(parent) => self.acceleration[parent],
                None => self.base,
            };
            let mut a = above.shifted(self.offset[i]) + self.bias_acceleration[i];
            for dof in self.dofs(i) {
                a += self.subspace[dof] * self.u[dof];
            }
            self.acceleration[i] = a;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Precision, forward_error};
    use vertebra_assembly::Random;
    use vertebra_assembly::generate::{self, RandomTree};

    /// Errors planted in exact accelerations are found to be as large as they are, on trees of all joints.
    #[test]
    fn planted_errors_are_found() {
        for seed in 0..20 {
            let tree = RandomTree {
                floating: seed % 2 == 1,
                ..RandomTree::mixed(30)
            };
            let model = generate::random_tree(&tree, seed).unwrap();
            let state = State::random(&model, seed);
            let mut random = Random::new(seed);
            let mut forces = Forces::none(&model);
            forces.joint.fill_with(|| random.symmetric());
            let mut reference = Workspace::new(&model, Precision::Reference);
            let exact = (aba(&model, &state, &forces, &mut reference).unwrap()).to_vec();
            let mut workspace = Workspace::new(&model, Precision::F64);
            for size in [0.0, 1e-9, 1e-5, 1e-2] {
                let largest = exact.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                let planted: Vec<f64> = (exact.iter())
                    .map(|x| x + size * largest * random.symmetric())
                    .collect();
                let error = forward_error(&planted, &reference).unwrap();
                let found =
                    check_accelerations(&model, &state, &forces, &planted, &mut workspace).unwrap();
                let rounding = 1e-11;
                assert!(
                    (found.change - error).abs() <= 0.02 * error + rounding,
                    "seed {seed}, {size:e}: {found:?} of {error:e}"
                );
                let corrected = workspace.joint_accelerations().unwrap();
                assert!(forward_error(corrected, &reference).unwrap() <= rounding);
            }
        }
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused() {
        let model = generate::random_tree(&RandomTree::mixed(5), 1).unwrap();
        let (state, forces) = (State::random(&model, 2), Forces::none(&model));
        let mut workspace = Workspace::new(&model, Precision::F64);
        let mut check = |qdd: &[f64]| {
            check_accelerations(&model, &state, &forces, qdd, &mut workspace).unwrap_err()
        };
        let mut qdd = vec![0.0; model.dof_count()];
        assert!(matches!(check(&qdd[1..]), Error::Model(_)));
        qdd[0] = f64::NAN;
        assert!(matches!(check(&qdd), Error::NonFiniteInput { .. }));
    }
}
