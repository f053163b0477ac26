//! Wavefront OBJ.
//!
//! A reader of our own, since general ones merge or split vertices by their texture coordinates and normals, and forget
//! in which line a face was: here indices and lines are part of the result.

use std::io::{self, Write};

use glam::Vec3;

use super::polygon;
use super::text::{coordinates, number, parse, syntax, without_mark, words};
use crate::error::{MeshError, Place};
use crate::mesh::{TriangleMesh, check_count};

/// Statements without bearing on the triangles.
const IGNORED: [&[u8]; 20] = [
    b"vt",
    b"vn",
    b"vp",
    b"g",
    b"o",
    b"s",
    b"mg",
    b"p",
    b"l",
    b"mtllib",
    b"usemtl",
    b"maplib",
    b"usemap",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"shadow_obj",
    b"trace_obj",
    b"call",
];

/// A polygon as read: its line and where its corners end in the list of all corners.
struct Face {
    line: usize,
    end: usize,
}

pub(crate) fn read(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let mut vertices = Vec::new();
    let mut corners = Vec::new();
    let mut faces = Vec::new();
    for (line, statement) in Statements::new(bytes) {
        let mut words = words(&statement);
        match words.next() {
            None => {}
            Some(b"v") => vertices.push(vertex(line, words)?),
            Some(b"f") => {
                for word in words {
                    corners.push(corner(line, word, vertices.len())?);
                }
                faces.push(Face {
                    line,
                    end: corners.len(),
                });
            }
            Some(keyword) if IGNORED.contains(&keyword) => {}
            Some(keyword) => {
                let expected = "an OBJ statement for polygons (v, f, vt, vn, g, o, ...)";
                return Err(syntax(line, expected, keyword));
            }
        }
    }
    check_count("vertices", vertices.len())?;
    // Faces may name vertices that follow them, so they are looked at only now.
    let mut triangles = Vec::with_capacity(faces.len());
    let mut start = 0;
    for Face { line, end } in faces {
        divide(line, &corners[start..end], &vertices, &mut triangles)?;
        start = end;
    }
    TriangleMesh::new(vertices, triangles)
}

/// The position in `v x y z`, with an optional weight, which must be 1, or colour.
fn vertex<'a>(line: usize, mut words: impl Iterator<Item = &'a [u8]>) -> Result<Vec3, MeshError> {
    let position = coordinates(line, &mut words)?;
    let mut extra = 0;
    let mut first = 1.0;
    for word in words {
        let value = number(line, word)?;
        if extra == 0 {
            first = value;
        }
        extra += 1;
    }
    if extra == 1 && first != 1.0 {
        let found = first.to_string();
        return Err(syntax(line, "a vertex of weight 1", found.as_bytes()));
    }
    Ok(Vec3::from_array(position))
}

/// The vertex index, from 0, in a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`; it may be beyond the vertices read so far,
/// but an index relative to them is resolved.
fn corner(line: usize, word: &[u8], vertices: usize) -> Result<Corner, MeshError> {
    let malformed = || syntax(line, "a face corner v, v/vt, v//vn or v/vt/vn", word);
    let mut parts = word.split(|&c| c == b'/');
    let index: i64 = parts.next().and_then(parse).ok_or_else(malformed)?;
    // Texture and normal indices may be missing or empty, but there is no third.
    if !parts.next().is_none_or(absent_or_index)
        || !parts.next().is_none_or(absent_or_index)
        || parts.next().is_some()
    {
        return Err(malformed());
    }
    // From 1 upwards, or from -1 backwards: 0 names nothing.
    let resolved = if index > 0 {
        usize::try_from(index - 1).ok()
    } else if index < 0 {
        usize::try_from(index.unsigned_abs())
            .ok()
            .and_then(|back| vertices.checked_sub(back))
    } else {
        None
    };
    match resolved {
        Some(vertex) => Ok(Corner { vertex, index }),
        None => Err(MeshError::FaceIndex {
            line,
            index,
            vertices,
        }),
    }
}

fn absent_or_index(part: &[u8]) -> bool {
    part.is_empty() || parse::<i64>(part).is_some()
}

/// A corner of a face: the vertex, and the index as written.
struct Corner {
    vertex: usize,
    index: i64,
}

/// Divides a face into triangles, a fan from its first corner.
fn divide(
    line: usize,
    face: &[Corner],
    vertices: &[Vec3],
    triangles: &mut Vec<[u32; 3]>,
) -> Result<(), MeshError> {
    let id = |corner: &Corner| match u32::try_from(corner.vertex) {
        Ok(id) if corner.vertex < vertices.len() => Ok(id),
        _ => Err(MeshError::FaceIndex {
            line,
            index: corner.index,
            vertices: vertices.len(),
        }),
    };
    let ids = face.iter().map(id).collect::<Result<Vec<u32>, _>>()?;
    polygon::fan(&ids, vertices, triangles).map_err(|problem| MeshError::Polygon {
        place: Place::Line(line),
        problem,
    })
}

/// The statements of a file with the lines where they start, comments removed and continued lines joined.
struct Statements<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Statements<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self {
            rest: without_mark(bytes),
            line: 0,
        }
    }

    /// The next line, less its end, its comment and the backslash that continues it; and whether there was one.
    fn line(&mut self) -> (&'a [u8], bool) {
        let end = self.rest.iter().position(|&c| c == b'\n');
        let (line, rest) = match end {
            Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
            None => (self.rest, &[][..]),
        };
        self.rest = rest;
        self.line += 1;
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        match line.iter().position(|&c| c == b'#') {
            Some(comment) => (&line[..comment], false),
            None => match line.strip_suffix(b"\\") {
                Some(line) => (line, true),
                None => (line, false),
            },
        }
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = (usize, std::borrow::Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let (line, mut continued) = self.line();
        let start = self.line;
        let mut statement = std::borrow::Cow::Borrowed(line);
        while continued && !self.rest.is_empty() {
            let line;
            (line, continued) = self.line();
            let joined = statement.to_mut();
            joined.push(b' ');
            joined.extend_from_slice(line);
        }
        Some((start, statement))
    }
}

pub(crate) fn write(mesh: &TriangleMesh, writer: impl Write) -> io::Result<()> {
    let mut writer = io::BufWriter::new(writer);
    // The debug format of f32 is the shortest that reads back the same, with an exponent where that is shorter.
    for v in mesh.vertices() {
        writeln!(writer, "v {:?} {:?} {:?}", v.x, v.y, v.z)?;
    }
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|i| u64::from(i) + 1);
        writeln!(writer, "f {a} {b} {c}")?;
    }
    writer.flush()
}
