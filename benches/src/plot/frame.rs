//! What the plots have in common: titles, axes and grid, and the legend beside the data.

use super::axis::LogAxis;
use super::figure::{
    Align, Color, Figure, GRID, INK, MUTED, Marker, PUBLISHED, Point, Rect, fit, text_width, wrap,
};
use super::series::{Published, Series};
use crate::row::Row;

/// Width of every plot \[px\].
const WIDTH: u32 = 1200;
/// Height of a plot whose contents do not ask for another \[px\].
pub(super) const HEIGHT: f64 = 800.0;
/// Space around everything \[px\].
const MARGIN: f64 = 32.0;
/// Height of the titles above the data \[px\], and what the title of a vertical axis adds to it.
pub(super) const ABOVE: f64 = 98.0;
const VERTICAL_TITLE: f64 = 36.0;
/// Height of the labels and remarks below the data \[px\].
pub(super) const BELOW: f64 = 104.0;
/// Font size of ticks and the legend \[px\].
pub(super) const LABEL: f64 = 15.0;
/// Font size of remarks, and from line to line of them \[px\].
pub(super) const SMALL: f64 = 13.0;
const REMARK_LINE: f64 = 18.0;
/// Widest text in the legend \[px\].
const LEGEND_TEXT: f64 = 250.0;
/// Length of the marks between labelled ticks \[px\].
const MINOR: f64 = 5.0;
/// Dashes and gaps of published curves \[px\].
const DASHES: (f64, f64) = (8.0, 5.0);

/// The texts of a plot.
pub(super) struct Titles<'a> {
    pub(super) title: String,
    pub(super) subtitle: String,
    /// Above the vertical axis; `None` when that has only names.
    pub(super) vertical: Option<&'a str>,
    /// At the foot, in as many lines as it needs.
    pub(super) remark: String,
}

/// The entries of the legend.
pub(super) struct Legend<'a> {
    pub(super) series: Vec<&'a Series<'a>>,
    /// Labels of the published curves.
    pub(super) published: Vec<&'a str>,
    /// Whether the points of a series are joined by a line.
    pub(super) lines: bool,
}

impl<'a> Legend<'a> {
    /// The legend of series and published curves that are drawn as lines.
    pub(super) fn of_lines(series: &'a [Series<'a>], published: &'a [Published]) -> Self {
        Self {
            series: series.iter().collect(),
            published: published.iter().map(|curve| curve.label.as_str()).collect(),
            lines: true,
        }
    }

    /// Draws the entries below each other from `top`, ending at the right margin, within `height`.
    /// Returns where they begin from the left.
    fn draw(&self, figure: &mut Figure, top: f64, height: f64) -> f64 {
        let labels = self
            .series
            .iter()
            .map(|series| series.label.as_str())
            .chain(self.published.iter().copied());
        let labels: Vec<String> = labels
            .map(|label| fit(label, LABEL, false, LEGEND_TEXT))
            .collect();
        let text = labels
            .iter()
            .map(|label| text_width(label, LABEL, false))
            .fold(0.0, f64::max);
        let key = if self.lines { 36.0 } else { 20.0 };
        let left = f64::from(figure.width) - MARGIN - text - key;
        let spacing = (height / labels.len().max(1) as f64).min(26.0);
        for (index, label) in labels.iter().enumerate() {
            let y = top + 8.0 + index as f64 * spacing;
            let line = [(left, y), (left + key - 10.0, y)];
            let middle = (left + 0.5 * (key - 10.0), y);
            if let Some(series) = self.series.get(index) {
                if self.lines {
                    figure.line(&line, series.color, 2.0);
                }
                figure.marker(middle, series.marker, series.color, series.hollow);
            } else {
                if self.lines {
                    figure.dashed(&line, PUBLISHED, 2.0, DASHES);
                }
                figure.marker(middle, Marker::Circle, PUBLISHED, true);
            }
            figure.text((left + key, y), label, LABEL, INK, Align::Left);
        }
        left
    }
}

/// A plot with its texts and legend, and the area left for data.
pub(super) struct Frame {
    pub(super) figure: Figure,
    /// Where data is drawn.
    pub(super) area: Rect,
}

