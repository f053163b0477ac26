//! What the text formats share: numbers and errors that name the line.

use crate::error::MeshError;

/// The words of a line, separated by ASCII white space.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// The text without the byte order mark that some programs put before it.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// A malformed line.
pub(super) fn syntax(line: usize, expected: &'static str, found: &[u8]) -> MeshError {
    MeshError::Syntax {
        line,
        expected,
        found: shorten(found),
    }
}

/// Three coordinates, each the `f32` nearest to the decimal number.
pub(super) fn coordinates<'a>(
    line: usize,
    mut words: impl Iterator<Item = &'a [u8]>,
) -> Result<[f32; 3], MeshError> {
    let mut coordinates = [0.0; 3];
    for coordinate in &mut coordinates {
        let word = words.next().unwrap_or_default();
        *coordinate = nearest(line, "three decimal numbers", word)?;
    }
    Ok(coordinates)
}

/// A finite number.
pub(super) fn number(line: usize, word: &[u8]) -> Result<f32, MeshError> {
    nearest(line, "a decimal number", word)
}

/// A number, where the line should have what is expected; finite, and rounded to the nearest `f32`.
pub(super) fn nearest(line: usize, expected: &'static str, word: &[u8]) -> Result<f32, MeshError> {
    let value: f32 = parse(word).ok_or_else(|| syntax(line, expected, word))?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(MeshError::NonFiniteCoordinate {
            line,
            found: shorten(word),
        })
    }
}

/// What the word says, if it is UTF-8 and says it.
pub(super) fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// As much of the bytes as an error message should show.
fn shorten(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * LONGEST)]);
    let mut short: String = text
        .chars()
        .take(LONGEST)
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect();
    if short.len() < bytes.len() && text.chars().count() > LONGEST {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_stay_short_and_printable() {
        assert_eq!(shorten(b"a\x07b"), "a\u{fffd}b");
        assert_eq!(shorten(&[b'x'; 1000]).chars().count(), 41);
        assert_eq!(shorten(&[0xff; 3]).chars().count(), 3);
    }
}
