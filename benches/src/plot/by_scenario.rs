//! Time by scenario: for scenarios of one size each, a band a scenario and a line a method.

use super::axis::{LogAxis, seconds_label};
use super::figure::{Align, Figure, GRID, MUTED, Marker, PUBLISHED, fit, text_width};
use super::frame::{ABOVE, BELOW, Frame, LABEL, Legend, SMALL, Titles, devices, times};
use super::series::{Series, series};
use crate::row::Row;
use crate::table::format::count;

/// Height of one method's line \[px\].
const LINE: f64 = 18.0;
/// Space above and below the lines of a scenario \[px\].
const PADDING: f64 = 16.0;
/// Least height of a band, for the name and the size of the scenario \[px\].
const BAND: f64 = 54.0;
/// Least height of all bands, for the legend \[px\].
const BANDS: f64 = 160.0;
/// Widest name of a scenario \[px\].
const NAME: f64 = 260.0;

/// The part of the plot about one scenario.
struct Band<'a> {
    scenario: &'a str,
    name: String,
    size: String,
    lines: Vec<(&'a Series<'a>, &'a Row)>,
}

impl<'a> Band<'a> {
    /// The bands of the scenarios in order of first appearance, their lines in the order of the
    /// legend.
    fn all(rows: &[&'a Row], series: &'a [Series<'a>]) -> Vec<Self> {
        let mut bands: Vec<Self> = Vec::new();
        for row in rows {
            if !bands.iter().any(|band| band.scenario == row.scenario) {
                bands.push(Self {
                    scenario: &row.scenario,
                    name: fit(&row.scenario, LABEL, true, NAME),
                    size: format!("{} {}", count(row.size), row.size_unit),
                    lines: Vec::new(),
                });
            }
        }
        for series in series {
            for row in &series.rows {
                if let Some(band) = bands.iter_mut().find(|band| band.scenario == row.scenario) {
                    band.lines.push((series, row));
                }
            }
        }
        bands
    }

    fn height(&self) -> f64 {
        (2.0 * PADDING + LINE * self.lines.len() as f64).max(BAND)
    }

    fn label_width(&self) -> f64 {
        text_width(&self.name, LABEL, true).max(text_width(&self.size, SMALL, false))
    }
}

/// The plot of rows of several scenarios with the same unit of size, or of one question.
pub(super) fn figure(title: String, rows: &[&Row]) -> Figure {
    let series = series(rows);
    let bands = Band::all(rows, &series);
    let height = ABOVE + bands.iter().map(Band::height).sum::<f64>().max(BANDS) + BELOW;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive length in pixels"
    )]
    let height = height as u32;
    let left = bands.iter().map(Band::label_width).fold(0.0, f64::max);

    let any_published = rows.iter().any(|row| row.reference_time_s.is_some());
    let mut remark =
        "Medians; bars from the first to the third quartile of the samples.".to_owned();
    if any_published {
        remark.push_str(" Grey: published by the source for this problem.");
    }
    let titles = Titles {
        title,
        subtitle: devices(rows),
        vertical: None,
        horizontal: "time of one call",
        remark,
    };
    let published = if any_published {
        vec!["published"]
    } else {
        Vec::new()
    };
    let legend = Legend {
        series: series.iter().collect(),
        published,
        lines: false,
    };
    let mut frame = Frame::new(&titles, &legend, height, left);
    let area = frame.area;
    let axis = LogAxis::decimal(times(rows), (area.left + 12.0, area.right - 12.0));
    frame.horizontal_axis(&axis, seconds_label);

    let mut top = area.top;
    for band in &bands {
        let middle = top + 0.5 * band.height();
        frame.figure.heading(
            (area.left - 12.0, middle - 10.0),
            &band.name,
            LABEL,
            Align::Right,
        );
        frame.figure.text(
            (area.left - 12.0, middle + 10.0),
            &band.size,
            SMALL,
            MUTED,
            Align::Right,
        );
        let first = middle - 0.5 * LINE * (band.lines.len() as f64 - 1.0);
        for (number, (series, row)) in band.lines.iter().enumerate() {
            let y = first + LINE * number as f64;
            let x = axis.place(row.time_median_s);
            let (q1, q3) = row.middle_half_s();
            frame.bar((axis.place(q1), y), (axis.place(q3), y), series.color);
            if let Some(published) = row.reference_time_s {
                let published = axis.place(published);
                frame
                    .figure
                    .dashed(&[(x, y), (published, y)], PUBLISHED, 1.0, (2.0, 4.0));
                frame
                    .figure
                    .marker((published, y), Marker::Circle, PUBLISHED, true);
            }
            frame
                .figure
                .marker((x, y), series.marker, series.color, series.hollow);
        }
        top += band.height();
        frame
            .figure
            .line(&[(area.left, top), (area.right, top)], GRID, 1.0);
    }
    frame.axis_lines();
    frame.figure
}
