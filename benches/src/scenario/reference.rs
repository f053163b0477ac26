//! What the rows of mesh collision are held against: every colliding pair, found apart from the
//! queries that are measured.
//!
//! A query culls with boxes in `f32` and shares its work among threads. Here triangles are swept
//! along one axis in `f64` on one thread, and only the test of two triangles is the same. That test
//! has its own references: the lists of [`crate::suite::gold_meshes`], from rational arithmetic.

use vertebra::TriangleMesh;
use vertebra::collision::{RelativePose, exact::triangles_intersect};
use vertebra::glam::DVec3;

/// 2^200. Posed coordinates are zero or from 2^-401 to 2^131 in magnitude; multiplied by this, which
/// is exact, they are within what [`triangles_intersect`] decides.
const SCALE: f64 = f64::from_bits((1023 + 200) << 52);

/// A triangle and its extent.
struct Item {
    id: u32,
    corners: [DVec3; 3],
    low: DVec3,
    high: DVec3,
}

impl Item {
    /// The triangles of a mesh, by where they begin along x.
    fn sorted(mesh: &TriangleMesh, posed: impl Fn(usize) -> DVec3) -> Vec<Self> {
        let item = |(id, triangle): (u32, &[u32; 3])| {
            let corners = triangle.map(|vertex| posed(vertex as usize));
            let [a, b, c] = corners;
            Self {
                id,
                corners,
                low: a.min(b).min(c),
                high: a.max(b).max(c),
            }
        };
        let mut items: Vec<Self> = (0..).zip(mesh.triangles()).map(item).collect();
        items.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
        items
    }

    /// Whether the extents are within the reach of each other along y and z.
    fn is_near_across(&self, other: &Self, reach: f64) -> bool {
        let Self { low, high, .. } = self;
        low.y <= other.high.y + reach
            && other.low.y <= high.y + reach
            && low.z <= other.high.z + reach
            && other.low.z <= high.z + reach
    }
}

/// All pairs (triangle of A, triangle of B) that meet, in lexicographic order.
#[must_use]
pub fn pairs(a: &TriangleMesh, b: &TriangleMesh, pose: &RelativePose) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    sweep(a, b, pose, 0.0, |pair, a, b| {
        if meet(a, b) {
            pairs.push(pair);
        }
    });
    pairs.sort_unstable();
    pairs
}

/// Whether two triangles of posed vertices meet.
pub(super) fn meet(a: &[DVec3; 3], b: &[DVec3; 3]) -> bool {
    triangles_intersect(&a.map(|p| p * SCALE), &b.map(|p| p * SCALE))
}

/// Hands over, once and in any order, the pairs whose extents are no further apart than the reach \[m] along any axis.
pub(super) fn sweep(
    a: &TriangleMesh,
    b: &TriangleMesh,
    pose: &RelativePose,
    reach: f64,
    mut found: impl FnMut([u32; 2], &[DVec3; 3], &[DVec3; 3]),
) {
    let a = Item::sorted(a, |vertex| a.vertices()[vertex].as_dvec3());
    let b = Item::sorted(b, |vertex| pose.apply(b.vertices()[vertex]));
    let mut test = |a: &Item, b: &Item| {
        if a.is_near_across(b, reach) {
            found([a.id, b.id], &a.corners, &b.corners);
        }
    };
    // Extents that are near along x: one begins within the other's reach. Where both begin at one
    // place, the first loop has the pair.
    for a in &a {
        let first = b.partition_point(|b| b.low.x < a.low.x);
        let within = b[first..]
            .iter()
            .take_while(|b| b.low.x <= a.high.x + reach);
        within.for_each(|b| test(a, b));
    }
    for b in &b {
        let first = a.partition_point(|a| a.low.x <= b.low.x);
        let within = a[first..]
            .iter()
            .take_while(|a| a.low.x <= b.high.x + reach);
        within.for_each(|a| test(a, b));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::suite::gold_meshes;
    use vertebra::glam::{DQuat, Vec3};
    use vertebra::{Pose, Random};

    /// Triangles with corners on a coarse grid, so that many touch, share planes or are flat.
    fn soup(random: &mut Random, count: u32, size: f32) -> TriangleMesh {
        #[expect(clippy::cast_precision_loss, reason = "five places")]
        let mut place = || (random.below(5) as f32 - 2.0) * size;
        let vertices = (0..3 * count)
            .map(|_| Vec3::new(place(), place(), place()))
            .collect();
        let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        TriangleMesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn it_is_what_rational_arithmetic_found() {
        for case in gold_meshes::cases().unwrap() {
            let found = pairs(&case.a, &case.b, &RelativePose::IDENTITY);
            assert!(found == case.pairs, "{}: {} pairs", case.name, found.len());
        }
    }

    #[test]
    fn no_pair_is_lost_to_the_sweep() {
        let mut random = Random::new(5);
        let turned = Pose::new(
            DQuat::from_xyzw(0.1, -0.5, 0.3, 0.7).normalize(),
            DVec3::new(0.1, 0.0, -0.2),
        );
        for (size, pose_b) in [
            (1.0, Pose::IDENTITY),
            (1.0, turned),
            (1e-38, Pose::IDENTITY),
            (1e38, Pose::IDENTITY),
        ] {
            let (a, b) = (soup(&mut random, 60, size), soup(&mut random, 70, size));
            let pose = RelativePose::between(&Pose::IDENTITY, &pose_b).unwrap();
            let mut expected = Vec::new();
            for (i, t) in (0..).zip(a.triangles()) {
                let t = t.map(|vertex| a.vertices()[vertex as usize].as_dvec3());
                for (j, u) in (0..).zip(b.triangles()) {
                    let u = u.map(|vertex| pose.apply(b.vertices()[vertex as usize]));
                    if triangles_intersect(&t, &u) {
                        expected.push([i, j]);
                    }
                }
            }
            assert!(expected.len() > 100, "{} pairs at {size}", expected.len());
            assert_eq!(pairs(&a, &b, &pose), expected, "at {size}");
        }
    }
}
