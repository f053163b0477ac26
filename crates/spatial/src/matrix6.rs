//! Six-by-six matrices between spatial vectors, where blocks of three do not help: compliances and
//! what hangs together with them in assembly trees.

use crate::{ArticulatedInertia, Force, Mat3, Motion, Number, Sym3, Vec3};

/// A 6 x 6 matrix, stored by rows, angular rows and columns first.
///
/// Every operation is a sum of multiples of whole rows: six independent lanes, no sums across one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat6<T>(pub [[T; 6]; 6]);

impl<T: Number> Mat6<T> {
    /// All zeros.
    pub const ZERO: Self = Self([[T::ZERO; 6]; 6]);

    /// The identity.
    pub const IDENTITY: Self = {
        let mut rows = [[T::ZERO; 6]; 6];
        let mut i = 0;
        while i < 6 {
            rows[i][i] = T::ONE;
            i += 1;
        }
        Self(rows)
    };

    /// Applies a function to every entry.
    #[inline]
    #[must_use]
    pub fn map<U: Number>(&self, f: impl Fn(T) -> U) -> Mat6<U> {
        Mat6(self.0.map(|row| row.map(&f)))
    }

    /// The transposed matrix.
    #[inline]
    #[must_use]
    pub fn transpose(&self) -> Self {
        let mut rows = [[T::ZERO; 6]; 6];
        for (i, row) in self.0.iter().enumerate() {
            for (j, &entry) in row.iter().enumerate() {
                rows[j][i] = entry;
            }
        }
        Self(rows)
    }

    /// M v.
    #[inline]
    #[must_use]
    pub fn mul(&self, v: &[T; 6]) -> [T; 6] {
        self.0.map(|row| dot(&row, v))
    }

    /// M' v, without forming the transpose.
    #[inline]
    #[must_use]
    pub fn transpose_mul(&self, v: &[T; 6]) -> [T; 6] {
        let mut sum = [T::ZERO; 6];
        for (row, &factor) in self.0.iter().zip(v) {
            add_scaled(&mut sum, row, factor);
        }
        sum
    }

    /// Adds the rank-one matrix a b' times a factor.
    #[inline]
    pub fn add_outer(&mut self, a: &[T; 6], b: &[T; 6], factor: T) {
        for (row, &entry) in self.0.iter_mut().zip(a) {
            add_scaled(row, b, entry * factor);
        }
    }

    /// Adds `sign` times A'B, summed over the first `order` rows of both.
    #[inline]
    pub fn add_transpose_product(&mut self, order: usize, a: &Self, b: &Self, sign: T) {
        for (a, b) in a.0.iter().zip(&b.0).take(order) {
            self.add_outer(a, b, sign);
        }
    }

    /// X' M with X = [1 0; -r~ 1]: what maps to forces about one point maps to forces about the
    /// point from which that one lies at `r`.
    #[inline]
    #[must_use]
    pub fn shifted_back(&self, r: Vec3<T>) -> Self {
        let mut rows = self.0;
        let [lx, ly, lz] = [rows[3], rows[4], rows[5]];
        for (row, (plus, by, minus, of)) in
            rows.iter_mut()
                .zip([(lz, r.y, ly, r.z), (lx, r.z, lz, r.x), (ly, r.x, lx, r.y)])
        {
            add_scaled(row, &plus, by);
            add_scaled(row, &minus, -of);
        }
        Self(rows)
    }

    /// The symmetric matrix as an articulated inertia; of its off-diagonal blocks the lower is read.
    #[inline]
    #[must_use]
    pub fn to_inertia(&self) -> ArticulatedInertia<T> {
        let m = &self.0;
        let sym = |at: usize| Sym3 {
            xx: m[at][at],
            yy: m[at + 1][at + 1],
            zz: m[at + 2][at + 2],
            xy: m[at + 1][at],
            xz: m[at + 2][at],
            yz: m[at + 2][at + 1],
        };
        let column = |j: usize| Vec3::from_array([m[3][j], m[4][j], m[5][j]]);
        ArticulatedInertia {
            angular: sym(0),
            coupling: Mat3::from_cols(column(0), column(1), column(2)),
            linear: sym(3),
        }
    }

    /// The articulated inertia as a full matrix.
    #[inline]
    #[must_use]
    pub fn from_inertia(inertia: &ArticulatedInertia<T>) -> Self {
        let mut rows = [[T::ZERO; 6]; 6];
        for (at, block) in [(0, inertia.angular), (3, inertia.linear)] {
            let columns = [block.col_x(), block.col_y(), block.col_z()];
            for (j, column) in columns.into_iter().enumerate() {
                rows[at + j][at..at + 3].copy_from_slice(&column.to_array());
            }
        }
        let h = &inertia.coupling;
        for (j, column) in [h.x_axis, h.y_axis, h.z_axis].into_iter().enumerate() {
            for (i, entry) in column.to_array().into_iter().enumerate() {
                rows[3 + i][j] = entry;
                rows[j][3 + i] = entry;
            }
        }
        Self(rows)
    }
}

/// Adds a multiple of one row to another.
#[inline]
pub fn add_scaled<T: Number>(sum: &mut [T; 6], row: &[T; 6], factor: T) {
    for (sum, &entry) in sum.iter_mut().zip(row) {
        *sum += entry * factor;
    }
}

/// Inner product of two rows.
#[inline]
#[must_use]
pub fn dot<T: Number>(a: &[T; 6], b: &[T; 6]) -> T {
    let [x, y, z] = [
        a[0] * b[0] + a[3] * b[3],
        a[1] * b[1] + a[4] * b[4],
        a[2] * b[2] + a[5] * b[5],
    ];
    x + y + z
}

macro_rules! as_array {
    ($vector:ident) => {
        impl<T: Number> $vector<T> {
            /// The components, angular ones first.
            #[inline]
            #[must_use]
            pub fn to_array(self) -> [T; 6] {
                let ([a, b, c], [x, y, z]) = (self.angular.to_array(), self.linear.to_array());
                [a, b, c, x, y, z]
            }

            /// From its components, angular ones first.
            #[inline]
            #[must_use]
            pub fn from_array([a, b, c, x, y, z]: [T; 6]) -> Self {
                Self::new(Vec3::from_array([a, b, c]), Vec3::from_array([x, y, z]))
            }
        }
    };
}

as_array!(Motion);
as_array!(Force);
