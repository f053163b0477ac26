//! The atoms of an mmCIF file: its table `_atom_site`.
//!
//! Read here, since the crate that parses PDB says of mmCIF neither in which line something is wrong nor
//! that a number is too long for it. The first block with atoms is read: what else it and those before
//! hold must be CIF, and is passed over; blocks behind it, such as descriptions of ligands, are not read.

use super::FARTHEST;
use super::cif::{Kind, Word, Words};
use crate::{FileError, Problem};
use pdbtbx::{Atom, Chain, Model, PDB, Residue};
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// The atoms of the first model.
pub(super) fn read(text: &str) -> Result<PDB, FileError> {
    let mut words = Words::new(text)?;
    let (first, start) = (
        words.take()?,
        "`data_` and a name, with which mmCIF starts,",
    );
    match first {
        Some(word) if word.kind == Kind::Block => {}
        Some(word) => return Err(word.refused("the structure", start)),
        None => return Err(words.ended("the structure", start)),
    }
    let mut atoms: Option<Model> = None;
    while let Some(word) = words.take()? {
        match word.kind {
            Kind::Loop => {
                let Some(table) = read_loop(&mut words, word)? else {
                    continue;
                };
                if atoms.replace(table).is_some() {
                    let problem = Problem::Contradiction {
                        first: "this table",
                        second: "the one before",
                    };
                    return Err(FileError::on_line(word.line, "`_atom_site`", problem));
                }
            }
            Kind::Tag if column_name(word.text).is_some() => {
                let table = "`loop_`, since atoms stand in a table,";
                return Err(word.refused("`_atom_site`", table));
            }
            Kind::Tag => {
                if words.take_if(is_value)?.is_none() {
                    let element = format!("`{}`", word.text);
                    return Err(match words.peek() {
                        Some(next) => next.refused(element, "its value"),
                        None => words.ended(element, "its value"),
                    });
                }
            }
            Kind::Block if atoms.is_some() => break,
            Kind::Block => {}
            Kind::Reserved | Kind::Value | Kind::Nothing => {
                return Err(word.refused("the structure", "`loop_` or the name of an item"));
            }
        }
    }
    let Some(atoms) = atoms else {
        let problem = Problem::Empty(
            "has no atoms, which stand in a `loop_` of `_atom_site`; choose a file with coordinates",
        );
        return Err(FileError::on_line(0, "the structure", problem));
    };
    let mut structure = PDB::new();
    structure.add_model(atoms);
    Ok(structure)
}

const fn is_value(kind: Kind) -> bool {
    matches!(kind, Kind::Value | Kind::Nothing)
}

/// What stands behind `_atom_site.`, in any case.
fn column_name(tag: &str) -> Option<&str> {
    const CATEGORY: &str = "_atom_site.";
    let (category, name) = tag.split_at_checked(CATEGORY.len())?;
    category.eq_ignore_ascii_case(CATEGORY).then_some(name)
}

/// Reads a loop behind its `loop_`, and gives its first model if it is that of atoms.
fn read_loop<'t>(words: &mut Words<'t>, start: Word<'t>) -> Result<Option<Model>, FileError> {
    let mut tags: Vec<Word<'t>> = Vec::new();
    while let Some(tag) = words.take_if(|kind| kind == Kind::Tag)? {
        tags.push(tag);
    }
    let Some(&first) = tags.first() else {
        return Err(start.refused("the structure", "`loop_` and the names of its columns"));
    };
    let mut table = match column_name(first.text) {
        Some(_) => Some(Table::new(&tags)?),
        None => None,
    };
    let mut row: Vec<Word<'t>> = Vec::with_capacity(tags.len());
    let mut rows = 0;
    while let Some(value) = words.take_if(is_value)? {
        row.push(value);
        if row.len() == tags.len() {
            rows += 1;
            if let Some(table) = &mut table {
                table.add(&row, rows)?;
            }
            row.clear();
        }
    }
    let element = format!("row {} of the table from `{}` on", rows + 1, first.text);
    if let Some(value) = row.first() {
        let problem = Problem::IncompleteRow {
            columns: tags.len(),
            found: row.len(),
        };
        return Err(FileError::on_line(value.line, element, problem));
    }
    let Some(table) = table else {
        return Ok(None);
    };
    if rows == 0 {
        let problem = Problem::IncompleteRow {
            columns: tags.len(),
            found: 0,
        };
        return Err(FileError::on_line(first.line, element, problem));
    }
    Ok(Some(Model::from_iter(1, table.residues.chains.into_iter())))
}

