//! Time and error by scenario: a band for each scenario and size, in it a line for each method, with its time in
//! one panel and its error in another.

use super::axis::{LogAxis, seconds_label};
use super::figure::{Align, Figure, GRID, MUTED, Marker, PUBLISHED, Rect, fit, text_width};
use super::frame::{ABOVE, BELOW, Frame, LABEL, Legend, SMALL, Titles, devices, times};
use super::front::is_on_front;
use super::measure::Measure;
use super::series::{Series, explained, series};
use crate::row::Row;
use crate::table::format::count;

/// Height of one method's line \[px\].
const LINE: f64 = 18.0;
/// Height of the heading of a band, and space below its lines \[px\].
const HEADING: f64 = 30.0;
const PADDING: f64 = 10.0;
/// Widest name of a scenario or a method \[px\].
const NAME: f64 = 340.0;
/// Room for labels of ticks above the panels \[px\].
const TICKS_ABOVE: f64 = 26.0;
/// Space between the panels, and within them before the first and after the last place \[px\].
const GAP: f64 = 48.0;
const MARGIN: f64 = 16.0;
/// Width of the strip for errors of zero \[px\].
const ZERO: f64 = 40.0;

/// The part of the plot about one scenario and size.
struct Band<'a> {
    scenario: &'a str,
    size: u64,
    unit: &'a str,
    lines: Vec<(&'a Series<'a>, &'a Row)>,
}

