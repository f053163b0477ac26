//! Jacobians of points of bodies, in world axes, and products with them that need no matrix.
//!
//! A column is the motion of the point when one joint moves at unit rate: S of that joint, seen at the point
//! (RBDA section 4.1). Only joints between the body and the world have one, so that everything here costs as many
//! operations as there are of them.

use crate::forces::{body_of_dof, check_dofs};
use crate::workspace::{Sweeps, in_precision};
use crate::{BodyForce, BodyMotion, Error, Workspace};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use vertebra_assembly::{BodyId, ModelError};
use vertebra_spatial::{Force, Motion, Real, Vec3};

/// A point of a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyPoint {
    /// The body.
    pub body: BodyId,
    /// Where the point is in the body's frame \[m\].
    pub point: DVec3,
}

impl BodyPoint {
    /// A point given in the body's frame \[m\].
    #[must_use]
    pub fn new(body: BodyId, point: impl Into<DVec3>) -> Self {
        Self {
            body,
            point: point.into(),
        }
    }

    /// The origin of a body's frame.
    #[must_use]
    pub const fn origin(body: BodyId) -> Self {
        Self {
            body,
            point: DVec3::ZERO,
        }
    }
}

impl Workspace {
    /// The Jacobian J of a body at one of its points, of the state last given: the body's angular velocity
    /// [rad/s] and the point's velocity [m/s], both in world axes, are J qd. Shape 6 x
    /// [`dof_count`](vertebra_assembly::Model::dof_count), by columns: `out[6 * dof + row]`, angular rows first.
    ///
    /// # Errors
    /// [`Error::NotComputed`] before any algorithm has been given a state, [`Error::UnknownBody`],
    /// [`Error::NonFiniteInput`], [`Error::Model`] if `out` has another length, [`Error::Overflow`].
    pub fn jacobian(&self, at: BodyPoint, out: &mut [f64]) -> Result<(), Error> {
        let i = self.check_point(at)?;
        check_length("the Jacobian", 6 * self.qdd.len(), out.len())?;
        out.fill(0.0);
        let (units, rates) = (self.model.units(), &self.scales.rate);
        in_precision!(&self.arrays, s => s.outwards(i, at, units.length, |at, r| {
            for dof in s.dofs(at) {
                let column = s.subspace[dof].shifted(r).map(Real::to_f64) * rates[dof];
                let angular = column.angular.map(|x| x / units.time);
                let linear = column.linear.map(|x| x * units.velocity());
                out[6 * dof..6 * dof + 6].copy_from_slice(&Motion::new(angular, linear).to_array());
            }
        }));
        match out.iter().position(|entry| !entry.is_finite()) {
            None => Ok(()),
            Some(entry) => Err(Error::Overflow {
                quantity: "Jacobian",
                body: body_of_dof(&self.model, entry / 6),
                time: self.time,
            }),
        }
    }

    /// J qd for any joint rates `rates` [rad/s or m/s]: how a body and a point of it would move.
    ///
    /// # Errors
    /// As [`jacobian`](Self::jacobian); [`Error::NonFiniteInput`] for a rate.
    pub fn jacobian_mul(&self, at: BodyPoint, rates: &[f64]) -> Result<BodyMotion, Error> {
        let i = self.check_point(at)?;
        check_dofs(&self.model, "joint rates", "joint rate", rates)?;
        let (units, scales) = (self.model.units(), &self.scales.rate);
        let mut motion = Motion::ZERO;
        in_precision!(&self.arrays, s => s.outwards(i, at, units.length, |at, r| {
            for dof in s.dofs(at) {
                let column = s.subspace[dof].shifted(r).map(Real::to_f64);
                motion += column * (rates[dof] * scales[dof]);
            }
        }));
        self.finite_motion(
            "velocity",
            i,
            BodyMotion {
                angular: motion.angular.to_glam() / units.time,
                linear: motion.linear.to_glam() * units.velocity(),
            },
        )
    }

