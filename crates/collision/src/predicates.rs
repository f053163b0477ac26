//! Exact orientation signs of `f64` points: a filter in plain `f64`, and expansions for what it leaves.
//!
//! The expansions of Shewchuk (Adaptive precision floating-point arithmetic and fast robust geometric predicates,
//! Discrete & Computational Geometry 18, 1997), as the `robust` crate has them, are exact as long as no intermediate
//! result under- or overflows. Every intermediate of `orient3d` is a sum of products of three coordinate differences,
//! so it suffices that
//!
//! * every coordinate is zero or at least 2^-250: then each is a multiple of 2^-302, every product of three
//!   differences a multiple of 2^-906, and the error bound of the floating-point filter (2^-51 times their sum) stays
//!   a normal number;
//! * every coordinate is below 2^331: differences are below 2^332, the determinant below 6 · 2^996, and the splitting
//!   of a product of two (times 2^27 + 1) below 2^693, all within range.
//!
//! `f32` coordinates, multiples of 2^-149 below 2^128, always qualify. Posed ones are zero or at least 2^-401 and
//! below 2^131 ([`crate::transform`]): if one of the twelve is below 2^-250, all are multiplied by 2^200 first, which
//! is exact and brings them to [2^-201, 2^331). The products of two of `orient2d` are multiples of 2^-906 even so.

use glam::{DVec2, DVec3};
use robust::{Coord, Coord3D};

/// The sign of a determinant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    Negative,
    Zero,
    Positive,
}

impl Sign {
    fn of(value: f64) -> Self {
        if value > 0.0 {
            Self::Positive
        } else if value < 0.0 {
            Self::Negative
        } else {
            Self::Zero
        }
    }

    /// The sign, or its opposite if not `positive`.
    pub(crate) fn times(self, positive: bool) -> Self {
        if positive { self } else { self.opposite() }
    }

    pub(crate) fn opposite(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Zero => Self::Zero,
            Self::Positive => Self::Negative,
        }
    }
}

/// Whether all signs are one and the same strict sign.
pub(crate) fn strictly_one_side<const N: usize>(signs: [Sign; N]) -> bool {
    signs == [Sign::Positive; N] || signs == [Sign::Negative; N]
}

/// The sides of a triangle's three corners against a plane, as bits, so that no branch depends on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sides {
    /// A bit for each corner strictly on the positive side, corner 0 lowest.
    pub(crate) positive: u32,
    /// A bit for each corner strictly on the negative side.
    pub(crate) negative: u32,
}

impl Sides {
    const ALL: u32 = 0b111;

    pub(crate) fn strictly_one(self) -> bool {
        (self.positive == Self::ALL) | (self.negative == Self::ALL)
    }

    pub(crate) fn strictly_both(self) -> bool {
        (self.positive != 0) & (self.negative != 0)
    }
}

/// Relative error of the filter, in units of the permanent: 16 roundings.
///
/// Each of the six products of three differences, n·w written out, goes through at most 8 roundings (3 differences, 2
/// products, 1 difference of minors, 2 sums), so the determinant is off by at most ((1+u)^8 - 1) times the exact
/// permanent, u = 2^-53; the computed permanent falls short of the exact one by a factor of at most (1-u)^8, and its
/// product with this constant is rounded once more. Together that is less than 9 u.
const RELATIVE: f64 = 8.0 * f64::EPSILON;

/// Absolute error of the filter: what gradual underflow can add, 6 products of two, each off by 2^-1075, times a
/// third factor below 2^333.
const ABSOLUTE: f64 = f64::from_bits((1023 - 730) << 52);

/// Coordinates smaller than this are scaled before expansions.
const SMALLEST_UNSCALED: f64 = f64::from_bits((1023 - 250) << 52);

/// The power of two by which they are multiplied.
const SCALE: f64 = f64::from_bits((1023 + 200) << 52);

/// The plane through three points, ready to be asked on which side others lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    points: [DVec3; 3],
    /// (b - a) x (c - a), rounded.
    normal: DVec3,
    /// The same with all products and differences taken as sums of magnitudes.
    permanent: DVec3,
}

