//! Mass properties of bodies.

use crate::InertiaViolation;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use vertebra_spatial::{Pose, SmallCholesky};

/// Mass, centre of mass and inertia of a rigid body, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MassProperties {
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the body's frame \[m\].
    pub center: DVec3,
    /// Rotational inertia about the centre of mass, in the axes of the body's frame [kg m^2].
    pub inertia: DMat3,
}

impl MassProperties {
    /// No mass at all, as the intermediate links of compound joints have.
    pub const MASSLESS: Self = Self {
        mass: 0.0,
        center: DVec3::ZERO,
        inertia: DMat3::ZERO,
    };

    /// A solid cylinder of `length` and `radius` \[m\] along z, from the frame's origin to z = length.
    #[must_use]
    pub fn rod(mass: f64, length: f64, radius: f64) -> Self {
        let across = mass * (3.0 * radius * radius + length * length) / 12.0;
        let along = 0.5 * mass * radius * radius;
        Self {
            mass,
            center: DVec3::new(0.0, 0.0, 0.5 * length),
            inertia: DMat3::from_diagonal(DVec3::new(across, across, along)),
        }
    }

    /// A solid box with edges of `size` \[m\], centred on the frame's origin.
    #[must_use]
    pub fn cuboid(mass: f64, size: DVec3) -> Self {
        let s = size * size;
        let diagonal = DVec3::new(s.y + s.z, s.x + s.z, s.x + s.y) * (mass / 12.0);
        Self {
            mass,
            center: DVec3::ZERO,
            inertia: DMat3::from_diagonal(diagonal),
        }
    }

    /// A solid ball of `radius` \[m\], centred on the frame's origin.
    #[must_use]
    pub fn sphere(mass: f64, radius: f64) -> Self {
        let moment = 0.4 * mass * radius * radius;
        Self {
            mass,
            center: DVec3::ZERO,
            inertia: DMat3::from_diagonal(DVec3::splat(moment)),
        }
    }

    /// The same body described in the frame from which its own frame is seen at `placement`.
    #[must_use]
    pub fn placed(&self, placement: &Pose) -> Self {
        let rotation = placement.matrix();
        Self {
            mass: self.mass,
            center: placement.transform_point(self.center),
            inertia: rotation * self.inertia * rotation.transpose(),
        }
    }

    /// Two bodies welded together, described in the frame both are given in.
    #[must_use]
    pub fn combined(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            return Self {
                inertia: self.inertia + other.inertia,
                ..*self
            };
        }
        let center = (self.center * self.mass + other.center * other.mass) / mass;
        Self {
            mass,
            center,
            inertia: self.about(center) + other.about(center),
        }
    }

    /// Rotational inertia about `point` [kg m^2].
    #[must_use]
    pub fn about(&self, point: DVec3) -> DMat3 {
        let c = self.center - point;
        let outer = DMat3::from_cols(c * c.x, c * c.y, c * c.z);
        self.inertia + (DMat3::from_diagonal(DVec3::splat(c.length_squared())) - outer) * self.mass
    }

    /// What makes the inertia impossible, if anything does.
    ///
    /// A distribution of mass has second moments J = tr(I)/2 - I, which are positive semidefinite;
    /// that is the triangle inequality of the principal moments, and it implies that I is positive
    /// semidefinite. Both may fail by 1e-6 of the trace, what rounding to six digits in a file does,
    /// and by the rounding error of the moment that the mass has about the frame's origin: exporters
    /// leave 1e-35 where they mean zero.
    #[must_use]
    pub fn violation(&self) -> Option<InertiaViolation> {
        let trace = self.inertia.x_axis.x + self.inertia.y_axis.y + self.inertia.z_axis.z;
        let rounding = 4.0 * f64::EPSILON * self.mass.abs() * self.center.length_squared();
        let slack = DMat3::from_diagonal(DVec3::splat(1e-6 * trace.abs() + rounding));
        if trace == 0.0 && self.inertia == DMat3::ZERO {
            return None;
        }
        if !pivots_exceed(&(self.inertia + slack), 0.0) {
            return Some(InertiaViolation::NotPositiveSemidefinite);
        }
        let moments = DMat3::from_diagonal(DVec3::splat(0.5 * trace)) - self.inertia;
        (!pivots_exceed(&(moments + slack), 0.0)).then_some(InertiaViolation::TriangleInequality)
    }
}

/// Whether all Cholesky pivots of a symmetric matrix exceed `floor`.
///
/// The largest diagonal entries go first. Of an inertia with one vanishing moment, 1 - n n', the
/// second pivot is then at least half the first, so that the last is zero to rounding.
pub(crate) fn pivots_exceed(m: &DMat3, floor: f64) -> bool {
    let m = m.to_cols_array_2d();
    let mut order = [0, 1, 2];
    order.sort_unstable_by(|&a, &b| m[b][b].total_cmp(&m[a][a]));
    let mut d = [[0.0; 6]; 6];
    for (row, &from_row) in order.iter().enumerate() {
        for (column, &from_column) in order.iter().enumerate() {
            d[row][column] = m[from_column][from_row];
        }
    }
    SmallCholesky::factor(3, &d, &[floor; 6]).is_ok()
}
