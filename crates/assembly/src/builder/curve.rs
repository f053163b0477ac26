//! Strands along curves.

use glam::{DQuat, DVec3};
use vertebra_spatial::Pose;

/// Pieces of which a span of a spline is made.
const PIECES: u32 = 32;

/// A curve in space along which links can be laid.
#[derive(Clone, Debug, PartialEq)]
pub struct Centerline {
    points: Vec<DVec3>,
}

impl Centerline {
    /// Straight from point to point \[m\].
    #[must_use]
    pub fn polyline(points: impl IntoIterator<Item = DVec3>) -> Self {
        Self {
            points: points.into_iter().collect(),
        }
    }

    /// Smoothly through the points \[m\] (Catmull and Rom 1974; straight extension at the ends).
    #[must_use]
    pub fn spline(points: impl IntoIterator<Item = DVec3>) -> Self {
        let points: Vec<DVec3> = points.into_iter().collect();
        let mut fine = Vec::with_capacity(points.len() * PIECES as usize);
        for (index, pair) in points.windows(2).enumerate() {
            let (a, b) = (pair[0], pair[1]);
            let before = index.checked_sub(1).map_or(a + a - b, |i| points[i]);
            let after = points.get(index + 2).map_or(b + b - a, |&p| p);
            for piece in 0..PIECES {
                let t = f64::from(piece) / f64::from(PIECES);
                let (t2, t3) = (t * t, t * t * t);
                let sum = a * 2.0
                    + (b - before) * t
                    + (before * 2.0 - a * 5.0 + b * 4.0 - after) * t2
                    + (a * 3.0 - before - b * 3.0 + after) * t3;
                fine.push(sum * 0.5);
            }
        }
        fine.extend(points.last());
        Self { points: fine }
    }

    /// Its length \[m\].
    #[must_use]
    pub fn length(&self) -> f64 {
        let pieces = self.points.windows(2);
        pieces.map(|pair| (pair[1] - pair[0]).length()).sum()
    }

    /// Frames at the starts of so many links of equal length along the curve, z along each, and each
    /// link's chord \[m\]; none if the curve has no length or is not finite. Frames turn no more about z
    /// than the curve makes them (the rotation from link to link is the shortest).
    pub(super) fn links(&self, count: usize) -> Option<Vec<(Pose, f64)>> {
        let length = self.length();
        if !(length.is_finite() && length > 0.0) || count == 0 {
            return None;
        }
        let ends = self.divide(count, length);
        let mut rotation = DQuat::IDENTITY;
        let mut links = Vec::with_capacity(count);
        for pair in ends.windows(2) {
            let chord = pair[1] - pair[0];
            let size = chord.length();
            if size <= 1e-12 * length {
                return None;
            }
            let turn = DQuat::from_rotation_arc(rotation * DVec3::Z, chord / size);
            rotation = (turn * rotation).normalize();
            links.push((Pose::new(rotation, pair[0]), size));
        }
        Some(links)
    }

    /// Points at equal distances along the curve, the ends among them.
    fn divide(&self, count: usize, length: f64) -> Vec<DVec3> {
        #[expect(clippy::cast_precision_loss, reason = "a part of a length")]
        let step = length / count as f64;
        let mut ends = Vec::with_capacity(count + 1);
        ends.extend(self.points.first());
        let (mut gone, mut next) = (0.0, step);
        for pair in self.points.windows(2) {
            let size = (pair[1] - pair[0]).length();
            while ends.len() < count && gone + size >= next {
                ends.push(pair[0].lerp(pair[1], (next - gone) / size));
                next += step;
            }
            gone += size;
        }
        ends.extend(self.points.last());
        ends
    }
}
