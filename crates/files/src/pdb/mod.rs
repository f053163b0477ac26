//! Proteins from PDB and mmCIF as torsion-angle chains.
//!
//! [`read`], [`parse_pdb`] and [`parse_mmcif`] give a [`Protein`]: bond lengths and angles rigid, the
//! torsion angles phi, psi and chi of every residue as revolute joints, so that q = 0 is the
//! conformation of the file. A chain starts with a free body; bodies follow each other along the
//! backbone, side chains branch off:
//!
//! | body | atoms | turned by |
//! |---|---|---|
//! | `A:7:N` | N of residue 7, where a chain starts | free |
//! | `A:7:CA` | CA and what is fixed to it | phi, about N-CA |
//! | `A:7:C` | the peptide plane: C, O and the next residue's N | psi, about CA-C |
//! | `A:7:CB`, ... | the side chain from CB, CG, ... on | chi1, chi2, ... |
//!
//! The peptide bond does not turn, nor do rings: proline's phi is fixed, and its CA belongs to the plane
//! before. Hydrogens ride with the atom next to them. Masses are those of the elements; atoms whose bonds
//! lie in one line, or that stand alone, resist no turn, and their body is given the inertia of small
//! balls ([`Options::atom_radius`]) and named in [`Protein::thickened`]. Only the first model of a file (of
//! mmCIF: of its first block with atoms), and the first of alternative locations, count; waters, ligands
//! and residues that are not amino acids are listed in [`Protein::left_out`]. There is no gravity. All in
//! SI units.
//!
//! Of PDB the lines of atoms are checked here and parsed by `pdbtbx`; of mmCIF the table of atoms is read
//! here into its structures. What stands beside the atoms has no effect.

mod atom_site;
mod chain;
mod cif;
mod columns;
mod residue;

use crate::{FileError, Problem, read_text};
use core::f64::consts::PI;
use glam::DVec3;
use pdbtbx::{Context, Format, PDB, PDBError, ReadOptions, StrictnessLevel};
use std::io::BufReader;
use std::path::Path;
use vertebra_assembly::{BodyId, Location, Model};

/// Beyond this no coordinate [Angstrom] is meant.
const FARTHEST: f64 = 1e6;

/// How a structure becomes a model.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// Radius of the balls that atoms count as in bodies which would resist no turn otherwise \[m\];
    /// half an Angstrom by default.
    pub atom_radius: f64,
    /// Longest bond between two residues of a chain \[m\]; 2 Angstrom by default. Where the next
    /// residue is farther a chain of its own starts.
    pub longest_bond: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            atom_radius: 0.5e-10,
            longest_bond: 2e-10,
        }
    }
}

/// A protein as a model.
#[derive(Clone, Debug)]
pub struct Protein {
    /// Bodies joined by torsion angles.
    pub model: Model,
    /// The torsion angles, chain by chain along the backbone.
    pub torsions: Vec<Torsion>,
    /// The atoms, and the bodies they are on.
    pub atoms: Vec<Atom>,
    /// Pairs of bodies joined by a bond between two sulphurs, which closes a loop and has no effect.
    pub disulfides: Vec<[BodyId; 2]>,
    /// Bodies whose atoms count as balls.
    pub thickened: Vec<BodyId>,
    /// Residues that are not part of the model, and why.
    pub left_out: Vec<String>,
}

/// A torsion angle.
#[derive(Clone, Debug, PartialEq)]
pub struct Torsion {
    /// The body that it turns.
    pub body: BodyId,
    /// Which one of the residue.
    pub angle: Angle,
    /// Chain and number of the residue, such as `A:7`.
    pub residue: String,
    /// The angle in the file \[rad\]: that of the model is this plus q. None where an atom that it is
    /// measured from is missing.
    pub start: Option<f64>,
}

/// Which torsion angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Angle {
    /// C-N-CA-C, about the bond before CA.
    Phi,
    /// N-CA-C-N, about the bond behind CA.
    Psi,
    /// The side chain's, counted from 1.
    Chi(u8),
}

/// An atom on a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Atom {
    /// Its name, such as `CA`.
    pub name: String,
    /// Chain and number of its residue, such as `A:7`.
    pub residue: String,
    /// Its atomic number.
    pub element: u8,
    /// The body it is on.
    pub body: BodyId,
    /// Where it is in the body's frame \[m\].
    pub position: DVec3,
}

/// Reads a file: mmCIF where its name ends in `.cif` or `.mmcif`, else PDB.
///
/// # Errors
/// [`FileError`], naming the file, the line where it is known, and what is wrong.
pub fn read(path: impl AsRef<Path>, options: &Options) -> Result<Protein, FileError> {
    let path = path.as_ref();
    let is_cif = path
        .extension()
        .is_some_and(|ending| ending == "cif" || ending == "mmcif");
    let text = read_text(path)?;
    let protein = match is_cif {
        true => parse_mmcif(&text, options),
        false => parse_pdb(&text, options),
    };
    protein.map_err(|error| error.in_file(path))
}

