//! Triangle meshes: validated, in file order, never repaired behind the user's back.

use std::io::{self, Write};
use std::path::Path;

use glam::{DVec3, Vec3};

use crate::error::MeshError;
use crate::format::{obj, off, ply, stl};
use crate::predicates::Axis;

/// A triangle mesh: finite `f32` vertices and triangles that index them, both in the order given.
///
/// There is at least one triangle. Vertices are never merged, split or reordered, and triangles of zero area are kept
/// ([`zero_area`](Self::zero_area) lists them), so that indices mean what they mean in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// What reads a format.
type Parser = fn(&[u8]) -> Result<TriangleMesh, MeshError>;

impl TriangleMesh {
    /// A mesh from its vertices \[m] and its triangles, three vertex indices each.
    ///
    /// # Errors
    ///
    /// No triangle, an index out of range, a coordinate that is not finite, or more elements than `u32` can count.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        check_count("vertices", vertices.len())?;
        check_count("triangles", triangles.len())?;
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        check_finite(&vertices)?;
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices.len()) {
                return Err(MeshError::IndexOutOfRange {
                    triangle,
                    index,
                    vertices: vertices.len(),
                });
            }
        }
        Ok(Self {
            vertices,
            triangles,
        })
    }

    /// Reads a mesh file; the extension (.obj, .stl, .ply or .off, in any case) says in which format.
    ///
    /// # Errors
    ///
    /// Always a [`MeshError::InFile`], with what [`from_obj`](Self::from_obj), [`from_stl`](Self::from_stl),
    /// [`from_ply`](Self::from_ply) or [`from_off`](Self::from_off) says, or with why the file cannot be read.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        let path = path.as_ref();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        let parse: Option<Parser> = match extension.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::from_obj),
            "stl" => Some(Self::from_stl),
            "ply" => Some(Self::from_ply),
            "off" => Some(Self::from_off),
            _ => None,
        };
        parse
            .ok_or(MeshError::UnknownExtension)
            .and_then(|parse| {
                let bytes = std::fs::read(path).map_err(|e| MeshError::Read { kind: e.kind() })?;
                parse(&bytes)
            })
            .map_err(|error| MeshError::InFile {
                path: path.to_owned(),
                error: Box::new(error),
            })
    }

    /// Reads a Wavefront OBJ file.
    ///
    /// Coordinates are rounded to the nearest `f32`; triangles are numbered in the order of the file, whatever groups,
    /// objects and materials it has. Polygons of more than three vertices are divided into a fan from their first
    /// vertex if they are planar and convex, and refused otherwise: up to 1e-4 of the polygon's radius and 2^-20, a
    /// millionth, of its largest coordinate.
    ///
    /// # Errors
    ///
    /// Malformed statements, coordinates that are no finite `f32`, indices out of range and polygons that cannot be
    /// divided, each with its line; and what [`new`](Self::new) says.
    pub fn from_obj(bytes: &[u8]) -> Result<Self, MeshError> {
        obj::read(bytes)
    }

    /// Reads an STL file, binary or text. Every facet gets three vertices of its own.
    ///
    /// # Errors
    ///
    /// A length that does not fit the facet count, coordinates that are not finite, malformed lines; and what
    /// [`new`](Self::new) says.
    pub fn from_stl(bytes: &[u8]) -> Result<Self, MeshError> {
        stl::read(bytes)
    }

    /// Reads a PLY file: text, or binary of either byte order.
    ///
    /// Vertices are those of the element `vertex`, triangles those of the lists `vertex_indices` (or `vertex_index`)
    /// of the element `face`, both in the order of the file; coordinates are rounded to the nearest `f32`, and polygons
    /// divided as in OBJ files. Other elements and properties are passed over.
    ///
    /// # Errors
    ///
    /// Malformed headers, elements that are cut off or followed by something else, indices out of range and polygons
    /// that cannot be divided, each with its line or its element and byte; and what [`new`](Self::new) says.
    pub fn from_ply(bytes: &[u8]) -> Result<Self, MeshError> {
        ply::read(bytes)
    }

    /// Reads an OFF file in text, one vertex or face a line; the same polygons as of OBJ files. Normals, colours and
    /// texture coordinates are passed over.
    ///
    /// # Errors
    ///
    /// Malformed lines, indices out of range and polygons that cannot be divided, each with its line; and what
    /// [`new`](Self::new) says.
    pub fn from_off(bytes: &[u8]) -> Result<Self, MeshError> {
        off::read(bytes)
    }

    /// Writes the mesh as Wavefront OBJ; reading it back gives the same mesh.
    ///
    /// # Errors
    ///
    /// What the writer says.
    pub fn write_obj(&self, writer: impl Write) -> io::Result<()> {
        obj::write(self, writer)
    }

    /// Moves the vertices \[m], as many as there are.
    ///
    /// # Errors
    ///
    /// Another number of vertices, or a coordinate that is not finite; then nothing changes.
    pub fn set_vertices(&mut self, vertices: Vec<Vec3>) -> Result<(), MeshError> {
        let (expected, found) = (self.vertices.len(), vertices.len());
        if expected != found {
            return Err(MeshError::VertexCount { expected, found });
        }
        check_finite(&vertices)?;
        self.vertices = vertices;
        Ok(())
    }

    /// The vertices \[m].
    #[must_use]
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// The triangles, three vertex indices each.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The number of triangles, at least one.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a mesh is never empty")]
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The corners of a triangle \[m].
    ///
    /// # Panics
    ///
    /// If there is no triangle of this index, as slices do.
    #[must_use]
    pub fn triangle(&self, index: usize) -> [Vec3; 3] {
        self.triangles[index].map(|i| self.vertices[i as usize])
    }

    /// The corners of a triangle in `f64` \[m].
    #[inline]
    pub(crate) fn wide_triangle(&self, index: u32) -> [DVec3; 3] {
        // Written out, for want of a map over arrays that compiles to as little.
        let [a, b, c] = self.triangles[index as usize];
        let corner = |i: u32| self.vertices[i as usize].as_dvec3();
        [corner(a), corner(b), corner(c)]
    }

    /// The triangles whose corners lie on one line or in one point, exactly.
    #[must_use]
    pub fn zero_area(&self) -> Vec<u32> {
        (0_u32..)
            .take(self.len())
            .filter(|&index| Axis::of_plane(&self.wide_triangle(index)).is_none())
            .collect()
    }
}

