//! Forces along the freedoms of joints.

use vertebra_spatial::{Force, Motion, Number};

/// A freedom's direction as a force of unit power.
#[inline]
pub(crate) fn along<T: Number>(column: Motion<T>) -> Force<T> {
    Force::new(column.angular, column.linear)
}

/// S tau: the force along a joint's freedoms that exerts tau.
#[inline]
pub(crate) fn driven<T: Number>(columns: &[Motion<T>], tau: &[T]) -> Force<T> {
    let mut f = Force::ZERO;
    for (&column, &tau) in columns.iter().zip(tau) {
        f += along(column) * tau;
    }
    f
}

/// The force that a joint transmits, given one that is right but for rounding.
///
/// What is left of it along the joint's freedoms, whose columns are orthogonal and, but for a screw's,
/// of unit length, is taken out: f += S (S'S)^-1 (tau - S' f). Where the freedoms are all there is (free joints, and the moment of spherical
/// ones) that is S tau without a rest; a rest would be rounding alone, and wrong in every digit where
/// tau is zero.
#[inline]
pub(crate) fn transmitted<T: Number>(
    mut f: Force<T>,
    columns: &[Motion<T>],
    tau: &[T],
) -> Force<T> {
    match columns {
        [] => {}
        [column] => {
            let direction = along(*column);
            let excess = (column.dot(f) - tau[0]) / column.dot(direction);
            f -= direction * excess;
        }
        [_, _, _] => f.angular = driven(columns, tau).angular,
        _ => f = driven(columns, tau),
    }
    f
}
