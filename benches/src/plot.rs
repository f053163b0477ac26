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
pub use curves::{Curve, Curves, Unit};
use figure::Figure;

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
                speed_error::figure(Some(scenario), &rows),
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
            by_scenario::figure(&rows),
        );
        add(
            format!("error-across-{name}"),
            None,
            speed_error::figure(None, &rows),
        );
    }
    plots
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