fn check_finite(vertices: &[Vec3]) -> Result<(), MeshError> {
    match vertices.iter().position(|v| !v.is_finite()) {
        Some(vertex) => Err(MeshError::NonFiniteVertex { vertex }),
        None => Ok(()),
    }
}

/// Refuses counts that 32-bit indices cannot name.
pub(crate) fn check_count(element: &'static str, count: usize) -> Result<(), MeshError> {
    match u32::try_from(count) {
        Ok(_) => Ok(()),
        Err(_) => Err(MeshError::TooMany { element, count }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_pointer_width = "64")]
    fn counts_beyond_u32_are_refused() {
        let most = u32::MAX as usize;
        assert_eq!(check_count("vertices", most), Ok(()));
        let count = most + 1;
        assert_eq!(
            check_count("triangles", count),
            Err(MeshError::TooMany {
                element: "triangles",
                count
            })
        );
    }

    #[test]
    fn zero_area_is_exact() {
        let step = f32::EPSILON;
        let mesh = TriangleMesh::new(
            vec![
                Vec3::ZERO,
                Vec3::ONE,
                Vec3::splat(3.0),
                Vec3::new(3.0, 3.0, 3.0 + 2.0 * step),
            ],
            vec![[0, 1, 2], [0, 1, 3], [0, 0, 1], [2, 2, 2]],
        )
        .unwrap();
        assert_eq!(mesh.zero_area(), [0, 2, 3]);
    }
}
