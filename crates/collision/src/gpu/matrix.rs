//! The matrix of all pairs.

use vertebra_gpu::wgpu::Limits;
use vertebra_shaders::collision::COUNTERS;

use super::batch::Batch;
use super::error::Error;

/// A bit for every pair of triangles: whether they meet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PairMatrix {
    columns: u32,
    /// Words of a row.
    stride: usize,
    words: Vec<u32>,
}

impl PairMatrix {
    /// In slices of as many rows as fit into a buffer of the device.
    pub(super) fn ask(
        batch: &Batch<'_>,
        [rows, columns]: [u32; 2],
        limits: &Limits,
    ) -> Result<Self, Error> {
        let bytes = limits
            .max_buffer_size
            .min(limits.max_storage_buffer_binding_size);
        let stride = columns.div_ceil(32);
        let words = (bytes / 4).saturating_sub(COUNTERS as u64);
        let fit = words / u64::from(stride);
        let slice = u32::try_from(fit).unwrap_or(u32::MAX).clamp(1, rows.max(1));
        let mut matrix = Self {
            columns,
            stride: stride as usize,
            words: room(rows, columns)?,
        };
        let mut first = 0;
        while first < rows {
            let count = slice.min(rows - first);
            let (words, settled) = batch.rows(first, count, stride)?;
            matrix.words.extend(words);
            for [a, b] in settled {
                matrix.words[a as usize * stride as usize + b as usize / 32] |= 1 << (b % 32);
            }
            first += count;
        }
        Ok(matrix)
    }

    /// Whether triangle `a` of A meets triangle `b` of B; none is met by triangles that are not there.
    #[must_use]
    pub fn get(&self, a: u32, b: u32) -> bool {
        let word = self.words.get(a as usize * self.stride + b as usize / 32);
        b < self.columns && word.is_some_and(|word| word >> (b % 32) & 1 == 1)
    }

    /// The words of the row of triangle `a` of A, its first pair lowest; none if there is no such triangle.
    #[must_use]
    pub fn row(&self, a: u32) -> Option<&[u32]> {
        let first = a as usize * self.stride;
        self.words.get(first..first + self.stride)
    }
}

/// Memory for a matrix, if there is as much.
fn room(rows: u32, columns: u32) -> Result<Vec<u32>, Error> {
    let count = u64::from(rows) * u64::from(columns.div_ceil(32));
    let mut words = Vec::new();
    let reserved = usize::try_from(count).is_ok_and(|count| words.try_reserve_exact(count).is_ok());
    if reserved {
        Ok(words)
    } else {
        Err(Error::MatrixTooLarge {
            rows,
            columns,
            bytes: count.saturating_mul(4),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{Error, room};

    #[test]
    fn a_matrix_beyond_all_memory_is_refused() {
        let found = room(u32::MAX, u32::MAX);
        let bytes = u64::from(u32::MAX) << 29;
        assert!(matches!(found, Err(Error::MatrixTooLarge { bytes: b, .. }) if b == bytes));
        assert!(room(3, 65).is_ok_and(|words| words.capacity() >= 9));
    }
}
