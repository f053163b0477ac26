//! Coordinates of the points where sides pass through triangles and cross each other, with bounds on their errors.
//!
//! Computed in double-double arithmetic, unit roundoff u = 2^-53 and a few u^2 an operation, and rounded once: unless
//! triangles are so thin or so nearly parallel that 100 bits do not resolve them, the error is that of the rounding.
//! Where they are, the bound says so; it never exceeds the length of the side, since the point is on it.

use glam::DVec3;
use vertebra_spatial::{DoubleDouble, Number, Real, Vec3};

type Wide = Vec3<DoubleDouble>;

/// u^2.
const ROUNDOFF: f64 = f64::EPSILON * f64::EPSILON / 4.0;

/// A point and how far it may be from the exact one \[m].
pub(crate) type Computed = (DVec3, f64);

/// p - q, exactly.
fn difference(p: DVec3, q: DVec3) -> Wide {
    let k = |k: usize| DoubleDouble::from_sum(p[k], -q[k]);
    vertebra_spatial::vec3(k(0), k(1), k(2))
}

fn largest(v: Wide) -> f64 {
    v.to_glam().abs().max_element()
}

/// The power of two that brings a positive number into [1/2, 1), or 1 for zero.
pub(crate) fn to_unit(size: f64) -> f64 {
    if size > 0.0 {
        let exponent = (size.to_bits() >> 52).min(2045);
        // The exponents of a number and of its reciprocal power of two add up to twice the bias, less one.
        f64::from_bits((2045 - exponent) << 52)
    } else {
        1.0
    }
}

/// The vector in units of that power of two, which is exact.
fn unit(v: Wide) -> (Wide, f64) {
    let factor = to_unit(largest(v));
    (v * DoubleDouble::from_f64(factor), factor)
}

/// The point of the segment pq at the parameter t, which is off by at most `error`.
fn on_segment([p, q]: [DVec3; 2], t: DoubleDouble, error: f64) -> Computed {
    let (t, error) = if error < 0.5 && t.is_finite() {
        let (zero, one) = (DoubleDouble::ZERO, DoubleDouble::ONE);
        let t = if t < zero { zero } else { t };
        (if one < t { one } else { t }, error)
    } else {
        (DoubleDouble::HALF, 0.5)
    };
    let along = difference(q, p);
    let point = (Wide::from_glam(p) + along * t).to_glam();
    // Two operations of a few u^2 on each coordinate, and one rounding of u: the length of three such is below 2 u.
    let sizes = point.abs().max_element() + f64::EPSILON * p.abs().max_element();
    let length = along.to_glam().length();
    (
        point,
        length * (error + 64.0 * ROUNDOFF) + f64::EPSILON * sizes,
    )
}

