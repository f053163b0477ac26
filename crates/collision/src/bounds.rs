//! Conservative bounding boxes in `f32`, alone and eight side by side.

use glam::{DVec3, Vec3, Vec4};

/// Boxes in a packet.
pub(crate) const LANES: usize = 8;

const ALL_LANES: u32 = (1 << LANES) - 1;

/// A box that contains its points \[m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) min: [f32; 3],
    pub(crate) max: [f32; 3],
}

impl Bounds {
    /// Contains nothing.
    pub(crate) const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    /// The box of points, exactly.
    pub(crate) fn of(points: &[Vec3]) -> Self {
        let (min, max) = points.iter().fold(
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |(min, max), &point| (min.min(point), max.max(point)),
        );
        Self {
            min: min.to_array(),
            max: max.to_array(),
        }
    }

    /// The box of points, rounded outwards.
    pub(crate) fn around(points: &[DVec3; 3]) -> Self {
        let [a, b, c] = *points;
        Self {
            min: a.min(b).min(c).to_array().map(round_down),
            max: a.max(b).max(c).to_array().map(Self::round_up),
        }
    }

    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].min(other.min[k])),
            max: std::array::from_fn(|k| self.max[k].max(other.max[k])),
        }
    }

    /// What both contain. A bound that is NaN is taken as unbounded.
    pub(crate) fn intersection(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].max(other.min[k])),
            max: std::array::from_fn(|k| self.max[k].min(other.max[k])),
        }
    }

    /// Whether the boxes share a point. A bound that is NaN is taken as unbounded.
    #[inline]
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        let apart = |k| (self.min[k] > other.max[k]) | (other.min[k] > self.max[k]);
        !(apart(0) | apart(1) | apart(2))
    }

    /// The least f32 that is not less.
    pub(crate) fn round_up(x: f64) -> f32 {
        -round_down(-x)
    }

    /// All points no further than that from the box, along each axis.
    pub(crate) fn grown(&self, reach: f32) -> Self {
        Packet::new(std::iter::once(*self)).grown(reach).lane(0)
    }

    /// Half the area of the surface; 0 if empty \[m²].
    pub(crate) fn half_area(&self) -> f64 {
        let [x, y, z] =
            std::array::from_fn(|k| (f64::from(self.max[k]) - f64::from(self.min[k])).max(0.0));
        (x * y + y * z) + z * x
    }
}

#[expect(clippy::cast_possible_truncation, reason = "corrected downwards")]
fn round_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x {
        nearest.next_down()
    } else {
        nearest
    }
}

/// Eight boxes side by side, four to a register; lanes without a box are empty.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packet {
    pub(crate) min: [[Vec4; 2]; 3],
    pub(crate) max: [[Vec4; 2]; 3],
}

impl Packet {
    const EMPTY: Self = Self {
        min: [[Vec4::INFINITY; 2]; 3],
        max: [[Vec4::NEG_INFINITY; 2]; 3],
    };

    /// At most [`LANES`] boxes.
    pub(crate) fn new(boxes: impl Iterator<Item = Bounds>) -> Self {
        let mut packet = Self::EMPTY;
        for (lane, bounds) in boxes.take(LANES).enumerate() {
            for k in 0..3 {
                packet.min[k][lane / 4][lane % 4] = bounds.min[k];
                packet.max[k][lane / 4][lane % 4] = bounds.max[k];
            }
        }
        packet
    }

    #[inline]
    pub(crate) fn lane(&self, lane: usize) -> Bounds {
        Bounds {
            min: std::array::from_fn(|k| self.min[k][lane / 4][lane % 4]),
            max: std::array::from_fn(|k| self.max[k][lane / 4][lane % 4]),
        }
    }

    /// The box of all boxes.
    pub(crate) fn union(&self) -> Bounds {
        Bounds {
            min: self.min.map(|[low, high]| low.min(high).min_element()),
            max: self.max.map(|[low, high]| low.max(high).max_element()),
        }
    }

    /// All boxes, by that much on all sides; empty ones stay empty.
    ///
    /// A rounded difference is off by 2^-24 of itself at most, and not at all where it is subnormal.
    #[inline]
    pub(crate) fn grown(&self, reach: f32) -> Self {
        const OUT: f32 = 1.0 + 2.0 * f32::EPSILON;
        const IN: f32 = 1.0 - 2.0 * f32::EPSILON;
        let (min, max) = (
            self.min.map(|halves| halves.map(|m| m - reach)),
            self.max.map(|halves| halves.map(|m| m + reach)),
        );
        Self {
            min: min.map(|halves| halves.map(|m| (m * OUT).min(m * IN))),
            max: max.map(|halves| halves.map(|m| (m * OUT).max(m * IN))),
        }
    }

    /// A bit for each lane whose box shares a point with this one, lane 0 lowest. Bounds that are NaN are taken as
    /// unbounded, and then an empty lane may count too.
    #[inline]
    pub(crate) fn overlaps(&self, other: &Bounds) -> u32 {
        let apart = |half: usize| {
            let apart = |k: usize| {
                self.min[k][half].cmpgt(Vec4::splat(other.max[k]))
                    | self.max[k][half].cmplt(Vec4::splat(other.min[k]))
            };
            (apart(0) | apart(1) | apart(2)).bitmask()
        };
        !(apart(0) | apart(1) << 4) & ALL_LANES
    }
}

/// The lanes of a mask, in order.
#[inline]
pub(crate) fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (lane < u32::BITS).then_some(lane as usize)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_outwards() {
        let values = [0.1, -0.1, 1e-60, -1e-60, 1e300, -1e300, 3.5, 0.0, 1e-44];
        for x in values {
            assert!(f64::from(round_down(x)) <= x, "{x}");
            assert!(f64::from(Bounds::round_up(x)) >= x, "{x}");
        }
        for x in [0.1_f32, 1e-45, f32::MAX, -7.0] {
            assert_eq!(round_down(f64::from(x)), x);
            assert_eq!(Bounds::round_up(f64::from(x)), x);
        }
    }

    #[test]
    fn packet_agrees_with_one_by_one() {
        let mut random = oorandom::Rand32::new(1);
        let mut triangle = || {
            let mut point = |size: u32| {
                let mut coordinate = || f64::from(random.rand_range(0..size));
                DVec3::new(coordinate(), coordinate(), coordinate())
            };
            let corner = point(10);
            [corner, corner + point(5), corner + point(5)]
        };
        for count in 0..=LANES {
            for _ in 0..50 {
                let boxes: Vec<_> = (0..count).map(|_| Bounds::around(&triangle())).collect();
                let packet = Packet::new(boxes.iter().copied());
                let query = Bounds::around(&triangle());
                let expected: Vec<_> = (0..count).filter(|&i| boxes[i].overlaps(&query)).collect();
                let found: Vec<_> = lanes(packet.overlaps(&query)).collect();
                assert_eq!(found, expected);
                let all = boxes.iter().fold(Bounds::EMPTY, |all, b| all.union(b));
                assert_eq!(packet.union(), all);
            }
        }
    }

    #[test]
    fn unbounded_overlaps_everything() {
        let unbounded = Bounds {
            min: [f32::NAN; 3],
            max: [f32::NAN; 3],
        };
        let far = Bounds {
            min: [f32::MAX; 3],
            max: [f32::MAX; 3],
        };
        assert!(unbounded.overlaps(&far) && far.overlaps(&unbounded));
        assert_eq!(Packet::new([far].into_iter()).overlaps(&unbounded) & 1, 1);
        assert_eq!(Packet::new([unbounded].into_iter()).overlaps(&far), 1);
    }
}
