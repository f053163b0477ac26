//! Entries as tables for people and as files.

use super::entry::{COLUMNS, Entry};
use super::pictures;
use crate::csv;
use crate::results::{self, ResultsError, write_atomically};
use crate::table::Grid;
use crate::table::format::{count, error_figure};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Name of the file that holds every entry.
pub(super) const JSON: &str = "accuracy.json";

const INTRODUCTION: &str = "\
# Errors of forward dynamics over seeds

Made by `vertebra-bench accuracy`; what the cases are, and what to conclude, stands in `docs/accuracy.md`.
Forward error max |qdd - ref| / max |ref| against the reference precision; percentiles are errors that occurred;
refused are problems that the solver answered with an error instead of numbers. dca f64/f32: chunks in f64, joins in f32.
";

/// The entries by method, each with a table.
fn tables(entries: &[Entry]) -> Vec<(String, Grid)> {
    let mut methods: Vec<(&str, &str)> = Vec::new();
    for entry in entries {
        let method = (entry.method.as_str(), entry.precision.as_str());
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    let headings = vec![
        ("case", false),
        ("bodies", true),
        ("seeds", true),
        ("median", true),
        ("p95", true),
        ("p99", true),
        ("max", true),
        ("refused", true),
    ];
    let line = |entry: &Entry| {
        let error = |value: Option<f64>| value.map_or("-".to_owned(), error_figure);
        vec![
            format!("{}, {}", entry.shape, entry.pattern),
            count(entry.bodies as u64),
            entry.seeds.to_string(),
            error(entry.median),
            error(entry.p95),
            error(entry.p99),
            error(entry.max),
            entry.refused.to_string(),
        ]
    };
    let table = |(method, precision): (&str, &str)| {
        let own = |entry: &&Entry| entry.method == method && entry.precision == precision;
        let lines = entries.iter().filter(own).map(line).collect();
        let title = format!("{method} {precision}");
        (title, Grid::new(headings.clone(), lines))
    };
    methods.into_iter().map(table).collect()
}

/// That they are over different numbers of seeds, if they are: percentiles and maxima are then not to be compared.
pub(super) fn seeds(entries: &[Entry]) -> Option<String> {
    let counts: BTreeSet<u32> = entries.iter().map(|entry| entry.seeds).collect();
    if counts.len() < 2 {
        return None;
    }
    let counts: Vec<String> = counts.iter().map(u32::to_string).collect();
    Some(format!(
        "Entries over {} seeds stand side by side, as their column says: compare percentiles and largest errors of equal \
         numbers alone.",
        counts.join(" and ")
    ))
}

/// Where they were measured, if that makes a difference.
fn device(entries: &[Entry]) -> Option<&str> {
    let named = |entry: &&Entry| !entry.device.is_empty();
    entries
        .iter()
        .find(named)
        .map(|entry| entry.device.as_str())
}

/// Prints the tables.
pub(super) fn print(entries: &[Entry]) {
    if let Some(device) = device(entries) {
        println!("on {device}\n");
    }
    for (title, grid) in tables(entries) {
        println!("{title}\n{}\n", grid.terminal());
    }
}

/// Checks that [`write`] could write into the folder, which is made where missing.
///
/// # Errors
/// If it could not.
pub(super) fn check_writable(dir: &Path) -> Result<(), ResultsError> {
    results::check_writable(&dir.join(JSON))
}

/// Writes the entries as JSON, CSV and Markdown; returns the paths.
///
/// # Errors
/// If a file cannot be written.
pub(super) fn write(dir: &Path, entries: &[Entry]) -> Result<Vec<PathBuf>, ResultsError> {
    let json_error = |source| ResultsError::Json {
        path: dir.join(JSON),
        source,
    };
    // An entry a line: what changed shows in a comparison of two versions.
    let lines: Vec<String> = entries
        .iter()
        .map(serde_json::to_string)
        .collect::<Result<_, _>>()
        .map_err(json_error)?;
    let json = format!("[\n{}\n]\n", lines.join(",\n"));
    let csv = csv::lines(&COLUMNS, entries).map_err(json_error)?;
    let pictures = pictures::of(entries);
    let mut markdown = INTRODUCTION.to_owned();
    if let Some(device) = device(entries) {
        markdown.push_str(&format!("\nMeasured on {device}.\n"));
    }
    if let Some(note) = seeds(entries) {
        markdown.push_str(&format!("\n{note}\n"));
    }
    for picture in &pictures {
        let link = format!("\n![{}]({})\n", picture.title(), picture.svg_path());
        markdown.push_str(&link);
    }
    for (title, grid) in tables(entries) {
        markdown.push_str(&format!("\n## {title}\n\n{}", grid.markdown()));
    }
    let files = [
        (JSON, json),
        ("accuracy.csv", csv),
        ("accuracy.md", markdown),
    ];
    let mut written = Vec::new();
    for (name, contents) in files {
        let path = dir.join(name);
        write_atomically(&path, contents.as_bytes())?;
        written.push(path);
    }
    written.extend(results::write_plots(dir, &pictures)?);
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{Solvers, case::Case, entry, parse};
    use crate::interrupt::Interrupt;

    #[test]
    fn entries_come_back_from_their_file() {
        let entries = entry::measure(
            &Solvers::on_cpu(),
            &Case::all()[0],
            5,
            3,
            &Interrupt::default(),
        );
        let entries = entries.unwrap().unwrap();
        let dir = tempfile::tempdir().unwrap();
        let written = write(dir.path(), &entries).unwrap();
        let read = |index: usize| std::fs::read_to_string(&written[index]).unwrap();
        assert_eq!(parse(&read(0)).unwrap(), entries);
        assert_eq!(read(1).lines().count(), 1 + entries.len());
        assert_eq!(read(2).matches("| chain, equal |").count(), entries.len());
    }
}
