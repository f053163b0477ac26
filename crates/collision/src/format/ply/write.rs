//! Writing: meshes with a colour a face, to look at results.

use std::io::{self, Write};

use vertebra_spatial::Pose;

use crate::mesh::TriangleMesh;

/// A mesh in a PLY file, placed and coloured.
#[derive(Clone, Copy)]
pub struct PlyPart<'a> {
    /// The mesh.
    pub mesh: &'a TriangleMesh,
    /// Where it stands.
    pub pose: Pose,
    /// The colour (red, green, blue) of a triangle.
    pub color: &'a dyn Fn(usize) -> [u8; 3],
}

/// Writes meshes into one binary PLY file, a colour a face.
///
/// To show what collides, colour the triangles of [`Query::mask`](crate::Query::mask):
///
/// ```
/// # use glam::Vec3;
/// # use vertebra_collision::{PlyPart, Query, TriangleMesh, write_ply};
/// # use vertebra_spatial::Pose;
/// # let a = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// # let b = a.clone();
/// let (hit_a, hit_b) = Query::new(&a, &b).mask()?;
/// let color_a = |i: usize| if hit_a[i] { [220, 30, 30] } else { [255; 3] };
/// let color_b = |i: usize| if hit_b[i] { [30, 160, 60] } else { [120, 160, 230] };
/// let mut file = Vec::new();
/// write_ply(&mut file, &[
///     PlyPart { mesh: &a, pose: Pose::IDENTITY, color: &color_a },
///     PlyPart { mesh: &b, pose: Pose::IDENTITY, color: &color_b },
/// ])?;
/// # assert!(file.starts_with(b"ply\n"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// What the writer says, and [`io::ErrorKind::InvalidInput`] for more vertices in all than 32-bit indices can name.
pub fn write_ply(writer: impl Write, parts: &[PlyPart<'_>]) -> io::Result<()> {
    let vertices: usize = parts.iter().map(|part| part.mesh.vertices().len()).sum();
    let faces: usize = parts.iter().map(|part| part.mesh.len()).sum();
    if u32::try_from(vertices).is_err() {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            format!("{vertices} vertices are too many for one PLY file: write fewer meshes"),
        ));
    }
    let mut writer = io::BufWriter::new(writer);
    write!(
        writer,
        "ply\nformat binary_little_endian 1.0\n\
         element vertex {vertices}\n\
         property float x\nproperty float y\nproperty float z\n\
         element face {faces}\n\
         property list uchar uint vertex_indices\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         end_header\n"
    )?;
    for part in parts {
        for vertex in part.mesh.vertices() {
            let posed = part.pose.transform_point(vertex.as_dvec3()).as_vec3();
            for coordinate in posed.to_array() {
                writer.write_all(&coordinate.to_le_bytes())?;
            }
        }
    }
    let mut first = 0_u32;
    for part in parts {
        for (index, corners) in part.mesh.triangles().iter().enumerate() {
            writer.write_all(&[3])?;
            for corner in corners {
                writer.write_all(&(first + corner).to_le_bytes())?;
            }
            writer.write_all(&(part.color)(index))?;
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the sum over all parts fits, as checked above"
        )]
        {
            first += part.mesh.vertices().len() as u32;
        }
    }
    writer.flush()
}