impl<'a> Band<'a> {
    /// The bands in order of first appearance, their lines in that of the series.
    fn all(rows: &[&'a Row], series: &'a [Series<'a>]) -> Vec<Self> {
        let mut bands: Vec<Self> = Vec::new();
        for row in rows {
            if !bands.iter().any(|band| band.has(row)) {
                bands.push(Self {
                    scenario: &row.scenario,
                    size: row.size,
                    unit: &row.size_unit,
                    lines: Vec::new(),
                });
            }
        }
        for series in series {
            for row in &series.rows {
                if let Some(band) = bands.iter_mut().find(|band| band.has(row)) {
                    band.lines.push((series, row));
                }
            }
        }
        bands
    }

    fn has(&self, row: &Row) -> bool {
        self.scenario == row.scenario && self.size == row.size
    }

    fn height(&self) -> f64 {
        HEADING + LINE * self.lines.len() as f64 + PADDING
    }

    /// Width of its texts at the left of the panels \[px\].
    fn width(&self) -> f64 {
        let lines = self.lines.iter();
        let labels = lines.map(|(series, _)| text_width(&series.label, SMALL, false));
        labels
            .fold(text_width(self.scenario, LABEL, true), f64::max)
            .min(NAME)
    }
}

/// The panel of errors.
struct Errors {
    measure: &'static Measure,
    area: Rect,
    axis: LogAxis,
    /// Where the strip for errors of zero ends; none if there are no such errors.
    zero_until: Option<f64>,
}

impl Errors {
    /// The panel at the right of `area`.
    fn new(measure: &'static Measure, rows: &[&Row], area: Rect) -> Self {
        let area = Rect {
            left: 0.5 * (area.left + area.right + GAP),
            ..area
        };
        let has_zero = rows.iter().any(|row| (measure.value)(row) == Some(0.0));
        let zero_until = has_zero.then_some(area.left + ZERO);
        let from = zero_until.unwrap_or(area.left) + MARGIN;
        Self {
            measure,
            area,
            axis: measure.axis(rows, (from, area.right - MARGIN)),
            zero_until,
        }
    }

    /// Where the error of a row lies, if it has one \[px\].
    fn place(&self, row: &Row) -> Option<f64> {
        match (self.measure.value)(row)? {
            0.0 => Some(self.area.left + 0.5 * ZERO),
            error => Some(self.axis.place(error)),
        }
    }

    /// Draws the axis and the strip.
    fn draw(&self, frame: &mut Frame) {
        frame.area = self.area;
        frame.horizontal_axis(&self.axis, self.measure.label);
        frame.labels_above(&self.axis, self.measure.label);
        frame.horizontal_title(self.measure.title);
        if let Some(x) = self.zero_until {
            frame.labels_below(&[(x - 0.5 * ZERO, "0".to_owned())]);
            let Rect { top, bottom, .. } = self.area;
            let border = [(x, top), (x, bottom)];
            frame.figure.dashed(&border, MUTED, 1.5, (3.0, 4.0));
        }
    }
}

/// The plot of rows that have this and their figure of error in common; errors that do not tell the rows
/// apart are not shown.
pub(super) fn figure(common: &str, rows: &[&Row]) -> Figure {
    let series = series(rows);
    let bands = Band::all(rows, &series);
    let measure = Measure::of(rows);
    let tells = measure.tells(rows);
    let any_published = rows.iter().any(|row| row.reference_time_s.is_some());
    let titles = Titles {
        title: title(common, rows, tells),
        subtitle: devices(rows),
        vertical: None,
        remark: remark(measure, rows, any_published),
    };
    let bands_height: f64 = bands.iter().map(Band::height).sum();
    let height = ABOVE + TICKS_ABOVE + bands_height + BELOW;
    let left = bands.iter().map(Band::width).fold(0.0, f64::max);
    let no_legend = Legend::of_lines(&[], &[]);
    let mut frame = Frame::new(&titles, &no_legend, height, left);
    frame.area.top += TICKS_ABOVE;
    let area = frame.area;
    let errors = tells.then(|| Errors::new(measure, rows, area));
    if let Some(errors) = &errors {
        frame.area.right = errors.area.left - GAP;
    }
    let panel = frame.area;
    let axis = LogAxis::decimal(times(rows), (panel.left + MARGIN, panel.right - MARGIN));
    frame.horizontal_axis(&axis, seconds_label);
    frame.labels_above(&axis, seconds_label);
    frame.horizontal_title("time of one call");
    if let Some(errors) = &errors {
        errors.draw(&mut frame);
    }

    let mut top = area.top;
    for band in &bands {
        let middle = top + 0.5 * HEADING;
        let end = (area.left - 12.0, middle);
        let name = fit(band.scenario, LABEL, true, NAME);
        frame.figure.heading(end, &name, LABEL, Align::Right);
        let size = format!("{} {}", count(band.size), band.unit);
        let start = (area.left + 12.0, middle);
        frame.figure.text(start, &size, SMALL, MUTED, Align::Left);
        for (number, (series, row)) in band.lines.iter().enumerate() {
            let y = top + HEADING + LINE * (number as f64 + 0.5);
            let end = (area.left - 12.0, y);
            let label = fit(&series.label, SMALL, false, NAME);
            let ink = series.color.for_text();
            frame.figure.text(end, &label, SMALL, ink, Align::Right);
            let on_front = tells && is_on_front(row, rows, measure.value);
            let error = errors.as_ref().and_then(|errors| errors.place(row));
            draw_time(&mut frame, &axis, y, series, row);
            for x in error.into_iter().chain([axis.place(row.time_median_s)]) {
                let figure = &mut frame.figure;
                figure.marker((x, y), series.marker, series.color, series.hollow);
                if on_front {
                    figure.ring((x, y));
                }
            }
        }
        top += band.height();
        let border = [(area.left, top), (area.right, top)];
        frame.figure.line(&border, GRID, 1.0);
    }
    for area in [Some(panel), errors.map(|errors| errors.area)] {
        frame.area = area.unwrap_or(panel);
        frame.axis_lines();
    }
    frame.figure
}

/// Draws what goes with a median at height `y`: the quartiles, and what was published.
fn draw_time(frame: &mut Frame, axis: &LogAxis, y: f64, series: &Series<'_>, row: &Row) {
    let [q1, q3] = <[f64; 2]>::from(row.middle_half_s()).map(|time| (axis.place(time), y));
    frame.bar(q1, q3, series.color);
    if let Some(published) = row.reference_time_s {
        let [from, to] = [row.time_median_s, published].map(|time| (axis.place(time), y));
        let figure = &mut frame.figure;
        figure.dashed(&[from, to], PUBLISHED, 1.0, (2.0, 4.0));
        figure.marker(to, Marker::Circle, PUBLISHED, true);
    }
}

/// The heading.
fn title(common: &str, rows: &[&Row], tells: bool) -> String {
    let shown = if tells { "time and error" } else { "time" };
    let scenario = &rows[0].scenario;
    if rows.iter().all(|row| row.scenario == *scenario) {
        format!("{scenario}: {shown}")
    } else {
        format!("{common}: {shown} by scenario")
    }
}

/// What stands at the foot.
fn remark(measure: &Measure, rows: &[&Row], any_published: bool) -> String {
    let mut remark =
        "Medians; bars from the first to the third quartile of the samples.".to_owned();
    if any_published {
        remark.push_str(" Grey: published by the source for this problem.");
    }
    let errors: Vec<f64> = (rows.iter().filter_map(|row| (measure.value)(row))).collect();
    let is_ringed = |row: &&Row| is_on_front(row, rows, measure.value);
    if measure.tells(rows) && rows.iter().any(is_ringed) {
        remark
            .push_str(" Ringed: of one input and question, nothing is both faster and more exact.");
    }
    if measure.tells(rows) && errors.len() < rows.len() {
        remark.push_str(&format!(" Rows without a point have no {}.", measure.name));
    }
    if errors.len() == rows.len() && errors.iter().all(|error| *error == 0.0) {
        remark.push_str(&format!(
            " Not shown, as all are exactly 0: {}.",
            measure.name
        ));
    }
    remark.push_str(explained(rows));
    remark
}
