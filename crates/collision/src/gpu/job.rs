//! Poses as the device reads them.

use glam::DVec3;
use vertebra_shaders::collision::{Job, SCALE};

use crate::transform::RelativePose;

/// Error of a coordinate R x + t, or of an edge R x, in units of the sum of the magnitudes of its terms: matrix and
/// translation are rounded (half a unit of 2^-23), so is each product, and so are three sums of them; an edge is rounded
/// before, and has a sum less. 4.5 units, and a third more for terms of second order and the rounding of the bound.
const POSED: f32 = 6.0 * f32::EPSILON;

/// A question about some blocks of two meshes, the first and how many of each.
#[expect(
    clippy::cast_possible_truncation,
    reason = "rounded, which the error bounds cover"
)]
pub(super) fn job(
    pose: &RelativePose,
    [a_first, a_blocks]: [u32; 2],
    [b_first, b_blocks]: [u32; 2],
) -> Job {
    let error = if *pose == RelativePose::IDENTITY {
        0.0
    } else {
        POSED
    };
    let translation = pose.translation() * f64::from(SCALE);
    let row = |row: DVec3, along: f64| {
        let [x, y, z] = row.to_array();
        [x, y, z, along].map(|entry| entry as f32)
    };
    let [x, y, z] = pose.rows();
    Job {
        rows: [
            row(x, translation.x),
            row(y, translation.y),
            row(z, translation.z),
        ],
        coordinate_error: error,
        edge_error: error,
        a_first,
        a_blocks,
        b_first,
        b_blocks,
        ..Job::default()
    }
}
