//! Vertices of equal position: one place, whatever their indices.
//!
//! Files repeat vertices, some for every triangle. Meshes keep them as they are; where it matters that two triangles
//! share a corner, positions say so.

use glam::DVec3;

use crate::mesh::TriangleMesh;

/// The different positions of a list of points.
pub(crate) struct Places {
    /// The positions, each once, in an order that depends on nothing else.
    pub(crate) points: Vec<DVec3>,
    /// For each point of the list its place among them.
    pub(crate) numbers: Vec<u32>,
}

impl Places {
    /// The place of each vertex of a mesh.
    pub(crate) fn of_vertices(mesh: &TriangleMesh) -> Vec<u32> {
        let points: Vec<DVec3> = mesh.vertices().iter().map(|v| v.as_dvec3()).collect();
        Self::of(&points).numbers
    }

    /// Of at most `u32::MAX` points, as a mesh has.
    pub(crate) fn of(list: &[DVec3]) -> Self {
        // Adding zero makes negative zeros positive; then equal numbers have equal bits.
        let bits = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
        let mut sorted: Vec<([u64; 3], u32)> = list.iter().map(|&p| bits(p)).zip(0..).collect();
        sorted.sort_unstable();
        let mut places = Self {
            points: Vec::new(),
            numbers: vec![0; list.len()],
        };
        let equal = sorted.chunk_by(|left, right| left.0 == right.0);
        for (number, same) in (0..).zip(equal) {
            let position = same.iter().map(|(bits, _)| bits.map(f64::from_bits));
            places.points.extend(position.map(DVec3::from).next());
            for (_, index) in same {
                places.numbers[*index as usize] = number;
            }
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_zero_is_zero() {
        let places = Places::of(&[DVec3::X, DVec3::ZERO, DVec3::X, -DVec3::ZERO, DVec3::Y]);
        assert_eq!(places.points, [DVec3::ZERO, DVec3::Y, DVec3::X]);
        assert_eq!(places.numbers, [2, 0, 2, 0, 1]);
        assert!(Places::of(&[]).points.is_empty());
    }
}
