//! The files of a run: `results.json`, `results.csv`, `report.md` and `plots/`, each written whole
//! or not at all.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::compare::Key;
use crate::plot::{self, Plot, PlotError};
use crate::row::{Row, RowError};
use crate::{csv, report};

/// Name of the file that [`read_results`] reads.
pub const RESULTS_JSON: &str = "results.json";

/// Why the files of a run could not be written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// No measurement was finished.
    #[error(
        "nothing was measured, so there is nothing to write; name a scenario, or let one measurement finish"
    )]
    NoRows,
    /// Several runs have nothing in common.
    #[error(
        "no scenario was measured on several devices, so that there is nothing to put together; name the runs of a CPU and of a GPU"
    )]
    NothingShared,
    /// A row would mislead.
    #[error(transparent)]
    Row(#[from] RowError),
    /// A row read from a file would mislead.
    #[error("{}: row {number}: {source}", path.display())]
    RowInFile {
        /// The file.
        path: PathBuf,
        /// Number of the row, from 1.
        number: usize,
        /// What is wrong with it.
        source: RowError,
    },
    /// A file cannot be written.
    #[error("{}: {source}; see that the folder exists, can be written, and has space", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file cannot be read.
    #[error("{}: {source}; see that the path is right and the file may be read", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file does not hold rows.
    #[error("{}: {source}; expected an array of rows, as `bench` writes it", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: serde_json::Error,
    },
    /// A plot could not be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
}

/// Writes the rows into `dir`, which is created where missing, and returns the paths of the files.
///
/// Every file replaces its predecessor in one step, so that an interruption leaves either the old
/// or the new one.
///
/// # Errors
/// When there are no rows, a row is not valid, or a file cannot be made; rows are checked before
/// anything is written.
pub fn write_results(dir: &Path, rows: &[Row]) -> Result<Vec<PathBuf>, ResultsError> {
    if rows.is_empty() {
        return Err(ResultsError::NoRows);
    }
    for row in rows {
        row.validate()?;
    }
    let mut written = Vec::new();
    let mut write = |name: &str, contents: &[u8]| -> Result<(), ResultsError> {
        let path = dir.join(name);
        write_atomically(&path, contents)?;
        written.push(path);
        Ok(())
    };

    let json_error = |source| ResultsError::Json {
        path: dir.join(RESULTS_JSON),
        source,
    };
    let mut json = serde_json::to_string_pretty(rows).map_err(json_error)?;
    json.push('\n');
    write(RESULTS_JSON, json.as_bytes())?;
    write(
        "results.csv",
        csv::to_csv(rows).map_err(json_error)?.as_bytes(),
    )?;
    let plots = plot::plots(rows);
    write("report.md", report::to_markdown(rows, &plots).as_bytes())?;
    written.extend(write_plots(dir, &plots)?);
    Ok(written)
}

/// Writes what several runs say together: tables and pictures of the scenarios that more than one device has rows of, and
/// no data, which the runs' own files have. A row measured again counts instead of the earlier one.
///
/// # Errors
/// When no scenario has rows of several devices, or a file cannot be made.
pub fn write_together(dir: &Path, runs: &[Vec<Row>]) -> Result<Vec<PathBuf>, ResultsError> {
    let mut rows: Vec<Row> = Vec::new();
    for row in runs.iter().flatten() {
        match rows.iter_mut().find(|other| Key::of(other) == Key::of(row)) {
            Some(other) => other.clone_from(row),
            None => rows.push(row.clone()),
        }
    }
    let devices = |scenario: &str| -> BTreeSet<&str> {
        let rows = rows.iter().filter(|row| row.scenario == scenario);
        rows.map(|row| row.device.as_str()).collect()
    };
    let is_shared = |row: &&Row| devices(&row.scenario).len() > 1;
    let shared: Vec<Row> = rows.iter().filter(is_shared).cloned().collect();
    if shared.is_empty() {
        return Err(ResultsError::NothingShared);
    }
    let plots = plot::plots_together(&shared);
    let path = dir.join("report.md");
    write_atomically(&path, report::to_markdown(&shared, &plots).as_bytes())?;
    let mut written = vec![path];
    written.extend(write_plots(dir, &plots)?);
    Ok(written)
}

