//! OFF, the object file format of Geomview, as text: one vertex or face a line.

use glam::Vec3;

use super::polygon;
use super::text::{coordinates, parse, syntax, without_mark, words};
use crate::error::{MeshError, Place};
use crate::mesh::{TriangleMesh, check_count};

/// First words of files with three coordinates a vertex; what else vertices have comes after those.
const KEYWORDS: [&[u8]; 8] = [
    b"OFF", b"COFF", b"NOFF", b"CNOFF", b"STOFF", b"STCOFF", b"STNOFF", b"STCNOFF",
];

/// Numbers that a vertex can have beside its coordinates: a normal, a colour and texture coordinates.
const MOST_BESIDE: usize = 3 + 4 + 2;

pub(crate) fn read(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    let mut lines = Lines {
        lines: without_mark(bytes)
            .trim_ascii_end()
            .split(is_end as fn(&u8) -> bool),
        line: 0,
    };
    let mut first = lines.next("`OFF`")?;
    if let Some(keyword) = words(first).next()
        && parse::<u64>(keyword).is_none()
    {
        if !KEYWORDS.contains(&keyword) {
            return Err(syntax(
                lines.line,
                "`OFF` or `OFF` with a prefix C, N or ST",
                keyword,
            ));
        }
        first = first[keyword.len()..].trim_ascii_start();
        if first.starts_with(b"BINARY") {
            return Err(syntax(lines.line, "a file in text, not binary", first));
        }
        if first.is_empty() {
            first = lines.next("the numbers of vertices and of faces")?;
        }
    }
    let mut counts = words(first).map(parse::<u64>);
    let (Some(Some(vertex_count)), Some(Some(face_count)), None | Some(Some(_))) =
        (counts.next(), counts.next(), counts.next())
    else {
        return Err(syntax(
            lines.line,
            "the numbers of vertices and of faces",
            first,
        ));
    };
    if counts.next().is_some() {
        let expected = "the counts on a line of their own, then one vertex or face a line";
        return Err(syntax(lines.line, expected, first));
    }

    let mut vertices = Vec::new();
    for _ in 0..vertex_count {
        let line = lines.next("a vertex")?;
        let mut words = words(line);
        vertices.push(Vec3::from_array(coordinates(lines.line, &mut words)?));
        if pass_over(lines.line, words)? > MOST_BESIDE {
            return Err(syntax(lines.line, "one vertex a line", line));
        }
    }
    check_count("vertices", vertices.len())?;
    let mut triangles = Vec::new();
    let mut ids = Vec::new();
    for _ in 0..face_count {
        let text = lines.next("a face")?;
        face(lines.line, text, vertices.len(), &mut ids)?;
        let place = Place::Line(lines.line);
        polygon::fan(&ids, &vertices, &mut triangles)
            .map_err(|problem| MeshError::Polygon { place, problem })?;
    }
    match lines.next("") {
        Ok(extra) => Err(syntax(lines.line, "the end of the file", extra)),
        Err(_) => TriangleMesh::new(vertices, triangles),
    }
}

fn is_end(c: &u8) -> bool {
    *c == b'\n'
}

/// The vertices of a face: their number and so many indices; a colour may follow.
fn face(line: usize, text: &[u8], vertices: usize, ids: &mut Vec<u32>) -> Result<(), MeshError> {
    let mut words = words(text);
    let count = words.next().and_then(parse::<u64>);
    let count = count.ok_or_else(|| syntax(line, "a number of corners", text))?;
    ids.clear();
    for _ in 0..count {
        let word = words.next().unwrap_or_default();
        let index = parse::<i64>(word).ok_or_else(|| syntax(line, "a vertex index", word))?;
        match u32::try_from(index) {
            Ok(id) if (id as usize) < vertices => ids.push(id),
            _ => {
                return Err(MeshError::FaceVertex {
                    place: Place::Line(line),
                    index,
                    vertices,
                });
            }
        }
    }
    pass_over(line, words)?;
    Ok(())
}

/// Checks that the rest of a line is numbers, which may be NaN, and says how many.
fn pass_over<'a>(line: usize, words: impl Iterator<Item = &'a [u8]>) -> Result<usize, MeshError> {
    let mut count = 0;
    for word in words {
        parse::<f64>(word).ok_or_else(|| syntax(line, "a decimal number", word))?;
        count += 1;
    }
    Ok(count)
}

struct Lines<'a> {
    lines: std::slice::Split<'a, u8, fn(&u8) -> bool>,
    line: usize,
}

impl<'a> Lines<'a> {
    /// The next line with something on it, less its comment.
    fn next(&mut self, expected: &'static str) -> Result<&'a [u8], MeshError> {
        loop {
            self.line += 1;
            let Some(line) = self.lines.next() else {
                return Err(syntax(self.line, expected, b"the end of the file"));
            };
            let end = line.iter().position(|&c| c == b'#').unwrap_or(line.len());
            let line = line[..end].trim_ascii();
            if !line.is_empty() {
                return Ok(line);
            }
        }
    }
}
