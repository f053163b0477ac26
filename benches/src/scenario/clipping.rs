//! In what two triangles meet, by clipping one with the other in integers: the judge of classes, curves and
//! self-collision.
//!
//! The triangle A is cut down to the plane of B and then to the inner side of each edge of B (I. E. Sutherland, G. W.
//! Hodgman, "Reentrant polygon clipping", Communications of the ACM 17(1), 1974). Points are homogeneous, four integers
//! with a positive weight, so that nothing is divided and nothing rounded. What is left are the corners of the
//! intersection; their number tells its dimension. It shares nothing with `vertebra::collision`.

use super::separating_axes::{cross, dot, integer, lowest_exponent, minus};
use num_bigint::{BigInt, Sign};
use std::array::from_fn;
use vertebra::PairClass;
use vertebra::glam::{DVec3, Vec3};

/// Three coordinates and their positive weight.
type Point = [BigInt; 4];

/// Coefficients of a function that is zero on a plane and positive on one side of it.
type Plane = [BigInt; 4];

/// The intersection of two triangles.
#[derive(Clone, Debug)]
pub struct Overlap {
    /// Its corners, each once.
    corners: Vec<Point>,
    /// Coordinates are in units of 2 to this.
    lowest: i32,
    /// What it is; none if the triangles are apart.
    pub class: Option<PairClass>,
}

impl Overlap {
    /// Of two triangles with finite corners; none if one has no area.
    #[must_use]
    pub fn of(triangles: &[[Vec3; 3]; 2]) -> Option<Self> {
        let lowest = lowest_exponent(triangles);
        let [a, b] = triangles.map(|t| t.map(|p| p.to_array().map(|x| integer(x, lowest))));
        let normal = |t: &[[BigInt; 3]; 3]| cross(&minus(&t[1], &t[0]), &minus(&t[2], &t[0]));
        let normals = [normal(&a), normal(&b)];
        if normals.iter().any(|n| n.iter().all(|x| *x == BigInt::ZERO)) {
            return None;
        }
        let through = |normal: &[BigInt; 3], point: &[BigInt; 3]| -> Plane {
            let [x, y, z] = normal.clone();
            [x, y, z, -dot(normal, point)]
        };
        let weighted = |t: &[[BigInt; 3]; 3]| {
            t.clone()
                .map(|[x, y, z]| -> Point { [x, y, z, BigInt::from(1)] })
        };
        let (plane_a, plane_b) = (through(&normals[0], &a[0]), through(&normals[1], &b[0]));
        let (a, weighted_b) = (weighted(&a), weighted(&b));
        let crossed = pierced(&plane_b, &a) && pierced(&plane_a, &weighted_b);
        let mut corners = clip(&a, &plane_b);
        corners = clip(&corners, &plane_b.map(|x| -x));
        for k in 0..3 {
            let inward = cross(&normals[1], &minus(&b[(k + 1) % 3], &b[k]));
            corners = clip(&corners, &through(&inward, &b[k]));
        }
        let mut distinct: Vec<Point> = Vec::new();
        for corner in corners {
            if !distinct.iter().any(|other| same(other, &corner)) {
                distinct.push(corner);
            }
        }
        let class = match distinct.len() {
            0 => None,
            1 => Some(PairClass::Point),
            2 if crossed => Some(PairClass::Crossing),
            2 => Some(PairClass::Touching),
            _ => Some(PairClass::Area),
        };
        Some(Self {
            corners: distinct,
            lowest,
            class,
        })
    }

    /// Its corners, each coordinate within two units in its last place \[m].
    #[must_use]
    pub fn positions(&self) -> Vec<DVec3> {
        let position = |[x, y, z, weight]: &Point| {
            let coordinate = |x: &BigInt| quotient(x, weight, self.lowest);
            DVec3::new(coordinate(x), coordinate(y), coordinate(z))
        };
        self.corners.iter().map(position).collect()
    }

    /// Whether it is more than the hull of these points, which are corners of both triangles.
    #[must_use]
    pub fn exceeds(&self, common: &[Vec3]) -> bool {
        let common: Vec<[BigInt; 3]> = common
            .iter()
            .map(|p| p.to_array().map(|x| integer(x, self.lowest)))
            .collect();
        let is_common = |corner: &Point| {
            let [x, y, z, weight] = corner;
            common
                .iter()
                .any(|p| &(&p[0] * weight) == x && &(&p[1] * weight) == y && &(&p[2] * weight) == z)
        };
        self.class == Some(PairClass::Area) || !self.corners.iter().all(is_common)
    }
}

