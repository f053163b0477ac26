//! Three-by-three matrices, general and symmetric.

use crate::{Number, Real, Vec3, vec3};
use core::ops::{Add, AddAssign, Mul, Sub};
use glam::DMat3;

/// A 3 x 3 matrix, stored by columns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mat3<T> {
    /// First column.
    pub x_axis: Vec3<T>,
    /// Second column.
    pub y_axis: Vec3<T>,
    /// Third column.
    pub z_axis: Vec3<T>,
}

impl<T: Number> Mat3<T> {
    /// All zeros.
    pub const ZERO: Self = Self::from_cols(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    /// The identity.
    pub const IDENTITY: Self = Self::from_cols(
        vec3(T::ONE, T::ZERO, T::ZERO),
        vec3(T::ZERO, T::ONE, T::ZERO),
        vec3(T::ZERO, T::ZERO, T::ONE),
    );

    /// A matrix from its columns.
    #[inline]
    #[must_use]
    pub const fn from_cols(x_axis: Vec3<T>, y_axis: Vec3<T>, z_axis: Vec3<T>) -> Self {
        Self {
            x_axis,
            y_axis,
            z_axis,
        }
    }

    /// Rounds a glam matrix to this precision.
    #[inline]
    #[must_use]
    pub fn from_glam(m: DMat3) -> Self {
        Self::from_cols(
            Vec3::from_glam(m.x_axis),
            Vec3::from_glam(m.y_axis),
            Vec3::from_glam(m.z_axis),
        )
    }

    /// The matrix as a glam matrix.
    #[inline]
    #[must_use]
    pub fn to_glam(self) -> DMat3
    where
        T: Real,
    {
        DMat3::from_cols(
            self.x_axis.to_glam(),
            self.y_axis.to_glam(),
            self.z_axis.to_glam(),
        )
    }

    /// Applies a function to every entry.
    #[inline]
    #[must_use]
    pub fn map<U: Number>(self, f: impl Fn(T) -> U) -> Mat3<U> {
        Mat3::from_cols(
            self.x_axis.map(&f),
            self.y_axis.map(&f),
            self.z_axis.map(&f),
        )
    }

    /// The matrix `v~` with `v~ w = v x w`.
    #[inline]
    #[must_use]
    pub fn cross_matrix(v: Vec3<T>) -> Self {
        Self::from_cols(
            vec3(T::ZERO, v.z, -v.y),
            vec3(-v.z, T::ZERO, v.x),
            vec3(v.y, -v.x, T::ZERO),
        )
    }

    /// The rank-one matrix `a b'`.
    #[inline]
    #[must_use]
    pub fn outer(a: Vec3<T>, b: Vec3<T>) -> Self {
        Self::from_cols(a * b.x, a * b.y, a * b.z)
    }

    /// The transposed matrix.
    #[inline]
    #[must_use]
    pub fn transpose(self) -> Self {
        let (x, y, z) = (self.x_axis, self.y_axis, self.z_axis);
        Self::from_cols(
            vec3(x.x, y.x, z.x),
            vec3(x.y, y.y, z.y),
            vec3(x.z, y.z, z.z),
        )
    }

    /// `M' v`, without forming the transpose.
    #[inline]
    #[must_use]
    pub fn transpose_mul(self, v: Vec3<T>) -> Vec3<T> {
        vec3(self.x_axis.dot(v), self.y_axis.dot(v), self.z_axis.dot(v))
    }
}

impl<T: Number> Mul<Vec3<T>> for Mat3<T> {
    type Output = Vec3<T>;
    #[inline]
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        self.x_axis * v.x + self.y_axis * v.y + self.z_axis * v.z
    }
}

impl<T: Number> Mul for Mat3<T> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        Self::from_cols(self * rhs.x_axis, self * rhs.y_axis, self * rhs.z_axis)
    }
}

impl<T: Number> Mul<T> for Mat3<T> {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: T) -> Self {
        Self::from_cols(self.x_axis * rhs, self.y_axis * rhs, self.z_axis * rhs)
    }
}

impl<T: Number> Add for Mat3<T> {
    type Output = Self;
    #[inline]
    fn add(self, rhs: Self) -> Self {
        Self::from_cols(
            self.x_axis + rhs.x_axis,
            self.y_axis + rhs.y_axis,
            self.z_axis + rhs.z_axis,
        )
    }
}

impl<T: Number> Sub for Mat3<T> {
    type Output = Self;
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        Self::from_cols(
            self.x_axis - rhs.x_axis,
            self.y_axis - rhs.y_axis,
            self.z_axis - rhs.z_axis,
        )
    }
}

/// A symmetric 3 x 3 matrix: its six distinct entries.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sym3<T> {
    /// Entry (1,1).
    pub xx: T,
    /// Entry (2,2).
    pub yy: T,
    /// Entry (3,3).
    pub zz: T,
    /// Entries (1,2) and (2,1).
    pub xy: T,
    /// Entries (1,3) and (3,1).
    pub xz: T,
    /// Entries (2,3) and (3,2).
    pub yz: T,
}