/// Reads PDB text.
///
/// # Errors
/// [`FileError`], naming the line where it is known, and what is wrong.
pub fn parse_pdb(text: &str, options: &Options) -> Result<Protein, FileError> {
    parse(text, options, read_pdb)
}

/// Reads mmCIF text.
///
/// # Errors
/// [`FileError`], naming the line where it is known, and what is wrong.
pub fn parse_mmcif(text: &str, options: &Options) -> Result<Protein, FileError> {
    parse(text, options, atom_site::read)
}

fn parse(
    text: &str,
    options: &Options,
    read: impl Fn(&str) -> Result<PDB, FileError>,
) -> Result<Protein, FileError> {
    for (quantity, value) in [
        (
            "the radius [m] of atoms in the options",
            options.atom_radius,
        ),
        ("the longest bond [m] in the options", options.longest_bond),
    ] {
        if !(value.is_finite() && value > 0.0) {
            let problem = Problem::OutOfRange {
                quantity,
                value,
                requirement: "above zero",
            };
            return Err(FileError::on_line(0, "the structure", problem));
        }
    }
    check_characters(text)?;
    let (chains, left_out) = residue::sort(&read(text)?);
    chain::build(&chains, left_out, options)
}

/// The atoms of the first model of PDB text.
fn read_pdb(text: &str) -> Result<PDB, FileError> {
    let text = columns::checked(text)?;
    let read = || {
        ReadOptions::new()
            .set_format(Format::Pdb)
            .set_level(StrictnessLevel::Loose)
            .set_only_first_model(true)
            .set_only_atomic_coords(true)
            .read_raw(BufReader::new(text.as_bytes()))
    };
    // The parser panics where it finds what it does not expect; that is caught where panics unwind.
    let read = std::panic::catch_unwind(read).map_err(|panic| gave_up(panic.as_ref()))?;
    let (structure, _) = read.map_err(|errors| refused(&errors))?;
    Ok(structure)
}

/// Both formats are printable ASCII.
fn check_characters(text: &str) -> Result<(), FileError> {
    for (number, line) in (1..).zip(text.lines()) {
        let is_foreign = |c: &char| !(c.is_ascii_graphic() || matches!(c, ' ' | '\t'));
        if let Some(found) = line.chars().find(is_foreign) {
            let problem = Problem::Syntax {
                expected: "printable ASCII",
                found: format!("the character {found:?}"),
            };
            return Err(FileError::on_line(number, "the structure", problem));
        }
    }
    Ok(())
}

/// What the parser said as it panicked.
fn gave_up(panic: &(dyn core::any::Any + Send)) -> FileError {
    let said = panic.downcast_ref::<String>().map(String::as_str);
    let said = said.or_else(|| panic.downcast_ref::<&str>().copied());
    let problem = Problem::Refused {
        reason: "a record is not what its parser expects; check for empty fields".to_owned(),
        detail: said.unwrap_or("no reason is given").to_owned(),
    };
    FileError::on_line(0, "the structure", problem)
}

/// The first error that made the parser give up.
fn refused(errors: &[PDBError]) -> FileError {
    let fatal = errors
        .iter()
        .find(|error| error.fails(StrictnessLevel::Loose));
    let line = fatal.and_then(|error| line_of(error.context()));
    // The parser says line 0 of what concerns the whole text.
    let line = line.filter(|&line| line > 0);
    let problem = match fatal {
        Some(error) => Problem::Refused {
            reason:
                "cannot be read as PDB; correct it, or let the program that wrote it write it anew"
                    .to_owned(),
            detail: format!(
                "{} ({})",
                error.short_description(),
                error.long_description()
            ),
        },
        None => Problem::Empty("has no atoms; choose a file with coordinates"),
    };
    let location = Location {
        file: None,
        line,
        element: "the structure".to_owned(),
    };
    FileError::new(location, problem)
}

fn line_of(context: &Context) -> Option<u32> {
    let line = match context {
        Context::FullLine { linenumber, .. } | Context::Line { linenumber, .. } => *linenumber,
        Context::Range {
            start_linenumber, ..
        }
        | Context::RangeHighlights {
            start_linenumber, ..
        } => *start_linenumber,
        Context::Multiple { contexts } => {
            return contexts.iter().find_map(|(_, context)| line_of(context));
        }
        _ => return None,
    };
    u32::try_from(line).ok()
}

/// The torsion angle of four points, in (-pi, pi]: zero where the outer ones are on one side.
pub(crate) fn torsion(points: [DVec3; 4]) -> f64 {
    let [a, b, c, d] = points;
    let axis = (c - b).normalize_or(DVec3::Z);
    let before = (b - a).cross(axis);
    let after = axis.cross(d - c);
    let angle = libm::atan2(before.cross(after).dot(axis), before.dot(after));
    if angle <= -PI { PI } else { angle }
}
