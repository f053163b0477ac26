//! The pairs that the device left, decided exactly.

use glam::{DVec3, Vec3};
use vertebra_shaders::collision::RECORD;

use crate::exact::triangles_intersect;
use crate::self_query::meet_beyond;
use crate::transform::RelativePose;

/// A pair of triangles with the coordinates that the device has of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) pair: [u32; 2],
    /// Which of the questions asked together it is about.
    pub(super) job: usize,
    a: [Vec3; 3],
    b: [Vec3; 3],
}

impl Record {
    /// The records of a list of words.
    pub(super) fn list(words: &[u32]) -> impl Iterator<Item = Self> {
        words.chunks_exact(RECORD).map(|words| {
            let corner = |k: usize| {
                let coordinate = |i: usize| f32::from_bits(words[3 + 3 * k + i]);
                Vec3::new(coordinate(0), coordinate(1), coordinate(2))
            };
            Self {
                pair: [words[0], words[1]],
                job: words[2] as usize,
                a: [corner(0), corner(1), corner(2)],
                b: [corner(3), corner(4), corner(5)],
            }
        })
    }

    /// The same with the triangles exchanged.
    pub(super) fn turned(&self) -> Self {
        let [a, b] = self.pair;
        Self {
            pair: [b, a],
            job: self.job,
            a: self.b,
            b: self.a,
        }
    }

    /// Both triangles, seen from A.
    pub(super) fn posed(&self, pose: &RelativePose) -> [[DVec3; 3]; 2] {
        [self.a.map(|p| p.as_dvec3()), self.b.map(|p| pose.apply(p))]
    }

    /// Whether two triangles of one mesh meet in more than their common corners.
    pub(super) fn meets_beyond(&self) -> bool {
        let [a, b] = self.posed(&RelativePose::IDENTITY);
        // Corners of one position are one.
        let id = |p: &DVec3| a.iter().chain(&b).zip(0..).find(|(q, _)| *q == p);
        let ids = |t: &[DVec3; 3]| [0, 1, 2].map(|k| id(&t[k]).map_or(u32::MAX, |(_, id)| id));
        let (ids_a, ids_b) = (ids(&a), ids(&b));
        if ids_a.iter().any(|corner| ids_b.contains(corner)) {
            meet_beyond((&a, ids_a), (&b, ids_b))
        } else {
            triangles_intersect(&a, &b)
        }
    }

    /// Whether the triangles meet.
    pub(super) fn meets(&self, pose: &RelativePose) -> bool {
        let [a, b] = self.posed(pose);
        triangles_intersect(&a, &b)
    }
}