/// x / weight, in units of 2^exponent, within two units in the last place.
fn quotient(x: &BigInt, weight: &BigInt, exponent: i32) -> f64 {
    // An integer of 71 or 72 binary digits.
    let scale = (weight.bits() + 71).saturating_sub(x.bits());
    let (sign, digits) = ((x << scale) / weight).to_u64_digits();
    let size = digits
        .iter()
        .rev()
        .fold(0.0, |size, digit| size * 2.0_f64.powi(64) + *digit as f64);
    let scale = i32::try_from(scale).unwrap_or(i32::MAX);
    let unit = f64::from(exponent.saturating_sub(scale)).exp2();
    if sign == Sign::Minus {
        -size * unit
    } else {
        size * unit
    }
}

fn value(plane: &Plane, point: &Point) -> BigInt {
    let terms = plane.iter().zip(point).map(|(a, b)| a * b);
    terms.sum()
}

/// Whether corners lie strictly on both sides of the plane.
fn pierced(plane: &Plane, corners: &[Point; 3]) -> bool {
    let signs = corners.each_ref().map(|corner| value(plane, corner).sign());
    signs.contains(&Sign::Plus) && signs.contains(&Sign::Minus)
}

/// The part of a convex polygon, of a segment or of a point that is not on the negative side.
fn clip(polygon: &[Point], plane: &Plane) -> Vec<Point> {
    let values: Vec<BigInt> = polygon.iter().map(|point| value(plane, point)).collect();
    let mut kept = Vec::new();
    for (i, point) in polygon.iter().enumerate() {
        let next = (i + 1) % polygon.len();
        let (here, there) = (&values[i], &values[next]);
        if here.sign() != Sign::Minus {
            kept.push(point.clone());
        }
        let signs = [here.sign(), there.sign()];
        if signs == [Sign::Plus, Sign::Minus] || signs == [Sign::Minus, Sign::Plus] {
            // The value of this combination is here |there| + there |here| = 0.
            let weights = (there.magnitude(), here.magnitude());
            kept.push(from_fn(|k| {
                &point[k] * BigInt::from(weights.0.clone())
                    + &polygon[next][k] * BigInt::from(weights.1.clone())
            }));
        }
    }
    kept
}

fn same(p: &Point, q: &Point) -> bool {
    (0..3).all(|k| &p[k] * &q[3] == &q[k] * &p[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra::Random;
    use vertebra::collision::exact;

    /// On corners of a coarse grid, where every class occurs.
    #[test]
    fn classes_are_those_of_the_exact_test() {
        let mut random = Random::new(4);
        let mut counts = [0; 5];
        for _ in 0..6000 {
            #[expect(clippy::cast_precision_loss, reason = "at most four places")]
            let mut place = |count| random.below(count) as f32 * 0.1;
            let triangles: [[Vec3; 3]; 2] =
                from_fn(|_| from_fn(|_| Vec3::new(place(4), place(4), place(2))));
            let Some(overlap) = Overlap::of(&triangles) else {
                continue;
            };
            let [a, b] = triangles.map(|t| t.map(Vec3::as_dvec3));
            assert_eq!(overlap.class, exact::classify(&a, &b), "{triangles:?}");
            counts[match overlap.class {
                None => 0,
                Some(PairClass::Point) => 1,
                Some(PairClass::Touching) => 2,
                Some(PairClass::Crossing) => 3,
                Some(PairClass::Area) => 4,
            }] += 1;
        }
        assert!(counts.iter().all(|count| *count >= 10), "{counts:?}");
    }

    #[test]
    fn corners_of_two_squares_halves() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::ONE - Vec3::Z].map(|p| p * 0.75);
        let half = [Vec3::ZERO, Vec3::X, Vec3::ONE - Vec3::Z];
        let overlap = Overlap::of(&[half, corners]).unwrap();
        let found = overlap.positions();
        assert_eq!(found.len(), 3);
        for corner in corners {
            assert!(found.contains(&corner.as_dvec3()), "{found:?}");
        }
        assert!(overlap.exceeds(&corners));
        // Neighbours in a corner, and a triangle through that corner.
        let above = [Vec3::ZERO, Vec3::Z, Vec3::Z + Vec3::Y];
        let touching = Overlap::of(&[half, above]).unwrap();
        assert!(!touching.exceeds(&[Vec3::ZERO]) && touching.exceeds(&[]));
    }
}
