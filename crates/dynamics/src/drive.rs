//! Forces along the freedoms of joints.

use crate::link::Kind;
use vertebra_spatial::{Force, Motion, Number};

/// A freedom's direction as a force of unit power.
pub(crate) fn along<T: Number>(column: Motion<T>) -> Force<T> {
    Force::new(column.angular, column.linear)
}

/// S tau: the force along a joint's freedoms that exerts tau.
pub(crate) fn driven<T: Number>(columns: &[Motion<T>], tau: &[T]) -> Force<T> {
    let mut f = Force::ZERO;
    for (&column, &tau) in columns.iter().zip(tau) {
        f += along(column) * tau;
    }
    f
}

/// The force that a joint transmits, given one that is right but for rounding.
///
/// What is left of it along the joint's freedoms, whose columns are orthonormal, is taken out:
/// f += S (tau - S' f). Where the freedoms are all there is (free joints, and the moment of spherical
/// ones) that is S tau without a rest; a rest would be rounding alone, and wrong in every digit where
/// tau is zero.
pub(crate) fn transmitted<T: Number>(
    kind: Kind,
    mut f: Force<T>,
    columns: &[Motion<T>],
    tau: &[T],
) -> Force<T> {
    match kind {
        Kind::Fixed => {}
        Kind::Revolute | Kind::Prismatic => {
            let excess = columns[0].dot(f) - tau[0];
            f -= along(columns[0]) * excess;
        }
        Kind::Spherical => f.angular = driven(columns, tau).angular,
        Kind::Free => f = driven(columns, tau),
    }
    f
}