impl Plane {
    #[inline]
    pub(crate) fn through([a, b, c]: [DVec3; 3]) -> Self {
        let (u, v) = (b - a, c - a);
        let (left, right) = (
            DVec3::new(u.y * v.z, u.z * v.x, u.x * v.y),
            DVec3::new(u.z * v.y, u.x * v.z, u.y * v.x),
        );
        Self {
            points: [a, b, c],
            normal: left - right,
            permanent: left.abs() + right.abs(),
        }
    }

    /// The determinant det(b - a, c - a, p - a), and what it is off by at most; both rounded.
    #[inline]
    fn determinant(&self, p: DVec3) -> (f64, f64) {
        let w = p - self.points[0];
        let bound = self.permanent.dot(w.abs()) * RELATIVE + ABSOLUTE;
        (self.normal.dot(w), bound)
    }

    #[cold]
    fn exact_side(&self, p: DVec3, exact: &mut u32) -> Sign {
        *exact += 1;
        let [a, b, c] = self.points;
        // Planes and points of one coordinate, and points in common, need no expansion. Products of two differences do
        // not underflow, so what is zero here has a factor that is.
        let w = p - a;
        if (0..3).all(|k| self.permanent[k] == 0.0 || w[k] == 0.0) {
            return Sign::Zero;
        }
        exact_orient3d([a, b, c, p])
    }

    /// On which side of the plane the point lies: the sign of det(b - a, c - a, p - a). All points have the sign zero
    /// if a, b and c are collinear.
    ///
    /// Counts in `exact` the signs that the filter leaves to expansions.
    #[inline]
    pub(crate) fn side(&self, p: DVec3, exact: &mut u32) -> Sign {
        let (determinant, bound) = self.determinant(p);
        if determinant.abs() > bound {
            Sign::of(determinant)
        } else {
            self.exact_side(p, exact)
        }
    }

    /// The sides of a triangle's corners.
    #[inline]
    pub(crate) fn sides(&self, corners: &[DVec3; 3], exact: &mut u32) -> Sides {
        let computed = corners.map(|p| self.determinant(p));
        let mut sides = Sides {
            positive: 0,
            negative: 0,
        };
        for (corner, (determinant, bound)) in computed.iter().enumerate() {
            sides.positive |= u32::from(determinant > bound) << corner;
            sides.negative |= u32::from(*determinant < -bound) << corner;
        }
        let mut left = Sides::ALL & !(sides.positive | sides.negative);
        while left != 0 {
            let corner = left.trailing_zeros();
            left &= left - 1;
            match self.exact_side(corners[corner as usize], exact) {
                Sign::Positive => sides.positive |= 1 << corner,
                Sign::Negative => sides.negative |= 1 << corner,
                Sign::Zero => {}
            }
        }
        sides
    }
}

/// On which side of the plane through `a`, `b`, `c` the point `d` lies: the sign of det(b - a, c - a, d - a).
pub(crate) fn orient3d(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Sign {
    orient3d_counted([a, b, c, d], &mut 0)
}

/// The same, counting in `exact` if the filter leaves it to expansions.
pub(crate) fn orient3d_counted([a, b, c, d]: [DVec3; 4], exact: &mut u32) -> Sign {
    Plane::through([a, b, c]).side(d, exact)
}

#[cold]
fn exact_orient3d(points: [DVec3; 4]) -> Sign {
    let tiny = |c: f64| c != 0.0 && c.abs() < SMALLEST_UNSCALED;
    let any_tiny = points.iter().any(|p| tiny(p.x) || tiny(p.y) || tiny(p.z));
    let points = if any_tiny {
        points.map(|p| p * SCALE)
    } else {
        points
    };
    let [a, b, c, d] = points.map(|p| Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    });
    // Their sign convention is the opposite one.
    Sign::of(robust::orient3d(a, b, c, d)).opposite()
}

