//! Words of a CIF text, with their lines.
//!
//! The syntax of CIF 1.1 (Hall, Allen and Brown 1991) as far as data files have it: tags, loops, values
//! bare, in quotes or between semicolons, comments.

use crate::{FileError, Problem};

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `data_` and the name of a block.
    Block,
    /// `loop_`.
    Loop,
    /// `save_` with or without a name, `global_` or `stop_`, which stand in dictionaries only.
    Reserved,
    /// The name of an item, from its underscore on.
    Tag,
    /// A value that is written out.
    Value,
    /// `.` or `?`: none, or not known.
    Nothing,
}

/// A word and where it stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'t> {
    pub(super) kind: Kind,
    /// Its text, without quotes.
    pub(super) text: &'t str,
    /// Its line, from 1.
    pub(super) line: usize,
}

impl Word<'_> {
    /// Something else must stand here.
    pub(super) fn refused(&self, element: impl Into<String>, expected: &'static str) -> FileError {
        let found = match self.text.trim() {
            "" => "nothing".to_owned(),
            text => format!("`{}`", text.chars().take(40).collect::<String>()),
        };
        FileError::on_line(self.line, element, Problem::Syntax { expected, found })
    }
}

/// The words of a text one by one.
pub(super) struct Words<'t> {
    text: &'t str,
    at: usize,
    line: usize,
    next: Option<Word<'t>>,
}

impl<'t> Words<'t> {
    pub(super) fn new(text: &'t str) -> Result<Self, FileError> {
        let mut words = Self {
            text,
            at: 0,
            line: 1,
            next: None,
        };
        words.next = words.read()?;
        Ok(words)
    }

    /// The next word, which stays.
    pub(super) const fn peek(&self) -> Option<Word<'t>> {
        self.next
    }

    /// Takes the next word.
    pub(super) fn take(&mut self) -> Result<Option<Word<'t>>, FileError> {
        let taken = self.next;
        self.next = self.read()?;
        Ok(taken)
    }

    /// Takes the next word if it is of that kind.
    pub(super) fn take_if(
        &mut self,
        wanted: impl Fn(Kind) -> bool,
    ) -> Result<Option<Word<'t>>, FileError> {
        match self.next {
            Some(word) if wanted(word.kind) => self.take(),
            _ => Ok(None),
        }
    }

    /// The text has ended where something must stand.
    pub(super) fn ended(&self, element: impl Into<String>, expected: &'static str) -> FileError {
        let found = "the end of the text".to_owned();
        FileError::on_line(self.line, element, Problem::Syntax { expected, found })
    }

    fn read(&mut self) -> Result<Option<Word<'t>>, FileError> {
        self.skip_blanks();
        let (line, start) = (self.line, self.at);
        let rest = &self.text[start..];
        let Some(first) = rest.chars().next() else {
            return Ok(None);
        };
        let is_at_line_start = start == 0 || self.text[..start].ends_with('\n');
        let (kind, text) = match first {
            ';' if is_at_line_start => (Kind::Value, self.text_field(rest)?),
            '\'' | '"' => (Kind::Value, self.quoted(rest, first)?),
            _ => {
                let length = rest.find(|c: char| c.is_ascii_whitespace());
                let bare = &rest[..length.unwrap_or(rest.len())];
                self.at += bare.len();
                (kind(bare), bare)
            }
        };
        Ok(Some(Word { kind, text, line }))
    }

    /// Blanks, ends of lines, and comments.
    fn skip_blanks(&mut self) {
        let mut in_comment = false;
        for byte in &self.text.as_bytes()[self.at..] {
            match byte {
                b'\n' => (self.line, in_comment) = (self.line + 1, false),
                b'#' => in_comment = true,
                _ if in_comment || byte.is_ascii_whitespace() => {}
                _ => break,
            }
            self.at += 1;
        }
    }

    /// From a semicolon at the start of a line to the next one.
    fn text_field(&mut self, rest: &'t str) -> Result<&'t str, FileError> {
        let Some(length) = rest.find("\n;") else {
            return Err(self.unclosed("a text field that ends with a line `;`"));
        };
        let inside = &rest[1..length];
        self.line += inside.matches('\n').count() + 1;
        self.at += length + 2;
        Ok(inside)
    }

    /// From a quote to the same one before a blank, on the same line: in `'O5''` the first does not end it.
    fn quoted(&mut self, rest: &'t str, quote: char) -> Result<&'t str, FileError> {
        // No farther than the value's end: a line may hold all the values of a file.
        let inside = rest.bytes().enumerate().skip(1);
        let mut inside = inside.take_while(|&(_, byte)| byte != b'\n');
        let end = inside.find(|&(at, byte)| {
            let behind = rest.as_bytes().get(at + 1);
            char::from(byte) == quote && behind.is_none_or(u8::is_ascii_whitespace)
        });
        let Some((end, _)) = end else {
            return Err(self.unclosed("a value whose quotes are closed on the same line"));
        };
        self.at += end + 1;
        Ok(&rest[1..end])
    }

    fn unclosed(&self, expected: &'static str) -> FileError {
        let rest = self.text[self.at..].lines().next().unwrap_or_default();
        let found = format!("`{}`", rest.chars().take(40).collect::<String>());
        let problem = Problem::Syntax { expected, found };
        FileError::on_line(self.line, "the structure", problem)
    }
}

fn kind(bare: &str) -> Kind {
    let starts = |prefix: &str| {
        let start = bare.get(..prefix.len());
        start.is_some_and(|start| start.eq_ignore_ascii_case(prefix))
    };
    let is = |word: &str| bare.eq_ignore_ascii_case(word);
    match bare {
        "." | "?" => Kind::Nothing,
        _ if bare.starts_with('_') => Kind::Tag,
        _ if starts("data_") => Kind::Block,
        _ if is("loop_") => Kind::Loop,
        _ if starts("save_") || is("global_") || is("stop_") => Kind::Reserved,
        _ => Kind::Value,
    }
}