impl Frame {
    /// Draws texts and legend. `height` is that with a remark of one line, `left` the room for the labels
    /// of the vertical axis \[px\].
    pub(super) fn new(titles: &Titles<'_>, legend: &Legend<'_>, height: f64, left: f64) -> Self {
        let across = f64::from(WIDTH) - 2.0 * MARGIN;
        let remark = wrap(&titles.remark, SMALL, across);
        let further_lines = remark.len().saturating_sub(1) as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a positive length in pixels"
        )]
        let mut figure = Figure {
            title: titles.title.clone(),
            width: WIDTH,
            height: (height + REMARK_LINE * further_lines) as u32,
            shapes: Vec::new(),
        };
        figure.heading(
            (MARGIN, 36.0),
            &fit(&titles.title, 22.0, true, across),
            22.0,
            Align::Left,
        );
        figure.text(
            (MARGIN, 66.0),
            &fit(&titles.subtitle, LABEL, false, across),
            LABEL,
            MUTED,
            Align::Left,
        );
        let mut top = ABOVE;
        if let Some(vertical) = titles.vertical {
            figure.text((MARGIN, top + 8.0), vertical, LABEL, INK, Align::Left);
            top += VERTICAL_TITLE;
        }
        let bottom = height - BELOW;
        let legend_left = legend.draw(&mut figure, top, bottom - top);
        let area = Rect {
            left: MARGIN + left + 12.0,
            top,
            right: legend_left - 28.0,
            bottom,
        };
        for (line, y) in remark.iter().zip(0..) {
            let y = height - 20.0 + REMARK_LINE * f64::from(y);
            figure.text((MARGIN, y), line, SMALL, MUTED, Align::Left);
        }
        Self { figure, area }
    }

    /// Draws the title of the horizontal axis below its labels.
    pub(super) fn horizontal_title(&mut self, title: &str) {
        let Rect {
            left,
            right,
            bottom,
            ..
        } = self.area;
        let center = (0.5 * (left + right), bottom + 54.0);
        self.figure.text(center, title, LABEL, INK, Align::Center);
    }

    /// Draws horizontal grid lines at the labelled ticks, the labels beside them, and marks between
    /// them.
    pub(super) fn vertical_axis(&mut self, axis: &LogAxis, label: fn(f64) -> String) {
        let Rect { left, right, .. } = self.area;
        for value in axis.decimal_ticks(10) {
            let y = axis.place(value);
            self.figure.line(&[(left, y), (right, y)], GRID, 1.0);
            self.figure
                .text((left - 12.0, y), &label(value), LABEL, INK, Align::Right);
        }
        for value in axis.minor_ticks() {
            let y = axis.place(value);
            self.figure
                .line(&[(left, y), (left + MINOR, y)], MUTED, 1.0);
        }
    }

    /// Draws vertical grid lines at the labelled ticks, the labels below them, and marks between
    /// them.
    pub(super) fn horizontal_axis(&mut self, axis: &LogAxis, label: fn(f64) -> String) {
        self.horizontal_ticks(&ticks(axis, label));
        let bottom = self.area.bottom;
        for value in axis.minor_ticks() {
            let x = axis.place(value);
            self.figure
                .line(&[(x, bottom - MINOR), (x, bottom)], MUTED, 1.0);
        }
    }

    /// Draws vertical grid lines at the given places and the labels below them.
    pub(super) fn horizontal_ticks(&mut self, ticks: &[(f64, String)]) {
        for (x, _) in ticks {
            self.vertical_line(*x);
        }
        self.labels_below(ticks);
    }

    /// Draws a vertical grid line.
    pub(super) fn vertical_line(&mut self, x: f64) {
        let Rect { top, bottom, .. } = self.area;
        self.figure.line(&[(x, top), (x, bottom)], GRID, 1.0);
    }

    /// Draws labels below the data, centred at the given places.
    pub(super) fn labels_below(&mut self, labels: &[(f64, String)]) {
        self.labels(labels, self.area.bottom + 22.0);
    }

    /// Draws the labels of a horizontal axis above the data too.
    pub(super) fn labels_above(&mut self, axis: &LogAxis, label: fn(f64) -> String) {
        self.labels(&ticks(axis, label), self.area.top - 14.0);
    }

    /// Draws labels side by side; one that would touch the one before is left out.
    fn labels(&mut self, labels: &[(f64, String)], y: f64) {
        let mut free = f64::NEG_INFINITY;
        for (x, label) in labels {
            let half = 0.5 * text_width(label, LABEL, false);
            if x - half >= free {
                self.figure.text((*x, y), label, LABEL, INK, Align::Center);
                free = x + half + 10.0;
            }
        }
    }

    /// Draws the lines of both axes, over the grid.
    pub(super) fn axis_lines(&mut self) {
        let Rect {
            left,
            top,
            right,
            bottom,
        } = self.area;
        self.figure
            .line(&[(left, top), (left, bottom), (right, bottom)], MUTED, 1.5);
    }

    /// Draws a published curve.
    pub(super) fn published(&mut self, points: &[Point]) {
        self.figure.dashed(points, PUBLISHED, 2.0, DASHES);
        for point in points {
            self.figure.marker(*point, Marker::Circle, PUBLISHED, true);
        }
    }

    /// Draws a bar between two points on one upright or level line, with end marks across it: pale,
    /// as it belongs behind the median.
    pub(super) fn bar(&mut self, from: Point, to: Point, color: Color) {
        let color = color.pale();
        self.figure.line(&[from, to], color, 1.0);
        let (dx, dy) = if from.0 == to.0 {
            (3.0, 0.0)
        } else {
            (0.0, 3.0)
        };
        for (x, y) in [from, to] {
            self.figure
                .line(&[(x - dx, y - dy), (x + dx, y + dy)], color, 1.0);
        }
    }
}

/// Where the labelled ticks of an axis lie, and their labels.
fn ticks(axis: &LogAxis, label: fn(f64) -> String) -> Vec<(f64, String)> {
    let values = axis.decimal_ticks(10).into_iter();
    values
        .map(|value| (axis.place(value), label(value)))
        .collect()
}

/// The processors of the rows.
pub(super) fn devices(rows: &[&Row]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.device.as_str()) {
            names.push(&row.device);
        }
    }
    names.join("; ")
}

/// Every time that a plot of the rows shows \[s\].
pub(super) fn times(rows: &[&Row]) -> Vec<f64> {
    let shown = |row: &&Row| {
        let (q1, q3) = row.middle_half_s();
        [Some(q1), Some(q3), row.reference_time_s]
    };
    rows.iter().flat_map(shown).flatten().collect()
}