/// On which side of the line from `a` to `b` the point `c` lies; positive is to the left.
pub(crate) fn orient2d(a: DVec2, b: DVec2, c: DVec2) -> Sign {
    orient2d_counted([a, b, c], &mut 0)
}

/// The same, counting in `exact` if the filter leaves it to expansions.
///
/// The filter is Shewchuk's: 3 u + 16 u^2, u = 2^-53, times the sum of the magnitudes of both products; 4 u is more.
pub(crate) fn orient2d_counted([a, b, c]: [DVec2; 3], exact: &mut u32) -> Sign {
    let (u, v) = (a - c, b - c);
    let (left, right) = (u.x * v.y, u.y * v.x);
    let determinant = left - right;
    if determinant.abs() > 2.0 * f64::EPSILON * (left.abs() + right.abs()) {
        return Sign::of(determinant);
    }
    *exact += 1;
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    Sign::of(robust::orient2d(coord(a), coord(b), coord(c)))
}

/// A coordinate axis to project along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// An axis along which the triangle's projection has an area, hence along which its plane projects one to one;
    /// none if the triangle has zero area.
    ///
    /// The choice is exact. A choice by the largest component of a rounded normal may take an axis along which a
    /// sliver vanishes.
    pub(crate) fn of_plane(triangle: &[DVec3; 3]) -> Option<Self> {
        Self::of_plane_counted(triangle, &mut 0)
    }

    /// The same, counting in `exact` the signs that the filter leaves to expansions.
    pub(crate) fn of_plane_counted(triangle: &[DVec3; 3], exact: &mut u32) -> Option<Self> {
        [Self::Z, Self::X, Self::Y].into_iter().find(|axis| {
            let corners = triangle.map(|p| axis.project(p));
            orient2d_counted(corners, exact) != Sign::Zero
        })
    }

    /// The axis along which a vector is longest.
    pub(crate) fn most_along(vector: DVec3) -> Self {
        let [x, y, z] = vector.abs().to_array();
        if z >= x && z >= y {
            Self::Z
        } else if x >= y {
            Self::X
        } else {
            Self::Y
        }
    }

    pub(crate) fn project(self, p: DVec3) -> DVec2 {
        match self {
            Self::X => DVec2::new(p.y, p.z),
            Self::Y => DVec2::new(p.z, p.x),
            Self::Z => DVec2::new(p.x, p.y),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_resolve_one_ulp() {
        let [a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let far = DVec3::new(1e6, -1e6, 0.0);
        assert_eq!(orient3d(a, b, c, far), Sign::Zero);
        let above = orient3d(a, b, c, far + DVec3::Z * f64::EPSILON);
        let below = orient3d(a, b, c, far - DVec3::Z * f64::EPSILON);
        assert_eq!(above, below.opposite());
        assert_ne!(above, Sign::Zero);
    }

    #[test]
    fn plane_axis_of_a_sliver_and_of_zero_area() {
        let sliver = [
            DVec3::ZERO,
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::new(2.0, 2.0, 2.0 + 4.0 * f64::EPSILON),
        ];
        assert_eq!(Axis::of_plane(&sliver), Some(Axis::X));
        let line = [DVec3::ZERO, DVec3::ONE, DVec3::ONE * 3.0];
        assert_eq!(Axis::of_plane(&line), None);
        assert_eq!(Axis::of_plane(&[DVec3::ONE; 3]), None);
    }

    #[test]
    fn products_at_the_ends_of_the_documented_range() {
        for exponent in [-250, 330] {
            let size = 2.0_f64.powi(exponent);
            let [a, b, c] = [DVec3::ZERO, DVec3::X * size, DVec3::Y * size];
            let d = DVec3::new(0.25, 0.25, 0.0) * size;
            assert_eq!(orient3d(a, b, c, d), Sign::Zero);
            let above = orient3d(a, b, c, d + DVec3::Z * size);
            assert_ne!(above, Sign::Zero, "2^{exponent}");
            assert_eq!(orient3d(a, b, c, d - DVec3::Z * size), above.opposite());
        }
    }
}
