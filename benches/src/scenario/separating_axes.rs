//! The test of separating axes, over any kind of number: in floating point the baseline of many
//! collision libraries, in integers an oracle.
//!
//! Two convex bodies are disjoint iff some plane separates them; of two triangles it can be chosen
//! normal to one of 17 axes: the two normals, the nine products of edges, and, for triangles of one
//! plane, the normals of the six edges within it (S. Gottschalk, M. C. Lin, D. Manocha, "OBBTree: a
//! hierarchical structure for rapid interference detection", SIGGRAPH 1996, for boxes). Signs of
//! polynomials of degree up to six in the coordinates decide, so that integers make it exact for
//! triangles that have an area. It shares nothing with the exact test of `vertebra::collision`.

use num_bigint::BigInt;
use std::array::from_fn;
use std::ops::{Add, Mul, Sub};
use vertebra::glam::Vec3;

/// What the test computes with.
pub trait Number:
    Clone + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
}

impl<T> Number for T where
    T: Clone + PartialOrd + Add<Output = T> + Sub<Output = T> + Mul<Output = T>
{
}

/// A vector, or a point.
pub(super) type Vector<T> = [T; 3];

pub(super) fn minus<T: Number>(a: &Vector<T>, b: &Vector<T>) -> Vector<T> {
    from_fn(|k| a[k].clone() - b[k].clone())
}

pub(super) fn dot<T: Number>(a: &Vector<T>, b: &Vector<T>) -> T {
    let [x, y, z] = from_fn(|k| a[k].clone() * b[k].clone());
    x + y + z
}

pub(super) fn cross<T: Number>(a: &Vector<T>, b: &Vector<T>) -> Vector<T> {
    from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i].clone() * b[j].clone() - a[j].clone() * b[i].clone()
    })
}

/// Whether the closed triangles meet, as far as these numbers can tell.
#[inline]
pub fn triangles_meet<T: Number>(a: &[Vector<T>; 3], b: &[Vector<T>; 3]) -> bool {
    // From a corner of A, so that an offset of both cancels first.
    let origin = &a[0];
    let [a, b] = [a, b].map(|t| -> [Vector<T>; 3] { from_fn(|k| minus(&t[k], origin)) });
    let edges =
        |t: &[Vector<T>; 3]| -> [Vector<T>; 3] { from_fn(|k| minus(&t[(k + 1) % 3], &t[k])) };
    let (edges_a, edges_b) = (edges(&a), edges(&b));
    let normals = [&edges_a, &edges_b].map(|e| cross(&e[0], &e[1]));
    let separates = |axis: &Vector<T>| {
        let (low_a, high_a) = extent(&a, axis);
        let (low_b, high_b) = extent(&b, axis);
        high_a < low_b || high_b < low_a
    };
    let within = |normal: &Vector<T>, edges: &[Vector<T>; 3]| {
        edges.iter().any(|edge| separates(&cross(normal, edge)))
    };
    let separated = normals.iter().any(separates)
        || edges_a
            .iter()
            .any(|e| edges_b.iter().any(|f| separates(&cross(e, f))))
        || within(&normals[0], &edges_a)
        || within(&normals[1], &edges_b);
    !separated
}

/// Least and greatest position of the corners along an axis.
fn extent<T: Number>(triangle: &[Vector<T>; 3], axis: &Vector<T>) -> (T, T) {
    let [mut low, q, r] = triangle.each_ref().map(|p| dot(p, axis));
    let mut high = low.clone();
    for position in [q, r] {
        if position < low {
            low = position;
        } else if position > high {
            high = position;
        }
    }
    (low, high)
}

/// What integers say of two triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    /// A triangle has no area: the test says nothing of it.
    ZeroArea,
    /// They share a plane; whether they meet.
    Coplanar(bool),
    /// Whether they meet.
    General(bool),
}

