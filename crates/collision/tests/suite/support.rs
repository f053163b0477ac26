//! The oracle, and what several tests share.
use std::path::PathBuf;

use glam::{DVec3, Vec3};
use num_bigint::BigInt;
use num_traits::{FromPrimitive, Signed};
use vertebra_collision::TriangleMesh;

pub(crate) type Triangle = [DVec3; 3];

/// Whether the hulls of two vertex triples share a point, in exact arithmetic and without any case analysis.
///
/// Weights l >= 0 and m >= 0 with sum 1 each and sum l a = sum m b exist iff phase 1 of the simplex method drives the
/// artificial variables of these five equations in six unknowns to zero. Bland's rule makes it end; pivots are free of
/// fractions (Edmonds: every entry is a minor of the input, so the division by the previous pivot leaves no rest).
pub(crate) fn hulls_meet<T: Clone + Ord + Signed>(a: [[T; 3]; 3], b: [[T; 3]; 3]) -> bool {
    let (zero, one) = (T::zero(), T::one());
    let mut rows: Vec<Vec<T>> = (0..3)
        .map(|k| {
            let left = a.iter().map(|p| p[k].clone());
            let right = b.iter().map(|p| -p[k].clone());
            left.chain(right).chain([zero.clone()]).collect()
        })
        .collect();
    for kind in 0..2 {
        let weight = |column: usize| {
            if column / 3 == kind {
                one.clone()
            } else {
                zero.clone()
            }
        };
        rows.push((0..6).map(weight).chain([one.clone()]).collect());
    }
    let objective: Vec<T> = (0..7)
        .map(|c| {
            rows.iter()
                .fold(zero.clone(), |sum, row| sum + row[c].clone())
        })
        .collect();
    rows.push(objective);
    let mut basis: Vec<usize> = (6..11).collect();
    let mut previous = one;
    while let Some(column) = (0..6).find(|&c| rows[5][c].is_positive()) {
        let pivot_row = (0..5)
            .filter(|&r| rows[r][column].is_positive())
            .min_by(|&r, &s| {
                let left = rows[r][6].clone() * rows[s][column].clone();
                let right = rows[s][6].clone() * rows[r][column].clone();
                left.cmp(&right).then(basis[r].cmp(&basis[s]))
            })
            .expect("the sum of the artificial variables is bounded below");
        let pivot = rows[pivot_row][column].clone();
        let pivot_entries = rows[pivot_row].clone();
        for (r, row) in rows.iter_mut().enumerate() {
            if r != pivot_row {
                let factor = row[column].clone();
                for (entry, p) in row.iter_mut().zip(&pivot_entries) {
                    let product = entry.clone() * pivot.clone() - factor.clone() * p.clone();
                    *entry = product / previous.clone();
                }
            }
        }
        basis[pivot_row] = column;
        previous = pivot;
    }
    rows[5][6].is_zero()
}

/// The oracle on `f64` points, scaled to integers by a power of two.
pub(crate) fn oracle(a: &Triangle, b: &Triangle) -> bool {
    let lowest = a
        .iter()
        .chain(b)
        .flat_map(|p| p.to_array())
        .filter(|&x| x != 0.0)
        .map(|x| decompose(x).1)
        .min()
        .unwrap_or(0);
    let integer = |x: f64| {
        let (mantissa, exponent) = decompose(x);
        let shift = if x == 0.0 { 0 } else { exponent - lowest };
        BigInt::from_i64(mantissa).unwrap() << shift
    };
    hulls_meet(
        a.map(|p| p.to_array().map(integer)),
        b.map(|p| p.to_array().map(integer)),
    )
}