/// Writes pictures below `dir`, as SVG and as PNG; gives their paths.
///
/// # Errors
/// When one cannot be drawn or written.
pub fn write_plots(dir: &Path, plots: &[Plot]) -> Result<Vec<PathBuf>, ResultsError> {
    let mut written = Vec::new();
    for plot in plots {
        let files = [
            (plot.svg_path(), plot.svg()?.into_bytes()),
            (plot.png_path(), plot.png()?),
        ];
        for (name, contents) in files {
            let path = dir.join(name);
            write_atomically(&path, &contents)?;
            written.push(path);
        }
    }
    Ok(written)
}

/// Reads the rows of a run from its `results.json`, or from the folder that holds it.
///
/// # Errors
/// When the file cannot be read, is not an array of rows, or holds a row that is not valid.
pub fn read_results(path: &Path) -> Result<Vec<Row>, ResultsError> {
    let path = if path.is_dir() {
        path.join(RESULTS_JSON)
    } else {
        path.to_owned()
    };
    let text = fs::read_to_string(&path).map_err(|source| ResultsError::Unreadable {
        path: path.clone(),
        source,
    })?;
    let rows: Vec<Row> = serde_json::from_str(&text).map_err(|source| ResultsError::Json {
        path: path.clone(),
        source,
    })?;
    for (index, row) in rows.iter().enumerate() {
        row.validate().map_err(|source| ResultsError::RowInFile {
            path: path.clone(),
            number: index + 1,
            source,
        })?;
    }
    Ok(rows)
}

/// Writes a file under another name in its folder and renames it, which replaces a file in one
/// step.
///
/// # Errors
/// When the folder cannot be made or the file not written; no part of it is left then.
pub fn write_atomically(path: &Path, contents: &[u8]) -> Result<(), ResultsError> {
    let io_error = |source| ResultsError::Io {
        path: path.to_owned(),
        source,
    };
    if let Some(folder) = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        fs::create_dir_all(folder).map_err(|source| ResultsError::Io {
            path: folder.to_owned(),
            source,
        })?;
    }
    let part = part_of(path);
    let written = File::create(&part).and_then(|mut file| {
        file.write_all(contents)?;
        file.sync_all()?;
        fs::rename(&part, path)
    });
    written.map_err(|source| {
        // The first error is the one to report; a part that cannot even be removed was likely never
        // made.
        drop(fs::remove_file(&part));
        io_error(source)
    })
}

