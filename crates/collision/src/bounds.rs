//! Conservative bounding boxes in `f32`, laid out for comparison of one with many.

use glam::DVec3;

/// A box that contains its points: bounds are rounded outwards to `f32` \[m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    min: [f32; 3],
    max: [f32; 3],
}

impl Bounds {
    /// Contains nothing and overlaps nothing.
    const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    pub(crate) fn of(points: &[DVec3; 3]) -> Self {
        let [a, b, c] = *points;
        Self {
            min: a.min(b).min(c).to_array().map(round_down),
            max: a.max(b).max(c).to_array().map(round_up),
        }
    }

    fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].min(other.min[k])),
            max: std::array::from_fn(|k| self.max[k].max(other.max[k])),
        }
    }

    fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
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

fn round_up(x: f64) -> f32 {
    -round_down(-x)
}

/// Boxes compared at once.
const LANES: usize = 16;

/// Boxes side by side, so that one comparison instruction serves several.
#[derive(Clone, Debug)]
struct Block {
    min: [[f32; LANES]; 3],
    max: [[f32; LANES]; 3],
}

/// A list of boxes to compare others with.
#[derive(Clone, Debug)]
pub(crate) struct BoundsList {
    blocks: Vec<Block>,
    all: Bounds,
}

impl BoundsList {
    pub(crate) fn new(bounds: &[Bounds]) -> Self {
        let block = |chunk: &[Bounds]| {
            let lane = |i: usize| chunk.get(i).unwrap_or(&Bounds::EMPTY);
            Block {
                min: std::array::from_fn(|k| std::array::from_fn(|i| lane(i).min[k])),
                max: std::array::from_fn(|k| std::array::from_fn(|i| lane(i).max[k])),
            }
        };
        Self {
            blocks: bounds.chunks(LANES).map(block).collect(),
            all: bounds.iter().fold(Bounds::EMPTY, |all, b| all.union(b)),
        }
    }

    /// The indices of the boxes that overlap this one, in order.
    pub(crate) fn overlapping(&self, bounds: Bounds) -> impl Iterator<Item = u32> {
        let blocks = if self.all.overlaps(&bounds) {
            self.blocks.as_slice()
        } else {
            &[]
        };
        (0_u32..)
            .step_by(LANES)
            .zip(blocks)
            .flat_map(move |(first, block)| {
                let hits = block.overlaps(&bounds);
                let any = hits.iter().fold(0, |any, hit| any | hit) != 0;
                (first..)
                    .zip(if any { hits } else { [0; LANES] })
                    .take(if any { LANES } else { 0 })
                    .filter_map(|(index, hit)| (hit != 0).then_some(index))
            })
    }
}

impl Block {
    /// 1 for each lane whose box overlaps, else 0; without branches, for the compiler to vectorise.
    #[inline]
    fn overlaps(&self, other: &Bounds) -> [u32; LANES] {
        let mut hits = [1; LANES];
        for k in 0..3 {
            for (lane, hit) in hits.iter_mut().enumerate() {
                let below = self.min[k][lane] <= other.max[k];
                let above = other.min[k] <= self.max[k][lane];
                *hit &= u32::from(below & above);
            }
        }
        hits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_outwards() {
        let values = [0.1, -0.1, 1e-60, -1e-60, 1e300, -1e300, 3.5, 0.0, 1e-44];
        for x in values {
            assert!(f64::from(round_down(x)) <= x, "{x}");
            assert!(f64::from(round_up(x)) >= x, "{x}");
        }
        for x in [0.1_f32, 1e-45, f32::MAX, -7.0] {
            assert_eq!(round_down(f64::from(x)), x);
            assert_eq!(round_up(f64::from(x)), x);
        }
    }

    #[test]
    fn list_agrees_with_one_by_one() {
        let mut random = oorandom::Rand32::new(1);
        let mut point = || {
            let mut coordinate = || f64::from(random.rand_range(0..40));
            DVec3::new(coordinate(), coordinate(), coordinate())
        };
        let mut triangle = || {
            let corner = point();
            [corner, corner + point() * 0.2, corner + point() * 0.2]
        };
        for count in [1, 15, 16, 17, 100] {
            let bounds: Vec<_> = (0..count).map(|_| Bounds::of(&triangle())).collect();
            let list = BoundsList::new(&bounds);
            for _ in 0..50 {
                let query = Bounds::of(&triangle());
                let expected: Vec<u32> = (0..)
                    .zip(&bounds)
                    .filter(|(_, b)| b.overlaps(&query))
                    .map(|(i, _)| i)
                    .collect();
                let found: Vec<u32> = list.overlapping(query).collect();
                assert_eq!(found, expected);
            }
        }
    }
}
