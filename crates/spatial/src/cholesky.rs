//! Cholesky factors of the small matrices D = S' IA S of joints with up to six freedoms.

use crate::Number;
use crate::matrix6::{Mat6, add_scaled};

/// Lower triangular L with L L' = D, of order at most six.
#[derive(Clone, Copy, Debug)]
pub struct SmallCholesky<T> {
    order: usize,
    /// L below its diagonal.
    lower: [[T; 6]; 6],
    /// The reciprocals of L's diagonal: six divisions serve any number of solutions.
    inverse_diagonal: [T; 6],
}

impl<T: Number> SmallCholesky<T> {
    /// The factor of a matrix of order zero.
    pub const EMPTY: Self = Self {
        order: 0,
        lower: [[T::ZERO; 6]; 6],
        inverse_diagonal: [T::ZERO; 6],
    };

    /// Factors the leading `order` x `order` part of the symmetric matrix `d` (its lower triangle
    /// is read); an order above six means six.
    ///
    /// # Errors
    /// The index of the first pivot that is not above `floors[index]`; NaN is not above anything.
    pub fn factor(order: usize, d: &[[T; 6]; 6], floors: &[T; 6]) -> Result<Self, usize> {
        let order = order.min(6);
        let mut lower = [[T::ZERO; 6]; 6];
        let mut inverse_diagonal = [T::ZERO; 6];
        for j in 0..order {
            let mut pivot = d[j][j];
            for k in 0..j {
                pivot -= lower[j][k] * lower[j][k];
            }
            if !pivot.exceeds(floors[j]) {
                return Err(j);
            }
            inverse_diagonal[j] = T::ONE / pivot.sqrt();
            for i in j + 1..order {
                let mut entry = d[i][j];
                for k in 0..j {
                    entry -= lower[i][k] * lower[j][k];
                }
                lower[i][j] = entry * inverse_diagonal[j];
            }
        }
        Ok(Self {
            order,
            lower,
            inverse_diagonal,
        })
    }

    /// The order of D.
    #[must_use]
    pub const fn order(&self) -> usize {
        self.order
    }

    /// A row of L below the order, with the reciprocal of its diagonal entry in that one's place.
    #[inline]
    #[must_use]
    pub fn row(&self, index: usize) -> [T; 6] {
        let mut row = self.lower[index];
        row[index] = self.inverse_diagonal[index];
        row
    }

    /// Replaces the first `order` entries of `b` by those of D^-1 b.
    #[inline]
    pub fn solve(&self, b: &mut [T; 6]) {
        self.solve_lower(b);
        self.solve_upper(b);
    }

    /// Replaces the first `order` entries of `b` by those of L^-1 b.
    #[inline]
    pub fn solve_lower(&self, b: &mut [T; 6]) {
        for i in 0..self.order {
            for k in 0..i {
                b[i] -= self.lower[i][k] * b[k];
            }
            b[i] = b[i] * self.inverse_diagonal[i];
        }
    }

    /// Replaces the first `order` entries of `b` by those of L'^-1 b.
    #[inline]
    pub fn solve_upper(&self, b: &mut [T; 6]) {
        for i in (0..self.order).rev() {
            for k in i + 1..self.order {
                b[i] -= self.lower[k][i] * b[k];
            }
            b[i] = b[i] * self.inverse_diagonal[i];
        }
    }

    /// Replaces the first `order` rows of `m` by those of L^-1 m.
    #[inline]
    pub fn solve_lower_rows(&self, m: &mut Mat6<T>) {
        for i in 0..self.order {
            let mut row = m.0[i];
            for k in 0..i {
                add_scaled(&mut row, &m.0[k], -self.lower[i][k]);
            }
            m.0[i] = row.map(|entry| entry * self.inverse_diagonal[i]);
        }
    }
}
