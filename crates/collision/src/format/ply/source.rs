//! Where the numbers of elements come from: lines of text or bytes.

use super::header::{Encoding, Header, Number, Role};
use crate::error::{MeshError, Place};
use crate::format::text::{nearest, parse, syntax, words};

/// The numbers of elements, one after the other.
pub(super) trait Source {
    /// Where the source stands, in lines or bytes.
    fn position(&self) -> usize;

    /// How an error names an element that starts there.
    fn place(&self, role: Role, index: usize, position: usize) -> Place;

    /// Goes to the next element.
    fn start(&mut self, role: Role, index: usize) -> Result<(), MeshError>;

    /// The `f32` nearest to a number, which need not be finite.
    fn coordinate(&mut self, number: Number) -> Result<f32, MeshError>;

    /// An integer.
    fn integer(&mut self, number: Number) -> Result<i64, MeshError>;

    /// Passes over a number.
    fn skip(&mut self, number: Number) -> Result<(), MeshError>;

    /// Ends the element.
    fn end(&mut self) -> Result<(), MeshError>;

    /// Nothing may follow the last element.
    fn finish(&mut self) -> Result<(), MeshError>;
}

/// A line of text for each element.
pub(super) struct Text<'a> {
    lines: std::slice::Split<'a, u8, fn(&u8) -> bool>,
    line: usize,
    rest: &'a [u8],
}

impl<'a> Text<'a> {
    pub(super) fn new(header: &Header<'a>) -> Self {
        let is_end: fn(&u8) -> bool = |c| *c == b'\n';
        Self {
            lines: header.body.trim_ascii_end().split(is_end),
            line: header.lines,
            rest: &[],
        }
    }

    /// The next line that is not blank; none at the end.
    fn next_line(&mut self) -> Option<&'a [u8]> {
        loop {
            self.line += 1;
            let line = self.lines.next()?.trim_ascii();
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    fn word(&mut self) -> &'a [u8] {
        let word = words(self.rest).next().unwrap_or_default();
        self.rest = self.rest[word.len()..].trim_ascii_start();
        word
    }

    fn parsed<T>(
        &mut self,
        expected: &'static str,
        parse: impl Fn(&[u8]) -> Option<T>,
    ) -> Result<T, MeshError> {
        let word = self.word();
        parse(word).ok_or_else(|| syntax(self.line, expected, word))
    }
}

impl Source for Text<'_> {
    fn position(&self) -> usize {
        self.line
    }

    fn place(&self, _role: Role, _index: usize, position: usize) -> Place {
        Place::Line(position)
    }

    fn start(&mut self, role: Role, _index: usize) -> Result<(), MeshError> {
        let expected = match role {
            Role::Vertex => "a vertex",
            Role::Face => "a face",
            Role::Other => "an element",
        };
        let line = self.next_line();
        self.rest = line.ok_or_else(|| syntax(self.line, expected, b"the end of the file"))?;
        Ok(())
    }

    fn coordinate(&mut self, _number: Number) -> Result<f32, MeshError> {
        let line = self.line;
        nearest(line, "a decimal number", self.word())
    }

    fn integer(&mut self, _number: Number) -> Result<i64, MeshError> {
        self.parsed("an integer", parse)
    }

    fn skip(&mut self, _number: Number) -> Result<(), MeshError> {
        self.parsed("a number", parse::<f64>).map(|_| ())
    }

    fn end(&mut self) -> Result<(), MeshError> {
        match self.word() {
            [] => Ok(()),
            extra => Err(syntax(self.line, "the end of the line", extra)),
        }
    }

    fn finish(&mut self) -> Result<(), MeshError> {
        match self.next_line() {
            None => Ok(()),
            Some(extra) => Err(syntax(self.line, "the end of the file", extra)),
        }
    }
}

/// Bytes without gaps.
pub(super) struct Binary<'a> {
    bytes: &'a [u8],
    big_endian: bool,
    /// Bytes before these.
    offset: usize,
    /// How many have been read.
    read: usize,
    element: (Role, usize, usize),
}

impl<'a> Binary<'a> {
    pub(super) fn new(header: &Header<'a>) -> Self {
        Self {
            bytes: header.body,
            big_endian: header.encoding == Encoding::BigEndian,
            offset: header.bytes,
            read: 0,
            element: (Role::Other, 0, header.bytes),
        }
    }

    /// The next bytes, as they are in a little-endian file.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], MeshError> {
        let rest = self.bytes.get(self.read..).unwrap_or_default();
        let Some(&(mut taken)) = rest.first_chunk::<N>() else {
            let (role, index, position) = self.element;
            return Err(MeshError::Truncated {
                place: self.place(role, index, position),
            });
        };
        self.read += N;
        if self.big_endian {
            taken.reverse();
        }
        Ok(taken)
    }
}

impl Source for Binary<'_> {
    fn position(&self) -> usize {
        self.offset + self.read
    }

    fn place(&self, role: Role, index: usize, position: usize) -> Place {
        Place::Element {
            element: role.name(),
            index,
            byte: position as u64,
        }
    }

    fn start(&mut self, role: Role, index: usize) -> Result<(), MeshError> {
        self.element = (role, index, self.position());
        Ok(())
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "rounded to the nearest f32, as documented"
    )]
    fn coordinate(&mut self, number: Number) -> Result<f32, MeshError> {
        match number {
            Number::F32 => self.take().map(f32::from_le_bytes),
            Number::F64 => self.take().map(|bytes| f64::from_le_bytes(bytes) as f32),
            _ => self.integer(number).map(|value| value as f32),
        }
    }

    fn integer(&mut self, number: Number) -> Result<i64, MeshError> {
        match number {
            Number::I8 => self.take().map(|b| i8::from_le_bytes(b).into()),
            Number::U8 => self.take().map(|b| u8::from_le_bytes(b).into()),
            Number::I16 => self.take().map(|b| i16::from_le_bytes(b).into()),
            Number::U16 => self.take().map(|b| u16::from_le_bytes(b).into()),
            Number::I32 => self.take().map(|b| i32::from_le_bytes(b).into()),
            Number::U32 => self.take().map(|b| u32::from_le_bytes(b).into()),
            // Headers do not let other types be integers.
            Number::F32 | Number::F64 => self.skip(number).map(|()| 0),
        }
    }

    fn skip(&mut self, number: Number) -> Result<(), MeshError> {
        match number {
            Number::I8 | Number::U8 => self.take::<1>().map(|_| ()),
            Number::I16 | Number::U16 => self.take::<2>().map(|_| ()),
            Number::I32 | Number::U32 | Number::F32 => self.take::<4>().map(|_| ()),
            Number::F64 => self.take::<8>().map(|_| ()),
        }
    }

    fn end(&mut self) -> Result<(), MeshError> {
        Ok(())
    }

    fn finish(&mut self) -> Result<(), MeshError> {
        let rest = self.bytes.get(self.read..).unwrap_or_default();
        if rest.trim_ascii().is_empty() {
            Ok(())
        } else {
            Err(MeshError::TrailingBytes {
                byte: self.position() as u64,
            })
        }
    }
}
