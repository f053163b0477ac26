//! Mesh assets: triangles in the file, or given by the caller.

use super::defaults::Element;
use super::{Options, Sections};
use crate::{FileError, Problem, TriangleSoup};
use glam::DVec3;
use std::collections::HashMap;
use std::sync::Arc;
use vertebra_assembly::xml::{Node, Reader, XmlProblem};

/// A mesh asset, by name.
pub(super) struct Mesh {
    /// Its triangles, if the file or the caller has them.
    pub(super) triangles: Option<Arc<TriangleSoup>>,
    line: u32,
}

/// Reads the meshes of all `<asset>` sections.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    options: &Options,
) -> Result<HashMap<&'n str, Mesh>, FileError> {
    let mut meshes = HashMap::new();
    for &section in &sections.assets {
        for (tag, node) in reader.children(section)? {
            if tag != "mesh" {
                reader.ignore(node);
                continue;
            }
            let known = ["name", "class", "file", "scale", "vertex", "face"];
            reader.ignore_attributes_but(node, &known);
            let element = sections.defaults.element(reader, node, None)?;
            let file = element.text(reader, "file")?;
            let name = match reader.optional_text(node, "name")? {
                Some(name) => name,
                None => stem(file.ok_or_else(|| {
                    let attribute = "name";
                    reader.error(node, XmlProblem::MissingAttribute { attribute })
                })?),
            };
            let scale = element.vector(reader, "scale")?.unwrap_or(DVec3::ONE);
            let triangles = match file {
                Some(file) => options.meshes.get(file).cloned(),
                None => inline(reader, element)?.map(Arc::new),
            };
            let triangles = triangles.map(|mesh| scaled(mesh, scale));
            let line = reader.line(node);
            if let Some(first) = meshes.insert(name, Mesh { triangles, line }) {
                let problem = Problem::DuplicateName {
                    first_line: first.line,
                };
                return Err(FileError::new(reader.location(node), problem));
            }
        }
    }
    Ok(meshes)
}

/// A mesh without a name is called as its file, less folder and ending.
fn stem(file: &str) -> &str {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// Triangles stated in the file. Vertices alone are a convex hull, which is not computed.
fn inline<'a>(
    reader: &Reader<'a>,
    element: Element<'_, '_, 'a>,
) -> Result<Option<TriangleSoup>, FileError> {
    let (Some(vertices), Some(faces)) = (
        element.list(reader, "vertex")?,
        element.list(reader, "face")?,
    ) else {
        return Ok(None);
    };
    let wrong = |attribute: &'static str, found: usize| {
        let problem = XmlProblem::WrongCount {
            attribute,
            expected: found.next_multiple_of(3),
            found,
        };
        FileError::from(reader.error(element.source(attribute), problem))
    };
    let (points, []) = vertices.as_chunks::<3>() else {
        return Err(wrong("vertex", vertices.len()));
    };
    let (triangles, []) = faces.as_chunks::<3>() else {
        return Err(wrong("face", faces.len()));
    };
    let node = element.source("face");
    Ok(Some(TriangleSoup {
        vertices: points
            .iter()
            .map(|&point| DVec3::from_array(point))
            .collect(),
        triangles: triangles
            .iter()
            .map(|corners| index_triangle(reader, node, corners, points.len()))
            .collect::<Result<_, _>>()?,
    }))
}

fn index_triangle<'a>(
    reader: &Reader<'a>,
    node: Node<'_, 'a>,
    corners: &[f64; 3],
    count: usize,
) -> Result<[u32; 3], FileError> {
    let mut indices = [0; 3];
    for (index, &corner) in indices.iter_mut().zip(corners) {
        // No more vertices than 2^32 fit into any file that can be read.
        #[expect(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
        let is_index = corner >= 0.0 && corner < count as f64 && corner.fract() == 0.0;
        if !is_index {
            let problem = Problem::OutOfRange {
                quantity: "an index in `face`",
                value: corner,
                requirement: "that of a vertex",
            };
            return Err(FileError::new(reader.location(node), problem));
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "it was checked above"
        )]
        {
            *index = corner as u32;
        }
    }
    Ok(indices)
}

/// A mesh stretched along its axes; an odd number of reflections turns its triangles over.
fn scaled(mesh: Arc<TriangleSoup>, scale: DVec3) -> Arc<TriangleSoup> {
    if scale == DVec3::ONE {
        return mesh;
    }
    let mirrored = scale.x * scale.y * scale.z < 0.0;
    let turn = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    Arc::new(TriangleSoup {
        vertices: mesh.vertices.iter().map(|&vertex| vertex * scale).collect(),
        triangles: mesh.triangles.iter().map(turn).collect(),
    })
}