/// A column, or two that say the same, of which the first that has a value counts.
#[derive(Clone, Copy)]
struct Column {
    /// Its name in messages.
    name: &'static str,
    /// Its places in the table.
    at: [Option<usize>; 2],
}

/// The table of atoms.
struct Table<'t> {
    record: Column,
    position: [Column; 3],
    name: Column,
    element: Column,
    residue: Column,
    chain: Column,
    number: Column,
    alternative: Column,
    insertion: Column,
    model_number: Column,
    residues: Residues<'t>,
    /// What the first row calls its model.
    first: Option<&'t str>,
}

impl<'t> Table<'t> {
    fn new(tags: &[Word<'t>]) -> Result<Self, FileError> {
        let mut columns: HashMap<String, usize> = HashMap::with_capacity(tags.len());
        for (at, tag) in tags.iter().enumerate() {
            let Some(name) = column_name(tag.text) else {
                return Err(tag.refused("`_atom_site`", "another column of the same table"));
            };
            if let Some(before) = columns.insert(name.to_ascii_lowercase(), at) {
                let problem = Problem::DuplicateName {
                    first_line: u32::try_from(tags[before].line).unwrap_or(u32::MAX),
                };
                let element = format!("`{}`", tag.text);
                return Err(FileError::on_line(tag.line, element, problem));
            }
        }
        let place = |name: &str| columns.get(&name.to_ascii_lowercase()).copied();
        let optional = |name: &'static str| Column {
            name,
            at: [place(name), None],
        };
        let needed = |[name, other]: [&'static str; 2]| {
            let at = [place(name), place(other)];
            match at {
                [None, None] => {
                    let problem = Problem::MissingColumn { column: name };
                    let line = tags.first().map_or(0, |tag| tag.line);
                    Err(FileError::on_line(line, "`_atom_site`", problem))
                }
                [None, _] => Ok(Column { name: other, at }),
                _ => Ok(Column { name, at }),
            }
        };
        let alone = |name: &'static str| needed([name, name]);
        Ok(Self {
            record: optional("group_PDB"),
            position: [alone("Cartn_x")?, alone("Cartn_y")?, alone("Cartn_z")?],
            name: needed(["label_atom_id", "auth_atom_id"])?,
            element: alone("type_symbol")?,
            residue: needed(["label_comp_id", "auth_comp_id"])?,
            chain: needed(["auth_asym_id", "label_asym_id"])?,
            number: needed(["auth_seq_id", "label_seq_id"])?,
            alternative: optional("label_alt_id"),
            insertion: optional("pdbx_PDB_ins_code"),
            model_number: optional("pdbx_PDB_model_num"),
            residues: Residues::default(),
            first: None,
        })
    }

