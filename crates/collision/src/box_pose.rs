//! Boxes of B, seen from A: conservative for every posed vertex in them.
//!
//! With centre c and half extents h, the box of all R v + t for v in the box is R c + t ± |R| h. In `f32` centre,
//! extents, entries of R, products, sums and bounds are each off by a rounding or two, in all by less than 16 · 2^-24
//! relative to m = |R| max(|min|, |max|) + |t|, of which the rounding of the defined `f64` vertices is nothing. So the
//! box is widened by 2^-20 m, and by 2^-126 for underflow. Where something overflows, so does m, infinities cancel to
//! NaN, and boxes compare NaN as unbounded.

use glam::{DVec3, Vec4};

use crate::bounds::{Bounds, Packet};

/// Error of the box, relative to m.
const RELATIVE: f32 = 8.0 * f32::EPSILON;

/// A rigid map of boxes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxPose {
    rows: [[f32; 3]; 3],
    translation: [f32; 3],
    /// Sum of the magnitudes that the translation was computed from.
    magnitude: [f32; 3],
}

impl BoxPose {
    /// The map v -> R v + t.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "rounded, which the error bound covers"
    )]
    pub(crate) fn new(rows: &[DVec3; 3], translation: DVec3) -> Self {
        let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
        Self {
            rows: rows.map(narrow),
            translation: narrow(translation),
            magnitude: narrow(translation.abs()),
        }
    }

    /// The map w -> R' (w - t), which inverts it: R' R differs from the identity by a few 2^-53, well within the bound.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "rounded, which the error bound covers"
    )]
    pub(crate) fn inverse(rows: &[DVec3; 3], translation: DVec3) -> Self {
        let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
        let columns: [DVec3; 3] = std::array::from_fn(column);
        Self {
            rows: columns.map(|c| c.to_array().map(|x| x as f32)),
            translation: columns.map(|c| -c.dot(translation) as f32),
            magnitude: columns.map(|c| c.abs().dot(translation.abs()) as f32),
        }
    }

    pub(crate) fn apply(&self, bounds: &Bounds) -> Bounds {
        self.apply_packet(&Packet::new(std::iter::once(*bounds)))
            .lane(0)
    }

    /// All boxes of a packet; empty ones become NaN.
    pub(crate) fn apply_packet(&self, packet: &Packet) -> Packet {
        let mut posed = *packet;
        for half in 0..2 {
            let (min, max) = (packet.min.map(|m| m[half]), packet.max.map(|m| m[half]));
            let per_axis = |f: fn(Vec4, Vec4) -> Vec4| std::array::from_fn(|k| f(min[k], max[k]));
            let center = per_axis(|min, max| 0.5 * min + 0.5 * max);
            let extent = per_axis(|min, max| 0.5 * max - 0.5 * min);
            let size = per_axis(|min, max| (-min).max(max));
            for i in 0..3 {
                let row = self.rows[i];
                let magnitudes = row.map(f32::abs);
                let m = along(magnitudes, size) + self.magnitude[i];
                let middle = along(row, center) + self.translation[i];
                let reach = along(magnitudes, extent) + (m * RELATIVE + f32::MIN_POSITIVE);
                posed.min[i][half] = middle - reach;
                posed.max[i][half] = middle + reach;
            }
        }
        posed
    }
}

fn along(row: [f32; 3], v: [Vec4; 3]) -> Vec4 {
    (row[0] * v[0] + row[1] * v[1]) + row[2] * v[2]
}