/// Where the segment pq, its ends strictly on either side, meets the plane through a, b and c.
///
/// With u and v the vectors from a to b and to c, n = u x v and d(x) = n . (x - a), it is at t = d(p) / (d(p) - d(q)).
/// In units in which u, v, n, p - a and q - a are at most 1, n is off by 16 u^2 times the factor f of its unit, hence
/// d by 3 (16 f + 12) u^2 at most; and t by that over |d(p)| + |d(q)|.
pub(crate) fn through_plane([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> Computed {
    let (u, v) = (unit(difference(b, a)).0, unit(difference(c, a)).0);
    let (normal, factor) = unit(u.cross(v));
    let (from, to) = (difference(p, a), difference(q, a));
    let scale = DoubleDouble::from_f64(to_unit(largest(from).max(largest(to))));
    let (from, to) = (normal.dot(from * scale), normal.dot(to * scale));
    let off = (48.0 * factor + 36.0) * ROUNDOFF;
    let span = from - to;
    let least = span.to_f64().abs() - 2.0 * off;
    let error = if least > 0.0 {
        off / least
    } else {
        f64::INFINITY
    };
    on_segment([p, q], from / span, error)
}

/// Where the segment pq crosses rs, which lies in a plane with it.
///
/// With e, h and w the vectors from p to q, from r to s and from p to r, and n = e x h, it is at
/// t = n . (w x h) / n . (e x h). In units in which e and h are at most 1 (the same for e and w, m = max(1, |w|)), and
/// n too, by the factor f, products are off by 16 u^2 (16 m u^2 with w) and n by 16 f u^2: so the numerator by
/// m (150 + 100 f) u^2 and the denominator by 150 u^2 at most.
pub(crate) fn of_sides([p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> Computed {
    let (along, scale) = unit(difference(q, p));
    let (other, _) = unit(difference(s, r));
    let from = difference(r, p) * DoubleDouble::from_f64(scale);
    let product = along.cross(other);
    let (normal, factor) = unit(product);
    let (numerator, denominator) = (normal.dot(from.cross(other)), normal.dot(product));
    let size = largest(from).max(1.0);
    let least = denominator.to_f64() - 150.0 * ROUNDOFF;
    let off = size * (300.0 + 100.0 * factor) * ROUNDOFF;
    let error = if least > 0.0 {
        off / least
    } else {
        f64::INFINITY
    };
    on_segment([p, q], numerator / denominator, error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_powers_of_two() {
        for size in [1.0, 0.75, 3.0, 1e-300, 1e130, 2.0_f64.powi(-401)] {
            let factor = to_unit(size);
            assert!((0.5..1.0).contains(&(size * factor)), "{size} {factor}");
            assert_eq!(factor.to_bits() << 12, 0);
        }
        assert_eq!(to_unit(0.0), 1.0);
    }

    /// Where the point is representable, it is the result, however thin the triangle.
    #[test]
    fn representable_points_are_found() {
        let thin = 2.0_f64.powi(-40);
        let triangle = [
            DVec3::new(-1.0, 0.0, 0.0),
            DVec3::new(1.0, 0.0, 0.0),
            DVec3::new(0.0, thin, 0.0),
        ];
        let target = DVec3::new(0.25, thin / 4.0, 0.0);
        let direction = DVec3::new(3.0, -1.0, 2.0);
        let (point, error) =
            through_plane([target - direction, target + direction * 3.0], triangle);
        assert!(
            (point - target).length() <= error && error < 1e-15,
            "{point} {error}"
        );
        let (point, error) = of_sides(
            [target - direction, target + direction],
            [target - DVec3::X, target + DVec3::X * 7.0],
        );
        assert!(
            (point - target).length() <= error && error < 1e-15,
            "{point} {error}"
        );
    }

    type Rational = num_rational::Ratio<num_bigint::BigInt>;

    fn rational(x: f64) -> Rational {
        let (mantissa, exponent, sign) = num_traits::Float::integer_decode(x);
        let mantissa = num_bigint::BigInt::from(mantissa) * sign;
        let power = num_bigint::BigInt::from(1) << exponent.unsigned_abs();
        if exponent < 0 {
            Rational::new(mantissa, power)
        } else {
            Rational::from_integer(mantissa * power)
        }
    }

    /// Triangles as thin as `f64` allows, cut by sides nearly in their planes: what the arithmetic does not resolve is in
    /// the bound.
    #[test]
    fn bounds_hold_where_the_arithmetic_does_not_resolve() {
        let exact = |p: DVec3| p.to_array().map(rational);
        let minus = |p: &[Rational; 3], q: &[Rational; 3]| [0, 1, 2].map(|k| &p[k] - &q[k]);
        let det = |p: [[Rational; 3]; 3]| {
            let minor = |i: usize, j: usize| &p[1][i] * &p[2][j] - &p[1][j] * &p[2][i];
            &p[0][0] * minor(1, 2) + &p[0][1] * minor(2, 0) + &p[0][2] * minor(0, 1)
        };
        let mut random = oorandom::Rand64::new(4);
        let (mut checked, mut loose) = (0, 0);
        for _ in 0..20_000 {
            let mut point = || DVec3::from([(); 3].map(|()| random.rand_float() - 0.5));
            let (a, along) = (point(), point());
            // All on a line but for rounding, and a few roundings more.
            let mut on_line = |t: f64| a + along * t + point() * (2.0_f64.powi(-50));
            let [b, c, p, q] = [0.7, 1.9, 0.4, 1.3].map(&mut on_line);
            let corners = [a, b, c].map(exact);
            let height = |x: DVec3| {
                let [u, v, w] =
                    [&corners[1], &corners[2], &exact(x)].map(|e| minus(e, &corners[0]));
                det([u, v, w])
            };
            let (from, to) = (height(p), height(q));
            if from.clone() * &to >= rational(0.0) {
                continue;
            }
            let t = &from / (&from - &to);
            let (found, error) = through_plane([p, q], [a, b, c]);
            let (start, end) = (exact(p), exact(q));
            let off: Rational = (0..3)
                .map(|k| rational(found[k]) - (&start[k] + (&end[k] - &start[k]) * &t))
                .map(|d| &d * &d)
                .sum();
            assert!(
                off <= rational(error) * rational(error),
                "{a} {b} {c} {p} {q}"
            );
            checked += 1;
            loose += usize::from(error > 1e-14);
        }
        assert!(checked > 1000 && loose > 100, "{checked} {loose}");
    }

    /// Beyond the resolution of the arithmetic the bound is half the side, and the point is on it.
    #[test]
    fn unresolved_points_stay_on_the_side() {
        let flat = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        let (point, error) = through_plane([DVec3::NEG_Z, DVec3::Z], flat);
        assert_eq!(point, DVec3::ZERO);
        assert!((1.0..1.001).contains(&error), "{error}");
    }
}