/// Mantissa and exponent of a finite number, the mantissa odd unless zero.
pub(crate) fn decompose(x: f64) -> (i64, i32) {
    if x == 0.0 {
        return (0, 0);
    }
    let bits = x.to_bits();
    let biased = ((bits >> 52) & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (mantissa, exponent) = if biased == 0 {
        (fraction, -1074)
    } else {
        (fraction | (1 << 52), biased - 1075)
    };
    let zeros = mantissa.trailing_zeros();
    let magnitude = mantissa >> zeros;
    let signed = if x < 0.0 { -magnitude } else { magnitude };
    (signed, exponent + zeros as i32)
}

/// A seeded source of numbers for tests.
pub(crate) struct Random(oorandom::Rand64);

impl Random {
    pub(crate) fn new(seed: u128) -> Self {
        Self(oorandom::Rand64::new(seed))
    }

    /// An integer in low..=high.
    pub(crate) fn int(&mut self, low: i64, high: i64) -> i64 {
        self.0.rand_range(0..(high - low + 1) as u64) as i64 + low
    }

    /// A number in [-1, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        2.0 * self.0.rand_float() - 1.0
    }

    pub(crate) fn lattice(&mut self, low: i64, high: i64) -> DVec3 {
        DVec3::from([(); 3].map(|()| self.int(low, high) as f64))
    }

    pub(crate) fn lattice_triangle(&mut self, low: i64, high: i64) -> Triangle {
        [(); 3].map(|()| self.lattice(low, high))
    }

    /// A point of the unit cube in `f32`.
    pub(crate) fn point(&mut self) -> Vec3 {
        Vec3::from([(); 3].map(|()| self.unit() as f32))
    }
}

/// Moves a coordinate by so many steps of `f32`.
pub(crate) fn step_f32(x: f64, steps: i64) -> f64 {
    let mut x = x as f32;
    for _ in 0..steps.abs() {
        x = if steps > 0 {
            x.next_up()
        } else {
            x.next_down()
        };
    }
    f64::from(x)
}

/// The six orders of three things.
pub(crate) const ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [0, 2, 1],
    [2, 1, 0],
    [1, 0, 2],
];

pub(crate) fn gold_path(name: &str) -> PathBuf {
    PathBuf::from(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../benches/gold/meshes"
    ))
    .join(name)
}

pub(crate) fn gold_mesh(name: &str) -> TriangleMesh {
    TriangleMesh::read(gold_path(&format!("{name}.obj"))).unwrap()
}

/// An exact number.
pub(crate) type Rational = num_rational::Ratio<BigInt>;

pub(crate) fn rational(x: f64) -> Rational {
    let (mantissa, exponent) = decompose(x);
    let power = BigInt::from(1) << exponent.unsigned_abs();
    let mantissa = BigInt::from(mantissa);
    if exponent < 0 {
        Rational::new(mantissa, power)
    } else {
        Rational::from_integer(mantissa * power)
    }
}

/// A point of exact coordinates.
pub(crate) type Exact = [Rational; 3];

pub(crate) fn exact(p: DVec3) -> Exact {
    p.to_array().map(rational)
}

pub(crate) fn minus(p: &Exact, q: &Exact) -> Exact {
    [0, 1, 2].map(|k| &p[k] - &q[k])
}

pub(crate) fn dot(p: &Exact, q: &Exact) -> Rational {
    &p[0] * &q[0] + &p[1] * &q[1] + &p[2] * &q[2]
}

pub(crate) fn cross(p: &Exact, q: &Exact) -> Exact {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &p[i] * &q[j] - &p[j] * &q[i])
}

/// p + (q - p) t.
pub(crate) fn between(p: &Exact, q: &Exact, t: &Rational) -> Exact {
    [0, 1, 2].map(|k| &p[k] + (&q[k] - &p[k]) * t)
}

/// The same triangles with three vertices of their own each.
pub(crate) fn exploded(mesh: &TriangleMesh) -> TriangleMesh {
    let vertices = (0..mesh.len()).flat_map(|i| mesh.triangle(i)).collect();
    let triangles = (0..mesh.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(vertices, triangles.collect()).unwrap()
}

/// A box as a closed mesh of twelve triangles, counter-clockwise from outside.
pub(crate) fn cuboid(min: Vec3, max: Vec3) -> TriangleMesh {
    let corner = |i: usize| {
        let pick = |k: usize| if i >> k & 1 == 1 { max[k] } else { min[k] };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    TriangleMesh::new((0..8).map(corner).collect(), triangles.collect()).unwrap()
}

/// The corners of all triangles, wide.
pub(crate) fn wide(mesh: &TriangleMesh) -> Vec<Triangle> {
    (0..mesh.len())
        .map(|i| mesh.triangle(i).map(|v| v.as_dvec3()))
        .collect()
}