impl<T: Number> Sym3<T> {
    /// All zeros.
    pub const ZERO: Self = Self {
        xx: T::ZERO,
        yy: T::ZERO,
        zz: T::ZERO,
        xy: T::ZERO,
        xz: T::ZERO,
        yz: T::ZERO,
    };

    /// `value` times the identity.
    #[inline]
    #[must_use]
    pub fn from_diagonal(value: T) -> Self {
        Self {
            xx: value,
            yy: value,
            zz: value,
            ..Self::ZERO
        }
    }

    /// Rounds the upper triangle of a glam matrix to this precision.
    #[inline]
    #[must_use]
    pub fn from_glam(m: DMat3) -> Self {
        Self {
            xx: T::from_f64(m.x_axis.x),
            yy: T::from_f64(m.y_axis.y),
            zz: T::from_f64(m.z_axis.z),
            xy: T::from_f64(m.y_axis.x),
            xz: T::from_f64(m.z_axis.x),
            yz: T::from_f64(m.z_axis.y),
        }
    }

    /// Applies a function to every entry.
    #[inline]
    #[must_use]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Sym3<U> {
        Sym3 {
            xx: f(self.xx),
            yy: f(self.yy),
            zz: f(self.zz),
            xy: f(self.xy),
            xz: f(self.xz),
            yz: f(self.yz),
        }
    }

    /// The full matrix.
    #[inline]
    #[must_use]
    pub fn to_mat3(self) -> Mat3<T> {
        Mat3::from_cols(self.col_x(), self.col_y(), self.col_z())
    }

    /// First column.
    #[inline]
    #[must_use]
    pub fn col_x(self) -> Vec3<T> {
        vec3(self.xx, self.xy, self.xz)
    }

    /// Second column.
    #[inline]
    #[must_use]
    pub fn col_y(self) -> Vec3<T> {
        vec3(self.xy, self.yy, self.yz)
    }

    /// Third column.
    #[inline]
    #[must_use]
    pub fn col_z(self) -> Vec3<T> {
        vec3(self.xz, self.yz, self.zz)
    }

    /// Sum of the diagonal entries.
    #[inline]
    #[must_use]
    pub fn trace(self) -> T {
        self.xx + self.yy + self.zz
    }

    /// The rank-one matrix `scale v v'`.
    #[inline]
    #[must_use]
    pub fn outer(v: Vec3<T>, scale: T) -> Self {
        let s = v * scale;
        Self {
            xx: s.x * v.x,
            yy: s.y * v.y,
            zz: s.z * v.z,
            xy: s.x * v.y,
            xz: s.x * v.z,
            yz: s.y * v.z,
        }
    }

    /// `-mass c~ c~`: the inertia about a point of a mass at offset `c` from it
    /// (the parallel-axis term).
    #[inline]
    #[must_use]
    pub fn parallel_axis(mass: T, c: Vec3<T>) -> Self {
        let m = c * mass;
        let (x, y, z) = (m.x * c.x, m.y * c.y, m.z * c.z);
        Self {
            xx: y + z,
            yy: x + z,
            zz: x + y,
            xy: -(m.x * c.y),
            xz: -(m.x * c.z),
            yz: -(m.y * c.z),
        }
    }

    /// `R self R'`: the same tensor in the axes that `rotation` maps to.
    #[inline]
    #[must_use]
    pub fn rotated(self, rotation: &Mat3<T>) -> Self {
        let m = *rotation * self.to_mat3();
        let r = rotation;
        // Entry (i,j) is row i of M times row j of R; both are stored by columns.
        let entry = |mi: Vec3<T>, rj: Vec3<T>| mi.dot(rj);
        let (m1, m2, m3) = rows(&m);
        let (r1, r2, r3) = rows(r);
        Self {
            xx: entry(m1, r1),
            yy: entry(m2, r2),
            zz: entry(m3, r3),
            xy: entry(m1, r2),
            xz: entry(m1, r3),
            yz: entry(m2, r3),
        }
    }
}

#[inline]
fn rows<T: Number>(m: &Mat3<T>) -> (Vec3<T>, Vec3<T>, Vec3<T>) {
    let t = m.transpose();
    (t.x_axis, t.y_axis, t.z_axis)
}

impl<T: Number> Mul<Vec3<T>> for Sym3<T> {
    type Output = Vec3<T>;
    #[inline]
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        vec3(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }
}

impl<T: Number> Add for Sym3<T> {
    type Output = Self;
    #[inline]
    fn add(self, rhs: Self) -> Self {
        Self {
            xx: self.xx + rhs.xx,
            yy: self.yy + rhs.yy,
            zz: self.zz + rhs.zz,
            xy: self.xy + rhs.xy,
            xz: self.xz + rhs.xz,
            yz: self.yz + rhs.yz,
        }
    }
}

impl<T: Number> AddAssign for Sym3<T> {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl<T: Number> Sub for Sym3<T> {
    type Output = Self;
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        Self {
            xx: self.xx - rhs.xx,
            yy: self.yy - rhs.yy,
            zz: self.zz - rhs.zz,
            xy: self.xy - rhs.xy,
            xz: self.xz - rhs.xz,
            yz: self.yz - rhs.yz,
        }
    }
}
