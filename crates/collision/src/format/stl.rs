//! STL, binary and text.
//!
//! Both are soups of facets: each gets three vertices of its own. The normals in the file are ignored.

use glam::Vec3;

use super::text::{coordinates, syntax, without_mark, words};
use crate::error::MeshError;
use crate::mesh::{TriangleMesh, check_count};

/// Bytes before the first facet of a binary file: 80 of comment and the facet count.
const HEADER: usize = 84;

/// Bytes a facet: normal and three vertices in `f32`, and two of attributes.
const FACET: usize = 50;

pub(crate) fn read(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let mut vertices = Vec::new();
    if is_binary(bytes) {
        read_binary(bytes, &mut vertices)?;
    } else {
        read_text(bytes, &mut vertices)?;
    }
    check_count("vertices", vertices.len())?;
    let triangles = (0_u32..)
        .step_by(3)
        .take(vertices.len() / 3)
        .map(|i| [i, i + 1, i + 2])
        .collect();
    TriangleMesh::new(vertices, triangles)
}

/// Binary files may start with "solid" as text files must. But a length that fits the count at byte 80 is binary: four
/// characters of text there would mean more than 100 million facets. And text has no zero bytes, so a damaged binary
/// file is not taken for text either.
fn is_binary(bytes: &[u8]) -> bool {
    if declared_facets(bytes).is_some_and(|facets| expected_length(facets) == bytes.len() as u64) {
        return true;
    }
    let starts_as_text = without_mark(bytes)
        .trim_ascii_start()
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    !starts_as_text || bytes.iter().take(4 * HEADER).any(|&c| c == 0)
}

fn declared_facets(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEADER - 4..)?.first_chunk()?;
    Some(u32::from_le_bytes(*count))
}

fn expected_length(facets: u32) -> u64 {
    HEADER as u64 + FACET as u64 * u64::from(facets)
}

fn read_binary(bytes: &[u8], vertices: &mut Vec<Vec3>) -> Result<(), MeshError> {
    let found = bytes.len() as u64;
    let facets = declared_facets(bytes).ok_or(MeshError::StlHeader { found })?;
    let expected = expected_length(facets);
    if found != expected {
        return Err(MeshError::StlLength {
            facets,
            expected,
            found,
        });
    }
    let (facets, _) = bytes[HEADER..].as_chunks::<FACET>();
    vertices.reserve(3 * facets.len());
    for (index, facet) in facets.iter().enumerate() {
        let (numbers, _) = facet.as_chunks::<4>();
        let (points, _) = numbers[3..].as_chunks::<3>();
        for point in points {
            let vertex = Vec3::from_array(point.map(f32::from_le_bytes));
            if !vertex.is_finite() {
                return Err(MeshError::StlNonFinite {
                    facet: index,
                    offset: (HEADER + FACET * index) as u64,
                });
            }
            vertices.push(vertex);
        }
    }
    Ok(())
}

/// What a line of a text file may be, in the order of the lines of a facet.
#[derive(Clone, Copy)]
enum Expected {
    Solid,
    FacetOrEnd,
    OuterLoop,
    Vertex(u8),
    EndLoop,
    EndFacet,
    /// After a solid: another one, or the end of the file.
    SolidOrNothing,
}

impl Expected {
    fn description(self) -> &'static str {
        match self {
            Self::Solid => "`solid`",
            Self::FacetOrEnd => "`facet normal` or `endsolid`",
            Self::OuterLoop => "`outer loop`",
            Self::Vertex(_) => "`vertex` and three numbers",
            Self::EndLoop => "`endloop`",
            Self::EndFacet => "`endfacet`",
            Self::SolidOrNothing => "`solid` or the end of the file",
        }
    }
}

fn read_text(bytes: &[u8], vertices: &mut Vec<Vec3>) -> Result<(), MeshError> {
    let mut expected = Expected::Solid;
    let mut last = 0;
    for (line, text) in (1..).zip(without_mark(bytes).split(|&c| c == b'\n')) {
        let mut words = words(text);
        let Some(keyword) = words.next() else {
            continue;
        };
        let keyword = keyword.to_ascii_lowercase();
        let mut followed_by = |word: &str| {
            words
                .next()
                .is_some_and(|found| found.eq_ignore_ascii_case(word.as_bytes()))
        };
        expected = match (expected, keyword.as_slice()) {
            // The rest of the line is a name.
            (Expected::Solid | Expected::SolidOrNothing, b"solid") => Expected::FacetOrEnd,
            (Expected::FacetOrEnd, b"endsolid") => Expected::SolidOrNothing,
            (Expected::FacetOrEnd, b"facet") if followed_by("normal") => Expected::OuterLoop,
            (Expected::OuterLoop, b"outer") if followed_by("loop") => Expected::Vertex(0),
            (Expected::Vertex(index), b"vertex") => {
                vertices.push(Vec3::from_array(coordinates(line, &mut words)?));
                if let Some(extra) = words.next() {
                    return Err(syntax(line, "three numbers", extra));
                }
                match index {
                    2 => Expected::EndLoop,
                    _ => Expected::Vertex(index + 1),
                }
            }
            (Expected::EndLoop, b"endloop") => Expected::EndFacet,
            (Expected::EndFacet, b"endfacet") => Expected::FacetOrEnd,
            (expected, _) => {
                return Err(syntax(line, expected.description(), text.trim_ascii()));
            }
        };
        last = line;
    }
    match expected {
        Expected::SolidOrNothing => Ok(()),
        expected => Err(syntax(
            last + 1,
            expected.description(),
            b"the end of the file",
        )),
    }
}
