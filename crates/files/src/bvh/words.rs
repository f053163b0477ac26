//! Words of a text, with their lines.

use crate::{FileError, Problem};

/// The words of a text one by one; blanks surround braces too.
pub(super) struct Words<'t> {
    words: Box<dyn Iterator<Item = (usize, &'t str)> + 't>,
    next: Option<(usize, &'t str)>,
    /// Line of the word taken last, from 1.
    line: usize,
}

impl<'t> Words<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        let numbered = (1..).zip(text.lines());
        let mut words = Box::new(
            numbered.flat_map(|(line, text)| text.split_whitespace().map(move |word| (line, word))),
        );
        let next = words.next();
        Self {
            words,
            next,
            line: 1,
        }
    }

    /// Line of the next word, or of the last one at the end.
    pub(super) fn line(&self) -> usize {
        self.next.map_or(self.line, |(line, _)| line)
    }

    pub(super) fn peek(&self) -> Option<&'t str> {
        self.next.map(|(_, word)| word)
    }

    pub(super) fn take(&mut self, expected: &'static str) -> Result<&'t str, FileError> {
        let Some((line, word)) = self.next else {
            return Err(self.error("the text", expected));
        };
        self.line = line;
        self.next = self.words.next();
        Ok(word)
    }

    /// Takes one word, whatever its case.
    pub(super) fn expect(
        &mut self,
        element: &str,
        expected: &'static str,
    ) -> Result<(), FileError> {
        match self.peek() {
            Some(word) if word.eq_ignore_ascii_case(expected) => self.take(expected).map(drop),
            _ => Err(self.error(element, expected)),
        }
    }

    pub(super) fn number(&mut self, element: &str) -> Result<f64, FileError> {
        const EXPECTED: &str = "a number";
        match self.peek().and_then(number) {
            Some(number) => self.take(EXPECTED).map(|_| number),
            None => Err(self.error(element, EXPECTED)),
        }
    }

    /// Takes all words on the line of the next one, and gives that line; none at the end.
    pub(super) fn take_line(&mut self, taken: &mut Vec<&'t str>) -> Option<usize> {
        taken.clear();
        let (line, _) = self.next?;
        while let Some((_, word)) = self.next.filter(|&(next, _)| next == line) {
            taken.push(word);
            self.next = self.words.next();
        }
        self.line = line;
        Some(line)
    }

    /// A number of things. What a text states is not believed to fit the memory: nothing is
    /// allocated by it.
    pub(super) fn count(&mut self, element: &str) -> Result<usize, FileError> {
        const EXPECTED: &str = "a count";
        match self.peek().and_then(|word| word.parse().ok()) {
            Some(count) => self.take(EXPECTED).map(|_| count),
            None => Err(self.error(element, EXPECTED)),
        }
    }

    /// What stands next is not what must.
    pub(super) fn error(&self, element: &str, expected: &'static str) -> FileError {
        refused(self.line(), element, expected, self.peek())
    }
}

/// A finite number.
pub(super) fn number(word: &str) -> Option<f64> {
    word.parse().ok().filter(|number: &f64| number.is_finite())
}

/// A word, or the end of the text, is not what must stand on that line.
pub(super) fn refused(
    line: usize,
    element: &str,
    expected: &'static str,
    word: Option<&str>,
) -> FileError {
    let found = match word {
        Some(word) => format!("`{}`", word.chars().take(40).collect::<String>()),
        None => "the end of the text".to_owned(),
    };
    FileError::on_line(line, element, Problem::Syntax { expected, found })
}
