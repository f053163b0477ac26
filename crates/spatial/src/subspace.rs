//! Joint motion subspaces.

use crate::{Force, Mat3, Motion, Number, Vec3};

/// The motion subspace S of a joint: one motion vector a degree of freedom, so that the relative
/// velocity across the joint is S qd (RBDA section 3.5; the hinge matrix H of Drake and Jain).
#[derive(Clone, Copy, Debug)]
pub struct MotionSubspace<'a, T>(pub &'a [Motion<T>]);

impl<T: Number> MotionSubspace<'_, T> {
    /// S qd, shape of `rates`: [degrees of freedom].
    #[inline]
    #[must_use]
    pub fn mul(&self, rates: &[T]) -> Motion<T> {
        let mut sum = Motion::ZERO;
        for (&column, &rate) in self.0.iter().zip(rates) {
            sum += column * rate;
        }
        sum
    }

    /// S' f: the generalised forces that `force` exerts on the joint, shape [degrees of freedom].
    #[inline]
    pub fn transpose_mul(&self, force: Force<T>, out: &mut [T]) {
        for (&column, out) in self.0.iter().zip(out) {
            *out = column.dot(force);
        }
    }
}

/// S of a revolute joint turning about `axis`.
#[inline]
#[must_use]
pub fn revolute<T: Number>(axis: Vec3<T>) -> [Motion<T>; 1] {
    [Motion::new(axis, Vec3::ZERO)]
}

/// S of a prismatic joint sliding along `axis`.
#[inline]
#[must_use]
pub fn prismatic<T: Number>(axis: Vec3<T>) -> [Motion<T>; 1] {
    [Motion::new(Vec3::ZERO, axis)]
}

/// S of a screw joint turning about `axis` and sliding along it by `pitch` a radian.
#[inline]
#[must_use]
pub fn screw<T: Number>(axis: Vec3<T>, pitch: T) -> [Motion<T>; 1] {
    [Motion::new(axis, axis * pitch)]
}

/// S of a spherical joint whose rates are given along the columns of `axes`.
#[inline]
#[must_use]
pub fn spherical<T: Number>(axes: &Mat3<T>) -> [Motion<T>; 3] {
    [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| Motion::new(axis, Vec3::ZERO))
}

/// S of a free joint whose rates, angular first, are given along the columns of `axes`.
#[inline]
#[must_use]
pub fn free<T: Number>(axes: &Mat3<T>) -> [Motion<T>; 6] {
    let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis];
    let turn = |axis| Motion::new(axis, Vec3::ZERO);
    let slide = |axis| Motion::new(Vec3::ZERO, axis);
    [turn(x), turn(y), turn(z), slide(x), slide(y), slide(z)]
}