    /// Takes up a row, which is counted from 1; those of further models are looked at and left.
    fn add(&mut self, words: &[Word<'t>], count: usize) -> Result<(), FileError> {
        let row = Row { words, count };
        if let Some(record) = row.value(self.record)?
            && !matches!(record.text, "ATOM" | "HETATM")
        {
            let expected = "ATOM or HETATM (or the row before has a value too many or too few)";
            return Err(row.refused(record, self.record, expected));
        }
        let [x, y, z] = self.position.map(|column| row.coordinate(column));
        let (x, y, z) = (x?, y?, z?);
        let (name, element) = (row.needed(self.name)?, row.needed(self.element)?);
        let (residue, chain) = (row.needed(self.residue)?, row.needed(self.chain)?);
        let number = row.needed(self.number)?;
        let Ok(residue_number) = number.text.parse::<isize>() else {
            return Err(row.refused(number, self.number, "a whole number"));
        };
        let text = |column| Ok::<_, FileError>(row.value(column)?.map(|word| word.text));
        let (alternative, insertion) = (text(self.alternative)?, text(self.insertion)?);
        let model = text(self.model_number)?;
        let (occupancy, temperature, charge) = (1.0, 0.0, 0);
        let atom = Atom::new(
            false,
            count,
            name.text,
            x,
            y,
            z,
            occupancy,
            temperature,
            element.text,
            charge,
        );
        let Some(atom) = atom else {
            return Err(row.refused(name, self.name, "the name of an atom"));
        };
        if count == 1 {
            self.first = model;
        }
        if model == self.first {
            let Some(place) = self.residues.of(chain.text, residue_number, insertion) else {
                return Err(row.refused(chain, self.chain, "the name of a chain"));
            };
            // Upper case, as it is kept and compared with.
            let alternative = alternative.map(str::to_ascii_uppercase);
            place.add_atom(atom, (residue.text, alternative.as_deref()));
        }
        Ok(())
    }
}

/// Chains of residues in the order of the table, found without a search through those before.
#[derive(Default)]
struct Residues<'t> {
    chains: Vec<Chain>,
    /// Places of the chains by their names.
    chain_places: HashMap<&'t str, usize>,
    /// Places of residues in their chains, by the chain's place, number, and insertion code in upper case,
    /// as residues keep it.
    places: HashMap<(usize, isize, Option<String>), usize>,
}

impl<'t> Residues<'t> {
    /// The residue of that name, which is there from now on; none if it cannot be called so.
    fn of(
        &mut self,
        chain: &'t str,
        number: isize,
        insertion: Option<&str>,
    ) -> Option<&mut Residue> {
        let chain_place = match self.chain_places.entry(chain.trim()) {
            Entry::Occupied(place) => *place.get(),
            Entry::Vacant(place) => {
                self.chains.push(Chain::new(chain)?);
                *place.insert(self.chains.len() - 1)
            }
        };
        let chain = self.chains.get_mut(chain_place)?;
        let insertion = insertion.map(|code| code.trim().to_ascii_uppercase());
        let place = match self.places.entry((chain_place, number, insertion)) {
            Entry::Occupied(place) => *place.get(),
            Entry::Vacant(place) => {
                let (_, number, insertion) = place.key();
                chain.add_residue(Residue::new(*number, insertion.as_deref(), None)?);
                *place.insert(chain.residue_count() - 1)
            }
        };
        chain.residue_mut(place)
    }
}

/// A row of the table.
struct Row<'r, 't> {
    words: &'r [Word<'t>],
    count: usize,
}

impl<'t> Row<'_, 't> {
    /// What stands in a column: letters and digits, if anything.
    fn value(&self, column: Column) -> Result<Option<Word<'t>>, FileError> {
        let mut words = column.at.into_iter().flatten().map(|at| self.words[at]);
        let Some(word) = words.find(|word| word.kind == Kind::Value) else {
            return Ok(None);
        };
        let is_plain = word.text.chars().all(|c| c == ' ' || c.is_ascii_graphic());
        match is_plain && !word.text.trim().is_empty() {
            true => Ok(Some(word)),
            false => Err(self.refused(word, column, "text in one line")),
        }
    }

    fn needed(&self, column: Column) -> Result<Word<'t>, FileError> {
        match self.value(column)? {
            Some(word) => Ok(word),
            None => {
                let at = column.at.into_iter().flatten().next().unwrap_or_default();
                Err(self.refused(self.words[at], column, "a value"))
            }
        }
    }

    /// A number [Angstrom], with or without its uncertainty in parentheses.
    fn coordinate(&self, column: Column) -> Result<f64, FileError> {
        let word = self.needed(column)?;
        let digits = match word.text.split_once('(') {
            Some((digits, uncertainty)) if uncertainty.ends_with(')') => digits,
            _ => word.text,
        };
        let number = digits.parse::<f64>().ok();
        number
            .filter(|number| number.abs() <= FARTHEST)
            .ok_or_else(|| self.refused(word, column, "a coordinate [Angstrom]"))
    }

    fn refused(&self, word: Word<'_>, column: Column, expected: &'static str) -> FileError {
        let element = format!("`_atom_site.{}` of row {}", column.name, self.count);
        word.refused(element, expected)
    }
}
