//! Cholesky factors of symmetric matrices whose rows begin late.
//!
//! The envelope method (George and Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981,
//! chapter 4): what a row has left of its first entry that is not zero stays zero in its factor. Loops that share no moving
//! joint do not feel each other, so that independent mechanisms cost what each costs alone, and a chain of
//! neighbours what its width is.

/// A symmetric positive definite matrix, then its lower factor, each row from its first entry to the diagonal.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    /// Column in which each row begins.
    first: Vec<usize>,
    /// Where each row's entries start, and their end.
    start: Vec<usize>,
    values: Vec<f64>,
}

impl Envelope {
    /// Takes the memory for rows that begin in these columns, none beyond its diagonal.
    pub(super) fn new(first: Vec<usize>) -> Self {
        let mut start = vec![0];
        for (row, &first) in first.iter().enumerate() {
            start.push(start[row] + row + 1 - first);
        }
        Self {
            values: vec![0.0; start[first.len()]],
            first,
            start,
        }
    }

    /// The column in which a row begins.
    pub(super) fn first(&self, row: usize) -> usize {
        self.first[row]
    }

    /// A row from its first entry to the diagonal.
    pub(super) fn row(&self, row: usize) -> &[f64] {
        &self.values[self.start[row]..self.start[row + 1]]
    }

    /// The same, to be written.
    pub(super) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[self.start[row]..self.start[row + 1]]
    }

    /// The diagonal entry of a row's factor.
    pub(super) fn pivot(&self, row: usize) -> f64 {
        self.values[self.start[row + 1] - 1]
    }

    /// The diagonal entry of a row.
    pub(super) fn diagonal_mut(&mut self, row: usize) -> &mut f64 {
        &mut self.values[self.start[row + 1] - 1]
    }

    /// Replaces the matrix, whose diagonal is at least `floor` above what rounding can take from it, by its
    /// factor; pivots that rounding made smaller are `floor`.
    pub(super) fn factor(&mut self, floor: f64) {
        for i in 0..self.first.len() {
            let (above, rest) = self.values.split_at_mut(self.start[i]);
            let row = &mut rest[..self.start[i + 1] - self.start[i]];
            let begin = self.first[i];
            for j in begin..i {
                let other = &above[self.start[j]..self.start[j + 1]];
                let from = begin.max(self.first[j]);
                let sum = dot(
                    &row[from - begin..j - begin],
                    &other[from - self.first[j]..],
                );
                let diagonal = other[j - self.first[j]];
                row[j - begin] = (row[j - begin] - sum) / diagonal;
            }
            let (entries, diagonal) = row.split_at_mut(i - begin);
            diagonal[0] = (diagonal[0] - dot(entries, entries)).max(floor).sqrt();
        }
    }

    /// Replaces b by the solution, after [`factor`](Self::factor).
    pub(super) fn solve(&self, b: &mut [f64]) {
        for i in 0..self.first.len() {
            let (row, begin) = (self.row(i), self.first[i]);
            let sum = dot(&b[begin..i], row);
            b[i] = (b[i] - sum) / row[i - begin];
        }
        for i in (0..self.first.len()).rev() {
            let (row, begin) = (self.row(i), self.first[i]);
            let x = b[i] / row[i - begin];
            b[i] = x;
            for (b, entry) in b[begin..i].iter_mut().zip(row) {
                *b -= x * entry;
            }
        }
    }
}

/// Inner product over the first of the two, in four sums side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (quads, rest) = a.as_chunks::<4>();
    let (other_quads, other_rest) = b[..a.len()].as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in quads.iter().zip(other_quads) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = rest.iter().zip(other_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use vertebra_assembly::Random;

    /// A = Y'Y with rows of Y that end late, so that the envelope is ragged; solved against itself.
    #[test]
    fn solutions_satisfy_their_equations() {
        let mut random = Random::new(3);
        for order in [1, 2, 5, 17, 60] {
            let first: Vec<usize> = (0..order).map(|row| row - random.below(row + 1)).collect();
            let mut matrix = Envelope::new(first.clone());
            for row in 0..order {
                let length = row + 1 - first[row];
                for entry in matrix.row_mut(row) {
                    *entry = random.symmetric() / order as f64;
                }
                matrix.row_mut(row)[length - 1] = 2.0;
            }
            let x: Vec<f64> = (0..order).map(|_| random.symmetric()).collect();
            let mut b = vec![0.0; order];
            for row in 0..order {
                for (k, &entry) in matrix.row(row).iter().enumerate() {
                    let column = first[row] + k;
                    b[row] += entry * x[column];
                    if column != row {
                        b[column] += entry * x[row];
                    }
                }
            }
            matrix.factor(0.0);
            matrix.solve(&mut b);
            let error = x
                .iter()
                .zip(&b)
                .fold(0.0_f64, |m, (x, b)| m.max((x - b).abs()));
            assert!(
                error <= 8.0 * order as f64 * f64::EPSILON,
                "{order}: {error:e}"
            );
        }
    }
}
