//! The columns of PDB's lines of atoms.
//!
//! They are looked at before the parser sees them, which panics on some that are blank, and says of
//! others neither the column nor the atom. What a model does not need, such as occupancies, is blanked out.

use super::FARTHEST;
use crate::{FileError, Problem};
use core::fmt::Write as _;
use core::ops::Range;

/// What a model needs of an atom, by the columns in which it stands, from 0.
const SERIAL: (&str, Range<usize>) = ("serial number", 6..11);
const NAME: (&str, Range<usize>) = ("name", 12..16);
const RESIDUE: (&str, Range<usize>) = ("residue", 17..20);
const NUMBER: (&str, Range<usize>) = ("number of the residue", 22..26);
const POSITION: [(&str, Range<usize>); 3] = [("x", 30..38), ("y", 38..46), ("z", 46..54)];
const ELEMENT: Range<usize> = 76..78;
/// Records beside the atoms that the parser is to see: what ends chains and models.
const STRUCTURE: [&str; 4] = ["MODEL ", "ENDMDL", "TER", "END"];

/// The text with its lines of atoms checked, and as long as the parser wants them.
pub(super) fn checked(text: &str) -> Result<String, FileError> {
    if text.starts_with("data_") {
        let problem = Problem::Syntax {
            expected: "PDB (this is mmCIF: name the file .cif, or use `parse_mmcif`)",
            found: "`data_`".to_owned(),
        };
        return Err(FileError::on_line(1, "the structure", problem));
    }
    let mut checked = String::with_capacity(text.len() + text.len() / 8);
    let mut has_atoms = false;
    for (number, line) in (1..).zip(text.lines()) {
        if line.starts_with("ATOM  ") || line.starts_with("HETATM") {
            has_atoms = true;
            check(line, number)?;
            let kept = &line[..POSITION[2].1.end];
            let element = match line.get(ELEMENT).map(str::trim) {
                Some(element) if !element.is_empty() => element,
                _ => element_of(&line[NAME.1]),
            };
            // An occupancy and a temperature, and no segment and charge.
            checked += kept;
            checked += "  1.00  0.00          ";
            // Writing to a string cannot fail.
            let _ = write!(checked, "{element:>2}  ");
        } else if STRUCTURE.iter().any(|record| line.starts_with(record)) {
            checked += line;
        }
        checked.push('\n');
    }
    if has_atoms {
        return Ok(checked);
    }
    let problem = Problem::Empty(
        "has no atoms: no line starts with ATOM or HETATM; choose a file with coordinates",
    );
    Err(FileError::on_line(0, "the structure", problem))
}

/// The element of an atom that states none: it ends in the second column of the name, before which there
/// may be a digit; only names of hydrogens fill all four columns.
fn element_of(name: &str) -> &str {
    match name.as_bytes() {
        [b' ' | b'0'..=b'9', ..] => &name[1..2],
        [b'H', .., last] if *last != b' ' => "H",
        _ => &name[..2],
    }
}

fn check(line: &str, number: usize) -> Result<(), FileError> {
    let refused = |(what, columns): (&str, Range<usize>), expected: &'static str| {
        let (from, to) = (columns.start + 1, columns.end);
        let found = match line.get(columns).map(str::trim) {
            None => "the end of the line".to_owned(),
            Some("") => "nothing".to_owned(),
            Some(text) => format!("`{text}`"),
        };
        let element = format!("{what} of an atom, columns {from} to {to}");
        FileError::on_line(number, element, Problem::Syntax { expected, found })
    };
    let field = |field: &(&str, Range<usize>)| line.get(field.1.clone()).unwrap_or("").trim();
    if field(&SERIAL).parse::<usize>().is_err() {
        return Err(refused(SERIAL, "a whole number"));
    }
    for text in [NAME, RESIDUE] {
        if field(&text).is_empty() {
            return Err(refused(text, "a name"));
        }
    }
    if field(&NUMBER).parse::<isize>().is_err() {
        return Err(refused(NUMBER, "a whole number"));
    }
    for coordinate in POSITION {
        let value = field(&coordinate).parse::<f64>();
        if !value.is_ok_and(|value| value.abs() <= FARTHEST) {
            return Err(refused(coordinate, "a coordinate [Angstrom]"));
        }
    }
    Ok(())
}
