//! Boxes of B, seen from A: conservative for every posed vertex in them.
//!
//! With centre c and half extents h, the box of all R v + t for v in the box is R c + t ± |R| h. In `f32` centre,
//! extents, entries of R, products, sums and bounds are each off by a rounding or two, in all by less than 16 · 2^-24
//! relative to m = |R| max(|min|, |max|) + |t|, of which the rounding of the defined `f64` vertices is nothing. So the
//! box is widened by 2^-20 m, and by 2^-126 for underflow. Where something overflows, so does m, infinities cancel to
//! NaN, and boxes compare NaN as unbounded.

use glam::DVec3;

use crate::bounds::{Bounds, LANES, Packet};

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
        let mut center = [[0.0; LANES]; 3];
        let mut extent = [[0.0; LANES]; 3];
        let mut size = [[0.0; LANES]; 3];
        for k in 0..3 {
            for lane in 0..LANES {
                let (min, max) = (packet.min[k][lane], packet.max[k][lane]);
                center[k][lane] = 0.5 * min + 0.5 * max;
                extent[k][lane] = 0.5 * max - 0.5 * min;
                size[k][lane] = if -min > max { -min } else { max };
            }
        }
        let mut posed = packet.clone();
        for i in 0..3 {
            let r = self.rows[i];
            let [x, y, z] = r.map(f32::abs);
            for lane in 0..LANES {
                let along = |v: &[[f32; LANES]; 3], [x, y, z]: [f32; 3]| {
                    (x * v[0][lane] + y * v[1][lane]) + z * v[2][lane]
                };
                let middle = along(&center, r) + self.translation[i];
                let m = along(&size, [x, y, z]) + self.magnitude[i];
                let reach = along(&extent, [x, y, z]) + (m * RELATIVE + f32::MIN_POSITIVE);
                posed.min[i][lane] = middle - reach;
                posed.max[i][lane] = middle + reach;
            }
        }
        posed
    }
}
