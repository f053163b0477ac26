//! Inertias: of one rigid body, and of an articulated body seen at one handle.

use crate::{Force, Mat3, Motion, Number, Sym3, Vec3, vec3};
use core::ops::AddAssign;

/// Inertia of a rigid body about the origin, in the axes at hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigidInertia<T> {
    /// Mass \[kg\].
    pub mass: T,
    /// First moment: mass times the offset of the centre of mass from the origin [kg m].
    pub moment: Vec3<T>,
    /// Rotational inertia about the origin [kg m^2].
    pub rotational: Sym3<T>,
}

impl<T: Number> RigidInertia<T> {
    /// No mass at all.
    pub const ZERO: Self = Self {
        mass: T::ZERO,
        moment: Vec3::ZERO,
        rotational: Sym3::ZERO,
    };

    /// From mass, centre of mass and rotational inertia about the centre of mass.
    #[inline]
    #[must_use]
    pub fn from_center(mass: T, center: Vec3<T>, central: Sym3<T>) -> Self {
        Self {
            mass,
            moment: center * mass,
            rotational: central + Sym3::parallel_axis(mass, center),
        }
    }

    /// Applies a function to every number.
    #[inline]
    #[must_use]
    pub fn map<U: Number>(self, f: impl Fn(T) -> U) -> RigidInertia<U> {
        RigidInertia {
            mass: f(self.mass),
            moment: self.moment.map(&f),
            rotational: self.rotational.map(&f),
        }
    }

    /// The same inertia in the axes that `rotation` maps to.
    #[inline]
    #[must_use]
    pub fn rotated(&self, rotation: &Mat3<T>) -> Self {
        Self {
            mass: self.mass,
            moment: *rotation * self.moment,
            rotational: self.rotational.rotated(rotation),
        }
    }

    /// Momentum of a body with velocity `v`: I v.
    #[inline]
    #[must_use]
    pub fn mul(&self, v: Motion<T>) -> Force<T> {
        Force::new(
            self.rotational * v.angular + self.moment.cross(v.linear),
            v.linear * self.mass + v.angular.cross(self.moment),
        )
    }

    /// The force that keeps a body turning with `w` when the material point at the origin does not
    /// accelerate: [w x I w; w x (w x h)], h the first moment.
    ///
    /// With conventional (material-point) accelerations a = [dw/dt; acceleration of the origin's
    /// point], Newton and Euler read f = I a + bias.
    #[inline]
    #[must_use]
    pub fn bias(&self, w: Vec3<T>) -> Force<T> {
        Force::new(w.cross(self.rotational * w), w.cross(w.cross(self.moment)))
    }

    /// The same inertia about the point from which this origin lies at `r`:
    /// g = h + m r and I' = I - h~ r~ - r~ g~, the parallel-axis theorem without the centre of mass
    /// (which a body without mass does not have).
    #[inline]
    #[must_use]
    pub fn shifted_back(&self, r: Vec3<T>) -> Self {
        let (h, m) = (self.moment, self.mass);
        let g = h + r * m;
        // -h~ r~ - r~ g~ = (h.r + r.g) 1 - (r h' + g r'), symmetric because g - h is along r.
        let diagonal = r.dot(h) + g.dot(r);
        let rotational = Sym3 {
            xx: self.rotational.xx + diagonal - (r.x * h.x + g.x * r.x),
            yy: self.rotational.yy + diagonal - (r.y * h.y + g.y * r.y),
            zz: self.rotational.zz + diagonal - (r.z * h.z + g.z * r.z),
            xy: self.rotational.xy - (r.x * h.y + g.x * r.y),
            xz: self.rotational.xz - (r.x * h.z + g.x * r.z),
            yz: self.rotational.yz - (r.y * h.z + g.y * r.z),
        };
        Self {
            mass: m,
            moment: g,
            rotational,
        }
    }
}

impl<T: Number> AddAssign for RigidInertia<T> {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        self.mass += rhs.mass;
        self.moment += rhs.moment;
        self.rotational += rhs.rotational;
    }
}

/// Articulated-body inertia at one handle: the symmetric 6 x 6 matrix
/// [A H'; H C] from acceleration to force, A, C symmetric (RBDA section 7.1).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArticulatedInertia<T> {
    /// A: moment from angular acceleration [kg m^2].
    pub angular: Sym3<T>,
    /// H: force from angular acceleration [kg m].
    pub coupling: Mat3<T>,
    /// C: force from linear acceleration \[kg\].
    pub linear: Sym3<T>,
}

impl<T: Number> From<RigidInertia<T>> for ArticulatedInertia<T> {
    /// A rigid body is an articulated body without joints: H = -h~, C = m 1.
    #[inline]
    fn from(rigid: RigidInertia<T>) -> Self {
        Self {
            angular: rigid.rotational,
            coupling: Mat3::cross_matrix(-rigid.moment),
            linear: Sym3::from_diagonal(rigid.mass),
        }
    }
}