/// The name under which a file is written before it is whole.
fn part_of(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

/// Checks that [`write_atomically`] could write this file, by making and removing an empty part of
/// it; a file there stays as it is.
///
/// # Errors
/// When the folder cannot be made or nothing can be written in it, or the path is a folder.
pub fn check_writable(path: &Path) -> Result<(), ResultsError> {
    if path.is_dir() {
        return Err(ResultsError::Io {
            path: path.to_owned(),
            source: io::ErrorKind::IsADirectory.into(),
        });
    }
    let part = part_of(path);
    write_atomically(&part, &[])?;
    fs::remove_file(&part).map_err(|source| ResultsError::Io { path: part, source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    fn rows() -> Vec<Row> {
        let mut rows: Vec<Row> = [128, 256, 512]
            .into_iter()
            .map(|size| Row {
                note: "a|b, \"c\"".to_owned(),
                ..row("chain", "aba", "f64", size, 1e-7 * size as f64)
            })
            .collect();
        rows[1].error_residual = Some(0.1 + 0.2);
        rows[1].hits = Some(u64::MAX);
        rows
    }

    #[test]
    fn every_file_is_written_and_the_rows_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("new/folder");
        let written = write_results(&out, &rows()).unwrap();
        assert_eq!(read_results(&out).unwrap(), rows());
        assert_eq!(read_results(&out.join(RESULTS_JSON)).unwrap(), rows());
        for path in &written {
            assert!(
                fs::metadata(path).unwrap().len() > 100,
                "{}",
                path.display()
            );
        }
        for ending in ["results.json", "results.csv", "report.md", ".svg", ".png"] {
            assert!(
                written
                    .iter()
                    .any(|path| path.to_string_lossy().ends_with(ending)),
                "{ending}: {written:?}"
            );
        }
        let report = fs::read_to_string(out.join("report.md")).unwrap();
        for path in written
            .iter()
            .filter(|path| path.extension().is_some_and(|ending| ending == "svg"))
        {
            let linked = format!("](plots/{})", path.file_name().unwrap().to_str().unwrap());
            assert!(report.contains(&linked), "{linked} is not in the report");
        }
    }

    #[test]
    fn runs_of_several_devices_come_together_in_one_picture() {
        let dir = tempfile::tempdir().unwrap();
        let on_gpu = |row: &Row| Row {
            backend: "gpu".to_owned(),
            device: "a GPU".to_owned(),
            method: "dca".to_owned(),
            ..row.clone()
        };
        let again = Row {
            time_median_s: 2.5e-5,
            ..rows()[0].clone()
        };
        let runs = [rows(), rows().iter().map(on_gpu).collect(), vec![again]];
        let written = write_together(dir.path(), &runs).unwrap();
        let report = fs::read_to_string(&written[0]).unwrap();
        assert!(
            report.contains("a GPU") && report.contains("25.0 µs"),
            "{report}"
        );
        let svg = fs::read_to_string(&written[1]).unwrap();
        assert!(svg.contains("dca f64, GPU") && svg.contains("aba f64, 1 thread"));
        assert!(!dir.path().join(RESULTS_JSON).exists());
        let alone = write_together(dir.path(), &[rows()]);
        assert!(matches!(alone, Err(ResultsError::NothingShared)));
    }

    #[test]
    fn rows_are_flat_objects_with_null_for_what_is_absent() {
        let dir = tempfile::tempdir().unwrap();
        write_results(dir.path(), &rows()).unwrap();
        let text = fs::read_to_string(dir.path().join(RESULTS_JSON)).unwrap();
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        let first = value[0].as_object().unwrap();
        assert!(first["false_pairs"].is_null());
        assert!(
            first
                .values()
                .all(|field| !field.is_object() && !field.is_array())
        );
    }

    #[test]
    fn a_row_without_error_figure_leaves_the_old_files_alone() {
        let dir = tempfile::tempdir().unwrap();
        write_results(dir.path(), &rows()).unwrap();
        let mut bad = rows();
        bad[2].error_forward = None;
        assert!(matches!(
            write_results(dir.path(), &bad),
            Err(ResultsError::Row(RowError::NoErrorFigure { .. }))
        ));
        assert!(matches!(
            write_results(dir.path(), &[]),
            Err(ResultsError::NoRows)
        ));
        assert_eq!(read_results(dir.path()).unwrap(), rows());
    }

    #[test]
    fn a_bad_file_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("old.json");
        fs::write(&path, "[{\"scenario\": 3}]").unwrap();
        let error = read_results(&path).unwrap_err();
        assert!(error.to_string().contains("old.json"), "{error}");
        let mut bad = rows();
        bad[1].error_forward = None;
        bad[1].error_residual = None;
        fs::write(&path, serde_json::to_string(&bad).unwrap()).unwrap();
        assert!(matches!(
            read_results(&path),
            Err(ResultsError::RowInFile { number: 2, .. })
        ));
        assert!(matches!(
            read_results(&dir.path().join("none")),
            Err(ResultsError::Unreadable { .. })
        ));
    }

    #[test]
    fn a_failed_write_leaves_no_part_behind() {
        let dir = tempfile::tempdir().unwrap();
        let taken = dir.path().join("taken");
        fs::create_dir_all(taken.join("inside")).unwrap();
        assert!(matches!(
            write_atomically(&taken, b"text"),
            Err(ResultsError::Io { .. })
        ));
        assert!(check_writable(&taken).is_err());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn the_check_makes_the_folder_and_leaves_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("new/file.ply");
        check_writable(&path).unwrap();
        assert_eq!(fs::read_dir(dir.path().join("new")).unwrap().count(), 0);
        fs::write(&path, "old").unwrap();
        check_writable(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert!(check_writable(&path.join("below a file")).is_err());
    }

    #[test]
    fn the_published_results_can_be_read() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/results");
        assert!(!read_results(&folder).unwrap().is_empty());
    }
}
