//! Inertia of freedoms' own.

use core::ops::Range;
use vertebra_spatial::{Number, Real};

/// The inertia E that freedoms have of their own: of all of a model, or [of one joint](Self::of).
///
/// E is diagonal but for spherical joints, whose three freedoms a stop can bind: E_xy, E_xz and E_yz are `across` in
/// the places of the three.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OwnInertia<'a, T> {
    pub(crate) diagonal: &'a [T],
    pub(crate) across: &'a [T],
}

impl<T: Number> OwnInertia<'_, T> {
    /// Of some of the freedoms.
    #[inline]
    pub(crate) fn of(&self, dofs: Range<usize>) -> Self {
        Self {
            diagonal: &self.diagonal[dofs.clone()],
            across: &self.across[dofs],
        }
    }

    /// Whether a joint has none; what is positive semidefinite has something on its diagonal.
    #[inline]
    pub(crate) fn is_zero(&self) -> bool {
        self.diagonal.iter().all(|&own| own == T::ZERO)
    }

    /// Whether a joint's E has nothing off its diagonal.
    #[inline]
    pub(crate) fn is_diagonal(&self) -> bool {
        self.across.iter().all(|&own| own == T::ZERO)
    }

    /// An entry of a joint's E, whose column is not beyond its row.
    #[inline]
    pub(crate) fn entry(&self, row: usize, column: usize) -> T {
        match (row == column, self.diagonal.len()) {
            (true, _) => self.diagonal[row],
            (false, 3) => self.across[row + column - 1],
            (false, _) => T::ZERO,
        }
    }

    /// E x of a joint.
    #[inline]
    pub(crate) fn mul(&self, x: &[T]) -> [T; 6] {
        let mut product = [T::ZERO; 6];
        for ((product, &own), &x) in product.iter_mut().zip(self.diagonal).zip(x) {
            *product = own * x;
        }
        if let (&[xy, xz, yz], &[x, y, z]) = (self.across, x) {
            product[0] += xy * y + xz * z;
            product[1] += xy * x + yz * z;
            product[2] += xz * x + yz * y;
        }
        product
    }
}

impl<T: Real> OwnInertia<'_, T> {
    /// E of a spherical joint as a sum of moments about perpendicular axes: E = sum of m a a'. What rounding leaves
    /// of a moment that is zero, is zero.
    ///
    /// Jacobi's method: turning two axes by the angle t with tan 2t = 2 E_pq / (E_pp - E_qq) makes E_pq zero, and a
    /// few rounds make all of them rounding.
    pub(crate) fn principal(&self) -> [([T; 3], T); 3] {
        let mut e = [0, 1, 2].map(|k: usize| [0, 1, 2].map(|l| self.entry(k.max(l), k.min(l))));
        let mut axes = [0, 1, 2].map(|k| [0, 1, 2].map(|l| if k == l { T::ONE } else { T::ZERO }));
        for _ in 0..ROUNDS {
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                if e[p][q] == T::ZERO {
                    continue;
                }
                let ratio = (e[q][q] - e[p][p]) / (e[p][q] + e[p][q]);
                let root = (ratio * ratio + T::ONE).sqrt();
                let tangent = if ratio < T::ZERO {
                    -T::ONE / (root - ratio)
                } else {
                    T::ONE / (root + ratio)
                };
                let cosine = T::ONE / (tangent * tangent + T::ONE).sqrt();
                let sine = tangent * cosine;
                // E J, then J' (E J); axes are the columns of the product of all J.
                for row in e.iter_mut().chain(&mut axes) {
                    (row[p], row[q]) = (
                        row[p] * cosine - row[q] * sine,
                        row[p] * sine + row[q] * cosine,
                    );
                }
                for l in 0..3 {
                    (e[p][l], e[q][l]) = (
                        e[p][l] * cosine - e[q][l] * sine,
                        e[p][l] * sine + e[q][l] * cosine,
                    );
                }
            }
        }
        let trace = e[0][0] + e[1][1] + e[2][2];
        let least = T::from_f64(16.0) * T::EPSILON * trace;
        [0, 1, 2].map(|k| {
            let moment = if e[k][k] > least { e[k][k] } else { T::ZERO };
            (axes.map(|row| row[k]), moment)
        })
    }
}

/// Rounds of Jacobi's method, whose error falls to its cube in each: three do for double-double, and one more
/// where it starts badly.
const ROUNDS: usize = 6;

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra_assembly::Random;

    /// The moments and axes make the matrix again, and the axes are perpendicular.
    #[test]
    fn principal_moments_sum_up_to_the_inertia() {
        let mut random = Random::new(3);
        for round in 0..200 {
            let scale = 10_f64.powi(round % 9 - 4);
            let mut e = [[0.0; 3]; 3];
            for size in [1.0, if round % 3 == 0 { 0.0 } else { scale }] {
                let n = random.direction().to_array();
                for (row, x) in e.iter_mut().zip(n) {
                    for (e, y) in row.iter_mut().zip(n) {
                        *e += size * x * y;
                    }
                }
            }
            let (diagonal, across) = ([e[0][0], e[1][1], e[2][2]], [e[0][1], e[0][2], e[1][2]]);
            let own = OwnInertia {
                diagonal: &diagonal,
                across: &across,
            };
            let parts = own.principal();
            let bound = 32.0 * f64::EPSILON * (1.0 + scale);
            for k in 0..3 {
                for l in 0..3 {
                    let sum: f64 = parts.iter().map(|(a, m)| m * a[k] * a[l]).sum();
                    assert!((sum - e[k][l]).abs() <= bound, "{sum} for {}", e[k][l]);
                    let dot: f64 = (0..3).map(|j| parts[k].0[j] * parts[l].0[j]).sum();
                    let expected = f64::from(u8::from(k == l));
                    assert!((dot - expected).abs() <= 32.0 * f64::EPSILON);
                }
            }
            assert!(round % 3 != 0 || parts.iter().filter(|(_, m)| *m > 0.0).count() == 1);
        }
    }
}
