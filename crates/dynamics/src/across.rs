//! What is across a joint: where the body beyond it is, how it moves, and how it may.

use crate::link::{Kind, Link};
use vertebra_spatial::{Mat3, Motion, Real, Transform, Vec3, subspace, vec3};

/// The state as it is given, and the factors to the model's units.
#[derive(Clone, Copy)]
pub(crate) struct Given<'a> {
    pub(crate) q: &'a [f64],
    pub(crate) qd: &'a [f64],
    pub(crate) rate_scales: &'a [f64],
    pub(crate) length: f64,
}

impl Given<'_> {
    pub(crate) fn rate<T: Real>(&self, v: usize) -> T {
        T::from_f64(self.qd[v] * self.rate_scales[v])
    }

    fn rates<T: Real>(&self, v: usize) -> Vec3<T> {
        vec3(self.rate(v), self.rate(v + 1), self.rate(v + 2))
    }
}

impl<T: Real> Link<T> {
    /// The joint frame in that of the body before; `turn` is sine and cosine of a revolute or screw
    /// joint.
    pub(crate) fn local(&self, given: &Given<'_>, turn: (T, T)) -> Transform<T> {
        let mut rotation = self.placement.rotation;
        match self.kind {
            Kind::Fixed | Kind::Prismatic => {}
            Kind::Revolute | Kind::Screw => {
                let ((sin, cos), Mat3 { x_axis, y_axis, .. }) = (turn, rotation);
                rotation.x_axis = x_axis * cos + y_axis * sin;
                rotation.y_axis = y_axis * cos - x_axis * sin;
            }
            Kind::Spherical | Kind::Free => {
                rotation = rotation * T::rotation_of(self.quaternion(given));
            }
        }
        Transform {
            rotation,
            translation: self.displacement(given),
        }
    }

    /// The joint's origin in the frame of the body before.
    pub(crate) fn displacement(&self, given: &Given<'_>) -> Vec3<T> {
        let q = &given.q[self.q..];
        let length = |x: f64| T::from_f64(x / given.length);
        let Transform {
            rotation,
            translation,
        } = self.placement;
        match self.kind {
            Kind::Fixed | Kind::Revolute | Kind::Spherical => translation,
            Kind::Prismatic => translation + rotation.z_axis * length(q[0]),
            Kind::Screw => translation + rotation.z_axis * self.pitch * T::from_f64(q[0]),
            Kind::Free => self.placement.point(vec3(q[0], q[1], q[2]).map(length)),
        }
    }

    /// The quaternion of a spherical or free joint.
    pub(crate) fn quaternion(&self, given: &Given<'_>) -> [f64; 4] {
        let start = self.q + if self.kind == Kind::Free { 3 } else { 0 };
        let q = &given.q[start..];
        [q[0], q[1], q[2], q[3]]
    }

    /// Angular velocity across the joint, in joint axes.
    pub(crate) fn turning<U: Real>(&self, given: &Given<'_>) -> Vec3<U> {
        match self.kind {
            Kind::Fixed | Kind::Prismatic => Vec3::ZERO,
            Kind::Revolute | Kind::Screw => vec3(U::ZERO, U::ZERO, given.rate(self.v)),
            Kind::Spherical | Kind::Free => given.rates(self.v),
        }
    }

    /// Fills the motion subspace in; returns the velocity across the joint, and what turning rates
    /// add to the acceleration.
    pub(crate) fn span(
        &self,
        rotation: &Mat3<T>,
        given: &Given<'_>,
        columns: &mut [Motion<T>],
    ) -> (Motion<T>, Vec3<T>) {
        match self.kind {
            Kind::Fixed => (Motion::ZERO, Vec3::ZERO),
            Kind::Revolute => {
                columns.copy_from_slice(&subspace::revolute(rotation.z_axis));
                (columns[0] * given.rate(self.v), Vec3::ZERO)
            }
            Kind::Prismatic => {
                columns.copy_from_slice(&subspace::prismatic(rotation.z_axis));
                (columns[0] * given.rate(self.v), Vec3::ZERO)
            }
            Kind::Screw => {
                columns.copy_from_slice(&subspace::screw(rotation.z_axis, self.pitch));
                (columns[0] * given.rate(self.v), Vec3::ZERO)
            }
            Kind::Spherical => {
                columns.copy_from_slice(&subspace::spherical(rotation));
                let spin = *rotation * given.rates(self.v);
                (Motion::new(spin, Vec3::ZERO), Vec3::ZERO)
            }
            Kind::Free => {
                columns.copy_from_slice(&subspace::free(rotation));
                let (spin, slide) = (
                    *rotation * given.rates(self.v),
                    *rotation * given.rates(self.v + 3),
                );
                (Motion::new(spin, slide), spin.cross(slide))
            }
        }
    }
}
