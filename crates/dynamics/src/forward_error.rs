//! The error of accelerations against the reference.

use crate::forces::check_dofs;
use crate::residual::worst_of;
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Workspace};
use vertebra_spatial::{Number, Real};

/// Forward error of joint accelerations `qdd` [rad/s^2 or m/s^2]: max |qdd - ref| / max |ref|, where
/// ref is what [`aba`](crate::aba) left in `reference` for the same state and forces, usually one of
/// [`Precision::Reference`](crate::Precision::Reference).
///
/// Where loads balance and hardly anything accelerates, what counts instead of max |ref| is what these
/// loads would cause by themselves: gravity, the square of the largest rate, the largest push over the mass of
/// the model, with its own unit of length where the one is linear and the other is not.
///
/// The differences are taken before the reference is rounded to f64, so that errors far below 1e-16
/// (of results that happen to be nearly exact) are still errors and not the reference's rounding.
///
/// # Errors
/// [`Error::NotComputed`] if the reference has not been computed, [`Error::Model`] or
/// [`Error::NonFiniteInput`] if `qdd` does not fit its model.
///
/// ```
/// use vertebra_assembly::{State, generate};
/// use vertebra_dynamics::{Forces, Precision, Workspace, aba, forward_error};
///
/// let model = generate::random_chain(64, &generate::Rod::default(), 7)?;
/// let (state, forces) = (State::random(&model, 8), Forces::none(&model));
/// let mut reference = Workspace::new(&model, Precision::Reference);
/// aba(&model, &state, &forces, &mut reference)?;
/// let mut workspace = Workspace::new(&model, Precision::F64);
/// let qdd = aba(&model, &state, &forces, &mut workspace)?;
/// assert!(forward_error(qdd, &reference)? < 1e-12);
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
pub fn forward_error(qdd: &[f64], reference: &Workspace) -> Result<f64, Error> {
    reference.joint_accelerations()?;
    let quantity = ("joint accelerations", "joint acceleration");
    check_dofs(&reference.model, quantity.0, quantity.1, qdd)?;
    let scales = &reference.scales.acceleration;
    let least = reference.least_acceleration();
    Ok(in_precision!(&reference.arrays, s => s.forward_error(qdd, scales, least)))
}

impl<T: Real> Sweeps<T> {
    fn forward_error(&self, qdd: &[f64], scales: &[f64], least: f64) -> f64 {
        let (mut difference, mut largest) = (0.0_f64, least);
        for ((&exact, &qdd), &scale) in self.u.iter().zip(qdd).zip(scales) {
            let exact = exact.widen();
            let off = exact - T::Wide::from_f64(qdd / scale);
            difference = worst_of(difference, off.abs().to_f64() * scale);
            largest = largest.max(exact.abs().to_f64() * scale);
        }
        if difference == 0.0 {
            0.0
        } else {
            difference / largest
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::residual::worst_of;
    use crate::workspace::Arrays;
    use crate::{Forces, Precision, Workspace, aba, forward_error, joint_wrenches, residual};
    use vertebra_assembly::generate::{self, RandomTree};
    use vertebra_assembly::{Model, Random, State};
    use vertebra_spatial::{DoubleDouble, MotionSubspace, Number, Real};

    fn problem(count: usize, seed: u64) -> (Model, State, Forces) {
        let tree = RandomTree {
            floating: seed % 2 == 1,
            reach: 1 + count % 5,
            ..RandomTree::mixed(count)
        };
        let model = generate::random_tree(&tree, seed).unwrap();
        let state = State::random(&model, seed);
        let mut forces = Forces::none(&model);
        let mut random = Random::new(seed);
        forces.joint.fill_with(|| random.symmetric());
        (model, state, forces)
    }

    /// |RNEA(ABA(tau)) - tau| over the largest joint force without accelerations, in the
    /// precision of the workspace, nothing rounded in between.
    fn inverse_of_forward(model: &Model, state: &State, forces: &Forces) -> f64 {
        let mut workspace = Workspace::new(model, Precision::Reference);
        aba(model, state, forces, &mut workspace).unwrap();
        let Arrays::Reference(s) = &mut workspace.arrays else {
            panic!("made for the reference");
        };
        s.accelerate();
        s.gather_wrenches();
        let mut worst = 0.0_f64;
        let mut largest = f64::MIN_POSITIVE;
        for i in 0..s.links.len() {
            let dofs = s.dofs(i);
            let mut found = [DoubleDouble::ZERO; 6];
            let found = &mut found[..dofs.len()];
            let wrench = s.joint_wrench[i];
            MotionSubspace(&s.subspace[dofs.clone()]).transpose_mul(wrench, found);
            largest = [wrench.angular, wrench.linear]
                .iter()
                .fold(largest, |m, v| m.max(v.length().to_f64()));
            for (&found, dof) in found.iter().zip(dofs) {
                worst = worst_of(worst, (found - s.tau[dof]).abs().to_f64());
            }
        }
        worst / largest
    }

    /// 106 bits, by an identity that knows nothing of how they are had: a joint force that lost one
    /// of its last 80 bits would be seen.
    #[test]
    fn inverse_dynamics_undo_forward_dynamics_to_the_last_bits() {
        for (seed, count) in (0..40_u64).zip((1..=12).cycle()) {
            let (model, state, forces) = problem(count, seed);
            let error = inverse_of_forward(&model, &state, &forces);
            assert!(error <= 1e-28, "seed {seed}: {error:e}");
        }
    }

    /// The bodies' own equations, which the residual evaluates in the reference precision too.
    #[test]
    fn the_reference_solves_the_equations_of_the_bodies() {
        for (seed, count) in [(0, 1), (1, 2), (2, 17), (3, 100), (4, 1000)] {
            let (model, state, forces) = problem(count, seed);
            let mut workspace = Workspace::new(&model, Precision::Reference);
            aba(&model, &state, &forces, &mut workspace).unwrap();
            joint_wrenches(&mut workspace).unwrap();
            let residual = residual(&model, &state, &forces, &workspace).unwrap();
            let bound = 64.0 * Precision::Reference.epsilon() * model.depth() as f64;
            assert!(residual.max() <= bound, "{count} bodies: {residual:?}");
            // And not for want of terms.
            assert!(count == 1 || residual.max() > 0.0);
        }
    }

    /// A single error in the last place of f64 is measured as what it is.
    #[test]
    fn small_errors_are_measured() {
        let (model, state, forces) = problem(9, 3);
        let mut reference = Workspace::new(&model, Precision::Reference);
        let mut qdd = aba(&model, &state, &forces, &mut reference)
            .unwrap()
            .to_vec();
        let rounding = forward_error(&qdd, &reference).unwrap();
        assert!(
            rounding > 0.0 && rounding <= 0.5 * f64::EPSILON,
            "{rounding:e}"
        );
        let (largest, value) = qdd
            .iter()
            .copied()
            .enumerate()
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .unwrap();
        qdd[largest] = value * (1.0 + 4.0 * f64::EPSILON);
        let planted = forward_error(&qdd, &reference).unwrap() / f64::EPSILON;
        assert!((planted - 4.0).abs() <= 1.0, "{planted}");
    }
}
