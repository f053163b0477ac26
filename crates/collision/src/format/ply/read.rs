//! Reading: vertices and faces in the order of the file.

use glam::Vec3;

use super::header::{Element, Encoding, Header, Meaning, Role};
use super::source::{Binary, Source, Text};
use crate::error::MeshError;
use crate::format::polygon;
use crate::mesh::{TriangleMesh, check_count};

pub(crate) fn read(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let header = Header::read(bytes)?;
    match header.encoding {
        Encoding::Text => read_body(&header, Text::new(&header)),
        Encoding::LittleEndian | Encoding::BigEndian => read_body(&header, Binary::new(&header)),
    }
}

/// Faces as read: where each starts in the file, and where its corners end in the list of all corners.
#[derive(Default)]
struct Faces {
    corners: Vec<i64>,
    starts_and_ends: Vec<(usize, usize)>,
}

fn read_body(header: &Header<'_>, mut source: impl Source) -> Result<TriangleMesh, MeshError> {
    let mut vertices = Vec::new();
    let mut faces = Faces::default();
    for element in &header.elements {
        // Elements of nothing take no place in the file, however many they are.
        let count = if element.properties.is_empty() {
            0
        } else {
            element.count
        };
        for (index, _) in (0..).zip(0..count) {
            source.start(element.role, index)?;
            let start = source.position();
            let position = read_element(element, &mut source, &mut faces.corners, (index, start))?;
            match element.role {
                Role::Vertex => vertices.push(position),
                Role::Face => faces.starts_and_ends.push((start, faces.corners.len())),
                Role::Other => {}
            }
        }
    }
    source.finish()?;
    check_count("vertices", vertices.len())?;
    // Faces may come before vertices, so they are looked at only now.
    let mut triangles = Vec::with_capacity(faces.starts_and_ends.len());
    let mut ids = Vec::new();
    let mut first = 0;
    for (index, &(position, end)) in faces.starts_and_ends.iter().enumerate() {
        let place = || source.place(Role::Face, index, position);
        ids.clear();
        for &corner in &faces.corners[first..end] {
            match u32::try_from(corner) {
                Ok(id) if (id as usize) < vertices.len() => ids.push(id),
                _ => {
                    return Err(MeshError::FaceVertex {
                        place: place(),
                        index: corner,
                        vertices: vertices.len(),
                    });
                }
            }
        }
        polygon::fan(&ids, &vertices, &mut triangles).map_err(|problem| MeshError::Polygon {
            place: place(),
            problem,
        })?;
        first = end;
    }
    TriangleMesh::new(vertices, triangles)
}

/// Reads one element, which starts there: the position of a vertex, and the corners of a face.
fn read_element(
    element: &Element,
    source: &mut impl Source,
    corners: &mut Vec<i64>,
    (index, start): (usize, usize),
) -> Result<Vec3, MeshError> {
    let mut position = Vec3::ZERO;
    for property in &element.properties {
        let count = match property.count {
            Some(number) => source.integer(number)?,
            None => 1,
        };
        if count < 0 {
            let place = source.place(element.role, index, start);
            return Err(MeshError::NegativeCount { place, count });
        }
        for _ in 0..count {
            match property.meaning {
                Meaning::Coordinate(k) => position[k] = source.coordinate(property.number)?,
                Meaning::Corners => corners.push(source.integer(property.number)?),
                Meaning::Other => source.skip(property.number)?,
            }
        }
    }
    source.end()?;
    Ok(position)
}
