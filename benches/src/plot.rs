//! Plots of a run, as SVG and PNG: time and error against size, time by scenario, and speed against
//! error.
//!
//! A plot is first laid out as a list of shapes (`figure`), then drawn by plotters to either
//! format, so that both show the same picture and the layout can be tested without looking at
//! pixels. The font is compiled in.

mod against_size;
mod axis;
mod by_scenario;
mod curves;
mod figure;
mod frame;
mod labels;
mod paint;
mod series;
mod speed_error;
mod zero_strip;

use std::collections::BTreeSet;

use thiserror::Error;

use crate::row::Row;
use crate::table::by_scenario as group_by_scenario;
use crate::table::format::count;
pub use curves::{Curve, Curves, Unit};
use figure::Figure;
use speed_error::{Labels, task};

/// Why a plot could not be drawn.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlotError {
    /// The drawing library or the image encoder failed.
    #[error("cannot draw the plot `{title}`: {message}")]
    Draw {
        /// Title of the plot.
        title: String,
        /// What the library said.
        message: String,
    },
}

/// One picture.
#[derive(Debug)]
pub struct Plot {
    /// File name without ending.
    name: String,
    /// The scenario it is about; `None` for a plot across scenarios.
    scenario: Option<String>,
    figure: Figure,
}

impl Plot {
    /// A picture of curves, of which there has to be one; `name` is the files' without ending.
    #[must_use]
    pub fn of_curves(name: &str, curves: &Curves) -> Option<Self> {
        Some(Self {
            name: name.to_owned(),
            scenario: None,
            figure: curves.figure()?,
        })
    }

    /// The heading of the picture.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.figure.title
    }

    /// The scenario it is about; `None` for a plot across scenarios.
    #[must_use]
    pub fn scenario(&self) -> Option<&str> {
        self.scenario.as_deref()
    }

    /// Path of the SVG file, relative to the folder of the run.
    #[must_use]
    pub fn svg_path(&self) -> String {
        format!("plots/{}.svg", self.name)
    }

    /// Path of the PNG file, relative to the folder of the run.
    #[must_use]
    pub fn png_path(&self) -> String {
        format!("plots/{}.png", self.name)
    }

    /// The picture as an SVG document.
    ///
    /// # Errors
    /// When the drawing library fails.
    pub fn svg(&self) -> Result<String, PlotError> {
        paint::svg(&self.figure)
    }

    /// The picture as a PNG file's bytes.
    ///
    /// # Errors
    /// When the drawing library or the encoder fails.
    pub fn png(&self) -> Result<Vec<u8>, PlotError> {
        paint::png(&self.figure)
    }
}

/// The plots that these rows call for.
///
/// A scenario measured at several sizes gets plots of time and of forward error against size, and
/// one of speed against error. The scenarios of one size are put together, those of each unit of size in one plot of
/// time by scenario and one of speed against error.
#[must_use]
pub fn plots(rows: &[Row]) -> Vec<Plot> {
    let mut plots = Vec::new();
    let mut names = BTreeSet::new();
    let mut single: Vec<(&str, Vec<&Row>)> = Vec::new();
    let mut add = |name: String, scenario: Option<&str>, figure: Figure| {
        let mut unique = name.clone();
        let mut number = 2;
        while !names.insert(unique.clone()) {
            unique = format!("{name}-{number}");
            number += 1;
        }
        plots.push(Plot {
            name: unique,
            scenario: scenario.map(str::to_owned),
            figure,
        });
    };
    for (scenario, rows) in group_by_scenario(rows) {
        let unit = rows.first().map_or("", |row| row.size_unit.as_str());
        if rows.iter().any(|row| row.size != rows[0].size) {
            let name = slug(scenario);
            add(
                format!("time-{name}"),
                Some(scenario),
                against_size::time(scenario, &rows),
            );
            add(
                format!("error-{name}"),
                Some(scenario),
                speed_error::figure(
                    format!("{scenario}: speed against error"),
                    Labels::Size,
                    &rows,
                ),
            );
            if let Some(figure) = against_size::forward_error(scenario, &rows) {
                add(format!("error-size-{name}"), Some(scenario), figure);
            }
        } else {
            match single.iter_mut().find(|(other, _)| *other == unit) {
                Some((_, pool)) => pool.extend(rows),
                None => single.push((unit, rows)),
            }
        }
    }
    for (unit, rows) in single {
        let name = slug(unit);
        add(
            format!("time-across-{name}"),
            None,
            by_scenario::figure(format!("Time by scenario: {unit}"), &rows),
        );
        add(
            format!("error-across-{name}"),
            None,
            speed_error::figure(
                format!("Speed against error: {unit}"),
                Labels::Scenario,
                &rows,
            ),
        );
    }
    plots
}

