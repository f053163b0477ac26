//! The header: which elements follow, how many, and what each is made of.

use crate::error::MeshError;
use crate::format::text::{parse, syntax, words};

/// How the elements are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn named(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// What a property is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A coordinate of a vertex, x, y or z.
    Coordinate(usize),
    /// The vertices of a face.
    Corners,
    /// Nothing here.
    Other,
}

/// One number, or a list of them behind their count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Property {
    pub(super) count: Option<Number>,
    pub(super) number: Number,
    pub(super) meaning: Meaning,
}

/// What an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Vertex,
    Face,
    Other,
}

impl Role {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Vertex => "vertex",
            Self::Face => "face",
            Self::Other => "element",
        }
    }
}

/// So many elements of a kind.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) role: Role,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

/// What the header says, and what follows it.
#[derive(Debug)]
pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) body: &'a [u8],
    /// Lines before the body.
    pub(super) lines: usize,
    /// Bytes before the body.
    pub(super) bytes: usize,
}

impl<'a> Header<'a> {
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, MeshError> {
        let mut lines = Lines {
            rest: bytes,
            line: 0,
        };
        if lines.next()?.trim_ascii() != b"ply" {
            return Err(syntax(1, "`ply`", &bytes[..bytes.len().min(40)]));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let text = lines.next()?;
            let line = lines.line;
            let malformed = |expected| syntax(line, expected, text.trim_ascii());
            let mut words = words(text);
            match words.next() {
                None | Some(b"comment" | b"obj_info") => {}
                Some(b"format") => {
                    let known = match (words.next(), words.next()) {
                        (Some(b"ascii"), Some(b"1.0")) => Encoding::Text,
                        (Some(b"binary_little_endian"), Some(b"1.0")) => Encoding::LittleEndian,
                        (Some(b"binary_big_endian"), Some(b"1.0")) => Encoding::BigEndian,
                        _ => return Err(malformed("`format ascii 1.0` or a binary one")),
                    };
                    if encoding.replace(known).is_some() {
                        return Err(malformed("one `format` only"));
                    }
                }
                Some(b"element") => {
                    let expected = "`element`, a name and a count";
                    let (Some(name), Some(count)) = (words.next(), words.next().and_then(parse))
                    else {
                        return Err(malformed(expected));
                    };
                    let role = match name {
                        b"vertex" => Role::Vertex,
                        b"face" => Role::Face,
                        _ => Role::Other,
                    };
                    if role != Role::Other && elements.iter().any(|e| e.role == role) {
                        return Err(malformed("`vertex` and `face` once"));
                    }
                    if name == b"tristrips" && count > 0 {
                        return Err(malformed("triangles in an element `face`, not in strips"));
                    }
                    elements.push(Element {
                        role,
                        count,
                        properties: Vec::new(),
                    });
                }
                Some(b"property") => {
                    let element = elements.last_mut();
                    let element = element.ok_or_else(|| malformed("an `element` before"))?;
                    let property = property(element.role, words).ok_or_else(|| {
                        malformed("`property`, a type or `list` and two, and a name")
                    })?;
                    let twice = |p: &Property| p.meaning == property.meaning;
                    if property.meaning != Meaning::Other && element.properties.iter().any(twice) {
                        return Err(malformed("each coordinate and list of corners once"));
                    }
                    element.properties.push(property);
                }
                Some(b"end_header") => {
                    let encoding = encoding.ok_or_else(|| malformed("a `format` before"))?;
                    if let Some(missing) = elements.iter().find_map(what_is_missing) {
                        return Err(malformed(missing));
                    }
                    return Ok(Self {
                        encoding,
                        elements,
                        body: lines.rest,
                        lines: line,
                        bytes: bytes.len() - lines.rest.len(),
                    });
                }
                Some(_) => {
                    return Err(malformed(
                        "a header line (element, property, end_header, ...)",
                    ));
                }
            }
        }
    }
}

fn property<'a>(role: Role, mut words: impl Iterator<Item = &'a [u8]>) -> Option<Property> {
    let (count, number) = match words.next()? {
        b"list" => {
            let count = Number::named(words.next()?).filter(|count| count.is_integer())?;
            (Some(count), Number::named(words.next()?)?)
        }
        word => (None, Number::named(word)?),
    };
    let meaning = match (role, words.next()?, count) {
        (Role::Vertex, b"x", None) => Meaning::Coordinate(0),
        (Role::Vertex, b"y", None) => Meaning::Coordinate(1),
        (Role::Vertex, b"z", None) => Meaning::Coordinate(2),
        (Role::Face, b"vertex_indices" | b"vertex_index", Some(_)) if number.is_integer() => {
            Meaning::Corners
        }
        _ => Meaning::Other,
    };
    Some(Property {
        count,
        number,
        meaning,
    })
}

/// What an element lacks to be what it is called.
fn what_is_missing(element: &Element) -> Option<&'static str> {
    let has = |meaning| element.properties.iter().any(|p| p.meaning == meaning);
    match element.role {
        Role::Vertex if !(0..3).all(|k| has(Meaning::Coordinate(k))) => {
            Some("properties x, y and z of vertices")
        }
        Role::Face if !has(Meaning::Corners) => {
            Some("a list vertex_indices, of integers, of faces")
        }
        _ => None,
    }
}

struct Lines<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Result<&'a [u8], MeshError> {
        self.line += 1;
        let end = self.rest.iter().position(|&c| c == b'\n');
        let Some(end) = end else {
            return Err(syntax(
                self.line,
                "a header up to `end_header`",
                self.rest.trim_ascii(),
            ));
        };
        let (line, rest) = (&self.rest[..end], &self.rest[end + 1..]);
        self.rest = rest;
        Ok(line)
    }
}
