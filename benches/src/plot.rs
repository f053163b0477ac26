//! Plots of a run, as SVG and PNG: time and error against size, speed against error, and both by
//! scenario.
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
mod front;
mod labels;
mod measure;
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
use front::task;
use measure::Measure;
use series::series;
use speed_error::Labels;

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

/// Fewest sizes of a method that make a curve.
const CURVE: usize = 3;

/// Most series whose curves of speed against error can be told apart on one picture.
const CROWD: usize = 8;

/// The plots that these rows call for.
///
/// A scenario with methods measured at several sizes gets plots of time and of forward error against size, and of
/// speed against error; one with many ways of doing so gets them for each question. The other scenarios are put together,
/// those of each unit of size and figure of error.
#[must_use]
pub fn plots(rows: &[Row]) -> Vec<Plot> {
    let mut plots = Plots::default();
    for (scenario, rows) in group_by_scenario(rows) {
        if !has_curves(&rows) {
            plots.pool(&rows[0].size_unit, rows);
            continue;
        }
        let questions = if is_crowded(&rows) {
            by_task(&rows)
        } else {
            vec![("", rows)]
        };
        for (task, rows) in questions {
            let name = name(scenario, task);
            let figure = against_size::time(&name, &rows);
            plots.add(&["time", &name], Some(scenario), Some(figure));
            if is_crowded(&rows) {
                plots.at_sizes(scenario, task, &rows, &sizes(&rows));
            } else {
                plots.over_sizes(scenario, task, &rows);
            }
            let figure = against_size::forward_error(&name, &rows);
            plots.add(&["error-size", &name], Some(scenario), figure);
        }
    }
    plots.with_pools(&["across"])
}

/// Pictures of what was measured on several devices, CPUs and GPUs on one picture: speed against error, for each scenario and
/// question that several of them answer.
///
/// A scenario with methods measured at several sizes has one picture of all, unless they are too many to be told apart, and one
/// of the methods at each of three sizes that the devices have in common; the other scenarios are put together, as by [`plots`].
#[must_use]
pub fn plots_together(rows: &[Row]) -> Vec<Plot> {
    let mut plots = Plots::default();
    for (scenario, rows) in group_by_scenario(rows) {
        let has_curves = has_curves(&rows);
        for (task, rows) in by_task(&rows) {
            let devices = devices(&rows);
            if devices.len() < 2 {
                continue;
            }
            if !has_curves {
                let is_step = task.starts_with("step-");
                let title = if is_step { "a whole step" } else { task };
                plots.pool(title.trim_end_matches("-resident"), rows);
                continue;
            }
            if !is_crowded(&rows) {
                plots.over_sizes(scenario, task, &rows);
            }
            plots.at_sizes(scenario, task, &rows, &common_sizes(&rows, &devices));
        }
    }
    plots.with_pools(&[])
}

/// Plots under distinct names, and the rows still to be put together.
#[derive(Default)]
struct Plots<'a> {
    plots: Vec<Plot>,
    names: BTreeSet<String>,
    /// What rows of several scenarios have in common, the name of their figure of error, and the rows.
    pools: Vec<(&'a str, &'static str, Vec<&'a Row>)>,
}

impl<'a> Plots<'a> {
    /// Adds a figure, if there is one, under a name of these parts or as near to it as there is.
    fn add(&mut self, name: &[&str], scenario: Option<&str>, figure: Option<Figure>) {
        let Some(figure) = figure else { return };
        let name = name
            .iter()
            .map(|part| slug(part))
            .collect::<Vec<_>>()
            .join("-");
        let mut unique = name.clone();
        let mut number = 2;
        while !self.names.insert(unique.clone()) {
            unique = format!("{name}-{number}");
            number += 1;
        }
        self.plots.push(Plot {
            name: unique,
            scenario: scenario.map(str::to_owned),
            figure,
        });
    }

    /// Adds speed against error over all sizes.
    fn over_sizes(&mut self, scenario: &str, task: &str, rows: &[&Row]) {
        let name = name(scenario, task);
        let title = format!("{name}: speed against error");
        let figure = speed_error::figure(title, Labels::Size, rows);
        self.add(&["error", &name], Some(scenario), figure);
    }

    /// Adds speed against error at each of a few of the sizes.
    fn at_sizes(&mut self, scenario: &str, task: &str, rows: &[&Row], sizes: &[u64]) {
        for size in few(sizes) {
            let rows: Vec<&Row> = (rows.iter().copied())
                .filter(|row| row.size == size)
                .collect();
            let of_size = format!("{scenario} of {} {}", count(size), rows[0].size_unit);
            let title = format!("{}: speed against error", name(&of_size, task));
            let figure = speed_error::figure(title, Labels::Method, &rows);
            let parts = ["error", &name(scenario, task), &size.to_string()];
            self.add(&parts, Some(scenario), figure);
        }
    }

    /// Puts rows with others that have this in common, and their figure of error.
    fn pool(&mut self, common: &'a str, rows: Vec<&'a Row>) {
        let measure = Measure::of(&rows).name;
        let is_of = |(other, of, _): &&mut (&str, &str, _)| *other == common && *of == measure;
        match self.pools.iter_mut().find(is_of) {
            Some((.., pool)) => pool.extend(rows),
            None => self.pools.push((common, measure, rows)),
        }
    }

    /// All plots, with those of rows put together, whose names begin with `prefix`.
    fn with_pools(mut self, prefix: &[&str]) -> Vec<Plot> {
        for (common, measure, rows) in std::mem::take(&mut self.pools) {
            let figure = by_scenario::figure(common, &rows);
            self.add(&[prefix, &[common, measure]].concat(), None, Some(figure));
        }
        self.plots
    }
}

/// A scenario and what is asked there, empty for all that is.
fn name(scenario: &str, task: &str) -> String {
    if task.is_empty() {
        scenario.to_owned()
    } else {
        format!("{scenario}, {task}")
    }
}

/// Whether some method was measured at sizes enough for a curve.
fn has_curves(rows: &[&Row]) -> bool {
    series(rows)
        .iter()
        .any(|series| sizes(&series.rows).len() >= CURVE)
}

/// Whether curves of speed against error cannot be told apart.
fn is_crowded(rows: &[&Row]) -> bool {
    series(rows).len() > CROWD
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

/// The sizes, from the least.
fn sizes(rows: &[&Row]) -> Vec<u64> {
    let sizes: BTreeSet<u64> = rows.iter().map(|row| row.size).collect();
    sizes.into_iter().collect()
}

/// The sizes that were measured on every device.
fn common_sizes(rows: &[&Row], all: &BTreeSet<&str>) -> Vec<u64> {
    let is_common = |size: &u64| {
        let rows: Vec<&Row> = rows
            .iter()
            .copied()
            .filter(|row| row.size == *size)
            .collect();
        devices(&rows) == *all
    };
    sizes(rows).into_iter().filter(is_common).collect()
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
