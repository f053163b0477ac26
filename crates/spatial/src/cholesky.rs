//! Cholesky factors of the small matrices D = S' IA S of joints with up to six freedoms.

use crate::Number;

/// Lower triangular L with L L' = D, of order at most six.
#[derive(Clone, Copy, Debug)]
pub struct SmallCholesky<T> {
    order: usize,
    lower: [[T; 6]; 6],
}

impl<T: Number> SmallCholesky<T> {
    /// Factors the leading `order` x `order` part of the symmetric matrix `d` (its lower triangle
    /// is read); an order above six means six.
    ///
    /// # Errors
    /// The index of the first pivot that is not above `floors[index]`; NaN is not above anything.
    pub fn factor(order: usize, d: &[[T; 6]; 6], floors: &[T; 6]) -> Result<Self, usize> {
        let order = order.min(6);
        let mut lower = [[T::ZERO; 6]; 6];
        for j in 0..order {
            let mut pivot = d[j][j];
            for k in 0..j {
                pivot -= lower[j][k] * lower[j][k];
            }
            if !pivot.exceeds(floors[j]) {
                return Err(j);
            }
            let root = pivot.sqrt();
            lower[j][j] = root;
            for i in j + 1..order {
                let mut entry = d[i][j];
                for k in 0..j {
                    entry -= lower[i][k] * lower[j][k];
                }
                lower[i][j] = entry / root;
            }
        }
        Ok(Self { order, lower })
    }

    /// Replaces the first `order` entries of `b` by those of D^-1 b.
    #[inline]
    pub fn solve(&self, b: &mut [T; 6]) {
        self.solve_lower(b);
        let n = self.order;
        for i in (0..n).rev() {
            for k in i + 1..n {
                b[i] -= self.lower[k][i] * b[k];
            }
            b[i] = b[i] / self.lower[i][i];
        }
    }

    /// Replaces the first `order` entries of `b` by those of L^-1 b.
    #[inline]
    pub fn solve_lower(&self, b: &mut [T; 6]) {
        for i in 0..self.order {
            for k in 0..i {
                b[i] -= self.lower[i][k] * b[k];
            }
            b[i] = b[i] / self.lower[i][i];
        }
    }
}
