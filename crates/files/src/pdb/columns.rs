//! The columns of PDB's lines of atoms.
//!
//! They are looked at before the parser sees them, which panics on some that are blank, and says of
//! others neither the column nor the atom. What a model does not need, such as occupancies, is blanked out.

use super::FARTHEST;
use super::residue::is_amino_acid;
use crate::{FileError, Problem};
use core::fmt::Write as _;
use core::ops::Range;

/// What a model needs of an atom, by the columns in which it stands, from 0.
const NAME: (&str, Range<usize>) = ("name", 12..16);
const RESIDUE: (&str, Range<usize>) = ("residue", 17..20);
const NUMBER: (&str, Range<usize>) = ("number of the residue", 22..26);
const POSITION: [(&str, Range<usize>); 3] = [("x", 30..38), ("y", 38..46), ("z", 46..54)];
const ELEMENT: Range<usize> = 76..78;
/// The atom's serial number, which a model does not need: beyond 99 999 writers put letters or stars there.
const SERIAL: Range<usize> = 6..11;
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
            // Files from before 1996 have their name and the number of the line in columns 73 to 80.
            let stated = line.get(ELEMENT).map(str::trim).filter(|element| {
                !element.is_empty() && element.bytes().all(|byte| byte.is_ascii_alphabetic())
            });
            let element = match stated {
                Some(element) => element,
                None => element_of(&line[NAME.1], line[RESIDUE.1].trim()),
            };
            // Any serial number, an occupancy and a temperature, and no segment and charge.
            checked += &line[..SERIAL.start];
            checked += "    1";
            checked += &line[SERIAL.end..POSITION[2].1.end];
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

/// The element of an atom that states none. In amino acids it is the first letter of the name, wherever
/// writers put it, but for selenium. Elsewhere it ends in the second column of the name, before which there
/// may be a digit; only names of hydrogens fill all four columns.
fn element_of<'t>(name: &'t str, residue: &str) -> &'t str {
    if is_amino_acid(residue) {
        let name = name.trim_matches(|c: char| c == ' ' || c.is_ascii_digit());
        if residue.eq_ignore_ascii_case("MSE") && name.eq_ignore_ascii_case("SE") {
            return name;
        }
        if name.starts_with(|first: char| "CHNOS".contains(first.to_ascii_uppercase())) {
            return &name[..1];
        }
    }
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