impl Truth {
    /// What integers say of these triangles, coordinates finite.
    #[must_use]
    pub fn of(triangles: &[[Vec3; 3]; 2]) -> Self {
        let lowest = lowest_exponent(triangles);
        let [a, b] = triangles.map(|t| t.map(|p| p.to_array().map(|x| integer(x, lowest))));
        let zero = BigInt::ZERO;
        let normal = |t: &[Vector<BigInt>; 3]| cross(&minus(&t[1], &t[0]), &minus(&t[2], &t[0]));
        let normals = [normal(&a), normal(&b)];
        if normals.iter().any(|n| n.iter().all(|x| *x == zero)) {
            return Self::ZeroArea;
        }
        let meet = triangles_meet(&a, &b);
        let in_plane = b.iter().all(|p| dot(&normals[0], &minus(p, &a[0])) == zero);
        if in_plane {
            Self::Coplanar(meet)
        } else {
            Self::General(meet)
        }
    }
}

/// The exponent of which all coordinates are multiples.
pub(super) fn lowest_exponent(triangles: &[[Vec3; 3]; 2]) -> i32 {
    let coordinates = triangles.iter().flatten().flat_map(|p| p.to_array());
    coordinates.map(|x| parts(x).1).min().unwrap_or(0)
}

/// Significand and exponent of a finite number: x = significand 2^exponent.
fn parts(x: f32) -> (i32, i32) {
    let bits = x.to_bits();
    let exponent = (bits >> 23 & 0xff).cast_signed();
    let fraction = (bits & 0x007f_ffff).cast_signed();
    let hidden = i32::from(exponent > 0) << 23;
    let sign = if bits >> 31 == 0 { 1 } else { -1 };
    (sign * (fraction | hidden), exponent.max(1) - 150)
}

/// The number in units of 2^lowest, which is no more than its exponent.
pub(super) fn integer(x: f32, lowest: i32) -> BigInt {
    let (significand, exponent) = parts(x);
    BigInt::from(significand) << (exponent - lowest).unsigned_abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra::Random;
    use vertebra::collision::exact;

    #[test]
    fn numbers_are_taken_apart_exactly() {
        for x in [
            0.0,
            -0.0,
            1.0,
            -0.1,
            3.4e38,
            1e-45,
            -1e-40,
            f32::MIN_POSITIVE,
        ] {
            let (significand, exponent) = parts(x);
            assert_eq!(
                f64::from(significand) * f64::from(exponent).exp2(),
                f64::from(x)
            );
        }
        assert_eq!(integer(1.5, -25), BigInt::from(3 << 24));
        assert_eq!(integer(-4.0, -23), BigInt::from(-(4 << 23)));
    }

    /// Two exact tests without a line in common, on corners of a coarse grid: about a third of the
    /// pairs touch, share a plane, or have no area.
    #[test]
    fn integers_agree_with_the_exact_test() {
        let mut random = Random::new(3);
        let mut counts = [0; 5];
        for _ in 0..6000 {
            #[expect(clippy::cast_precision_loss, reason = "at most four places")]
            let mut place = |count| random.below(count) as f32 * 0.1;
            let triangles: [[Vec3; 3]; 2] =
                from_fn(|_| from_fn(|_| Vec3::new(place(4), place(4), place(2))));
            let [a, b] = triangles.map(|t| t.map(Vec3::as_dvec3));
            let found = exact::triangles_intersect(&a, &b);
            match Truth::of(&triangles) {
                Truth::ZeroArea => counts[4] += 1,
                Truth::Coplanar(meet) => {
                    assert_eq!(meet, found, "{triangles:?}");
                    counts[usize::from(meet)] += 1;
                }
                Truth::General(meet) => {
                    assert_eq!(meet, found, "{triangles:?}");
                    counts[2 + usize::from(meet)] += 1;
                }
            }
        }
        assert!(counts.iter().all(|count| *count >= 10), "{counts:?}");
    }
}