    /// J' f: the joint forces [N m or N] that hold against a force on a body, given in world axes about
    /// the point, with the sign of a force that drives: under them and no other forces the power is that of `f`.
    /// Shape of `out`: [`dof_count`](vertebra_assembly::Model::dof_count).
    ///
    /// # Errors
    /// As [`jacobian`](Self::jacobian); [`Error::NonFiniteInput`] for the force.
    pub fn jacobian_transpose_mul(
        &self,
        at: BodyPoint,
        force: BodyForce,
        out: &mut [f64],
    ) -> Result<(), Error> {
        let i = self.check_point(at)?;
        check_length("joint forces", self.qdd.len(), out.len())?;
        let given = [force.moment.to_array(), force.force.to_array()].concat();
        if let Some(&value) = given.iter().find(|value| !value.is_finite()) {
            return Err(Error::NonFiniteInput {
                quantity: "force",
                element: self.model.bodies()[i].name.clone(),
                value,
            });
        }
        out.fill(0.0);
        let units = self.model.units();
        let force = Force::new(
            Vec3::from_glam(force.moment / units.energy()),
            Vec3::from_glam(force.force / units.force()),
        );
        in_precision!(&self.arrays, s => s.outwards(i, at, units.length, |at, r| {
            for dof in s.dofs(at) {
                let column = s.subspace[dof].shifted(r).map(Real::to_f64);
                out[dof] = column.dot(force) * self.scales.force[dof];
            }
        }));
        crate::finite_results(&self.model, "joint force", out, self.time)
    }

    /// dJ/dt qd: acceleration of a body [rad/s^2] and of one of its points [m/s^2], in world axes, if all joint
    /// accelerations were zero; with them it is J qdd more.
    ///
    /// # Errors
    /// As [`jacobian`](Self::jacobian).
    pub fn bias_acceleration(&self, at: BodyPoint) -> Result<BodyMotion, Error> {
        let i = self.check_point(at)?;
        let units = self.model.units();
        let motion = in_precision!(&self.arrays, s => {
            let point = Vec3::from_glam(at.point / units.length);
            let (r, w) = (s.arm(i, point), s.spin[i]);
            let mut sum = Motion::new(Vec3::ZERO, w.cross(w.cross(r)));
            s.outwards(i, at, units.length, |at, r| sum += s.bias_acceleration[at].shifted(r));
            sum.map(Real::to_f64)
        });
        self.finite_motion(
            "acceleration",
            i,
            BodyMotion {
                angular: motion.angular.to_glam() / (units.time * units.time),
                linear: motion.linear.to_glam() * units.acceleration(),
            },
        )
    }

    pub(crate) fn check_point(&self, at: BodyPoint) -> Result<usize, Error> {
        self.require_state()?;
        let i = self.check_body(at.body)?;
        match at.point.to_array().into_iter().find(|x| !x.is_finite()) {
            None => Ok(i),
            Some(value) => Err(Error::NonFiniteInput {
                quantity: "point",
                element: self.model.bodies()[i].name.clone(),
                value,
            }),
        }
    }

    fn finite_motion(
        &self,
        quantity: &'static str,
        body: usize,
        motion: BodyMotion,
    ) -> Result<BodyMotion, Error> {
        let finite = motion.angular.is_finite() && motion.linear.is_finite();
        self.refuse_overflow(quantity, (!finite).then_some(body))?;
        Ok(motion)
    }
}

impl<T: Real> Sweeps<T> {
    /// Calls `visit(body, r)` for a body and all that carry it, r from that body's origin to the point.
    fn outwards(
        &self,
        body: usize,
        at: BodyPoint,
        length: f64,
        mut visit: impl FnMut(usize, Vec3<T>),
    ) {
        let mut r = self.arm(body, Vec3::from_glam(at.point / length));
        let mut next = Some(body);
        while let Some(i) = next {
            visit(i, r);
            r += self.offset[i];
            next = self.links[i].parent;
        }
    }
}

/// Refuses an array that does not hold as many numbers as it must.
pub(crate) fn check_length(
    quantity: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), Error> {
    if found == expected {
        return Ok(());
    }
    Err(Error::Model(ModelError::WrongLength {
        quantity,
        expected,
        found,
    }))
}