/// Pictures of what was measured on several devices, CPUs and GPUs on one picture: speed against error, for each scenario and
/// question that several of them answer.
///
/// A scenario of several sizes has one picture of all, and one of the methods at each of three sizes that the devices have in
/// common; those of one size are put together, as by [`plots`].
#[must_use]
pub fn plots_together(rows: &[Row]) -> Vec<Plot> {
    let mut plots = Vec::new();
    let mut add = |name: String, scenario: Option<&str>, figure: Figure| {
        plots.push(Plot {
            name,
            scenario: scenario.map(str::to_owned),
            figure,
        });
    };
    let mut single: Vec<(String, Vec<&Row>)> = Vec::new();
    for (scenario, rows) in group_by_scenario(rows) {
        let has_sizes = rows.iter().any(|row| row.size != rows[0].size);
        for (task, rows) in by_task(&rows) {
            let devices = devices(&rows);
            if devices.len() < 2 {
                continue;
            }
            if !has_sizes {
                let title = task.trim_end_matches("-resident");
                match single.iter_mut().find(|(other, _)| other == title) {
                    Some((_, pool)) => pool.extend(rows),
                    None => single.push((title.to_owned(), rows)),
                }
                continue;
            }
            let name = slug(&format!("{scenario} {task}"));
            let title = format!("{scenario}, {task}: speed against error");
            if rows.iter().any(|row| row.size != rows[0].size) {
                add(
                    format!("error-{name}"),
                    Some(scenario),
                    speed_error::figure(title, Labels::Size, &rows),
                );
            }
            for size in few(&common_sizes(&rows, &devices)) {
                let rows: Vec<&Row> = rows
                    .iter()
                    .copied()
                    .filter(|row| row.size == size)
                    .collect();
                let title = format!(
                    "{scenario} of {} {}, {task}: speed against error",
                    count(size),
                    rows[0].size_unit
                );
                add(
                    format!("error-{name}-{size}"),
                    Some(scenario),
                    speed_error::figure(title, Labels::Method, &rows),
                );
            }
        }
    }
    for (task, rows) in single {
        let name = slug(&task);
        let title = format!("{task}: time by scenario");
        add(
            format!("time-{name}"),
            None,
            by_scenario::figure(title, &rows),
        );
        let is_exact = |row: &&Row| row.wrong_pairs() == Some(0);
        if !rows.iter().all(is_exact) {
            let title = format!("{task}: speed against error");
            let figure = speed_error::figure(title, Labels::Scenario, &rows);
            add(format!("error-{name}"), None, figure);
        }
    }
    plots
}

/// The rows of each question, in order of first appearance.
fn by_task<'a>(rows: &[&'a Row]) -> Vec<(&'a str, Vec<&'a Row>)> {
    let mut tasks: Vec<(&str, Vec<&Row>)> = Vec::new();
    for row in rows {
        match tasks.iter_mut().find(|(other, _)| *other == task(row)) {
            Some((_, rows)) => rows.push(row),
            None => tasks.push((task(row), vec![row])),
        }
    }
    tasks
}

fn devices<'a>(rows: &[&'a Row]) -> BTreeSet<&'a str> {
    rows.iter().map(|row| row.device.as_str()).collect()
}

/// The sizes that were measured on every device.
fn common_sizes(rows: &[&Row], all: &BTreeSet<&str>) -> Vec<u64> {
    let sizes: BTreeSet<u64> = rows.iter().map(|row| row.size).collect();
    let is_common = |size: &u64| {
        let rows: Vec<&Row> = rows
            .iter()
            .copied()
            .filter(|row| row.size == *size)
            .collect();
        devices(&rows) == *all
    };
    sizes.into_iter().filter(is_common).collect()
}

/// The first, the one in the middle and the last.
fn few(sizes: &[u64]) -> BTreeSet<u64> {
    let middle = sizes.get(sizes.len() / 2);
    [sizes.first(), middle, sizes.last()]
        .into_iter()
        .flatten()
        .copied()
        .collect()
}

/// A name as part of a file name: lower-case letters and digits, and single hyphens for everything
/// else.
fn slug(name: &str) -> String {
    let lower: String = name
        .chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() {
                c.to_ascii_lowercase()
            } else {
                '-'
            }
        })
        .collect();
    let parts: Vec<&str> = lower.split('-').filter(|part| !part.is_empty()).collect();
    if parts.is_empty() {
        "unnamed".to_owned()
    } else {
        parts.join("-")
    }
}

#[cfg(test)]
mod tests;