impl<T: Number> ArticulatedInertia<T> {
    /// No inertia at all.
    pub const ZERO: Self = Self {
        angular: Sym3::ZERO,
        coupling: Mat3::ZERO,
        linear: Sym3::ZERO,
    };

    /// The force that gives the handle the acceleration `a`: IA a.
    #[inline]
    #[must_use]
    pub fn mul(&self, a: Motion<T>) -> Force<T> {
        Force::new(
            self.angular * a.angular + self.coupling.transpose_mul(a.linear),
            self.coupling * a.angular + self.linear * a.linear,
        )
    }

    /// The same inertia, this many times.
    #[inline]
    #[must_use]
    pub fn scaled(&self, factor: T) -> Self {
        Self {
            angular: self.angular.map(|x| x * factor),
            coupling: self.coupling * factor,
            linear: self.linear.map(|x| x * factor),
        }
    }

    /// Takes away what a joint lets go: IA - U U' / D for one column, given U and 1/D.
    #[inline]
    pub fn subtract_outer(&mut self, u: Force<T>, scale: T) {
        let scaled = u * scale;
        self.angular = self.angular - Sym3::outer(u.angular, scale);
        self.linear = self.linear - Sym3::outer(u.linear, scale);
        self.coupling = self.coupling - Mat3::outer(u.linear, scaled.angular);
    }

    /// X' IA X: the same inertia at the handle from which this one lies at `r`, axes unchanged.
    ///
    /// With X = [1 0; -r~ 1]: C' = C, H' = H - C r~, A' = A + r~ H - H'' r~ where H'' = (H')'.
    /// By columns, A'_ij = A_ij + (r x H_j)_i + (r x H'_i)_j.
    #[inline]
    #[must_use]
    pub fn shifted_back(&self, r: Vec3<T>) -> Self {
        let h = &self.coupling;
        let (cx, cy, cz) = (
            self.linear.col_x(),
            self.linear.col_y(),
            self.linear.col_z(),
        );
        let coupling = Mat3::from_cols(
            h.x_axis + cz * r.y - cy * r.z,
            h.y_axis + cx * r.z - cz * r.x,
            h.z_axis + cy * r.x - cx * r.y,
        );
        let old = [r.cross(h.x_axis), r.cross(h.y_axis), r.cross(h.z_axis)];
        let new = [
            r.cross(coupling.x_axis),
            r.cross(coupling.y_axis),
            r.cross(coupling.z_axis),
        ];
        let a = self.angular;
        Self {
            angular: Sym3 {
                xx: a.xx + old[0].x + new[0].x,
                yy: a.yy + old[1].y + new[1].y,
                zz: a.zz + old[2].z + new[2].z,
                xy: a.xy + old[1].x + new[0].y,
                xz: a.xz + old[2].x + new[0].z,
                yz: a.yz + old[2].y + new[1].z,
            },
            coupling,
            linear: self.linear,
        }
    }

    /// Trace of the angular block of [`shifted_back`](Self::shifted_back), without forming it:
    /// tr A + 2 tr(r~ H) + |r|^2 tr C - r.(C r).
    #[inline]
    #[must_use]
    pub fn shifted_angular_trace(&self, r: Vec3<T>) -> T {
        let h = &self.coupling;
        let skew = vec3(
            h.z_axis.y - h.y_axis.z,
            h.x_axis.z - h.z_axis.x,
            h.y_axis.x - h.x_axis.y,
        );
        let coupled = r.dot(skew);
        self.angular.trace() + coupled + coupled + r.length_squared() * self.linear.trace()
            - r.dot(self.linear * r)
    }
}

impl<T: Number> AddAssign for ArticulatedInertia<T> {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        self.angular += rhs.angular;
        self.coupling = self.coupling + rhs.coupling;
        self.linear += rhs.linear;
    }
}

/// The full symmetric matrix, rows and columns angular first; for tests and printing.
impl<T: Number> From<&ArticulatedInertia<T>> for [[T; 6]; 6] {
    fn from(inertia: &ArticulatedInertia<T>) -> Self {
        let unit = |k: usize| {
            let e = |i: usize| if i == k { T::ONE } else { T::ZERO };
            Motion::new(vec3(e(0), e(1), e(2)), vec3(e(3), e(4), e(5)))
        };
        core::array::from_fn(|k| {
            let f = inertia.mul(unit(k));
            let (n, l) = (f.angular.to_array(), f.linear.to_array());
            [n[0], n[1], n[2], l[0], l[1], l[2]]
        })
    }
}
