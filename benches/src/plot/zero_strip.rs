//! Errors of zero, which no logarithm has a place for: a strip at the left of the plot with a column
//! for each label, and in it a lane for each series, so that equal points lie side by side.

use super::figure::{Rect, text_width};
use super::frame::LABEL;
use super::speed_error::DataPoint;

/// Space between the labels of columns \[px\].
const GAP: f64 = 20.0;
/// Distance of lanes where the columns are wide enough \[px\].
const LANE: f64 = 11.0;
/// Largest part of the plot that the strip takes \[1\].
const SHARE: f64 = 0.72;

/// The strip.
pub(super) struct ZeroStrip<'a> {
    /// Labels of the columns.
    columns: Vec<&'a str>,
    /// Labels of the series that have a lane.
    lanes: Vec<&'a str>,
    /// Where the columns begin \[px\].
    left: f64,
    /// Width of a column \[px\].
    width: f64,
}

impl<'a> ZeroStrip<'a> {
    /// The strip of these points at the left of `area`.
    pub(super) fn new(points: &'a [DataPoint<'a>], area: &Rect) -> Self {
        let (mut columns, mut lanes) = (Vec::new(), Vec::new());
        for point in points {
            if !columns.contains(&point.label.as_str()) {
                columns.push(&point.label);
            }
            if !lanes.contains(&point.series.label.as_str()) {
                lanes.push(&point.series.label);
            }
        }
        let labels = columns.iter().map(|label| text_width(label, LABEL, false));
        let wanted = labels.fold(LANE * lanes.len() as f64, f64::max) + GAP;
        let available = (area.right - area.left) / columns.len().max(1) as f64;
        let width = wanted.min(SHARE * available);
        Self {
            columns,
            lanes,
            left: area.left,
            width,
        }
    }

    /// Where the strip ends \[px\].
    pub(super) fn right(&self) -> f64 {
        self.left + self.width * self.columns.len() as f64
    }

    /// Where a column ends and the next begins \[px\].
    pub(super) fn separators(&self) -> impl Iterator<Item = f64> {
        (1..self.columns.len()).map(|index| self.left + self.width * index as f64)
    }

    /// The middle of each column \[px\] and its label.
    pub(super) fn columns(&self) -> impl Iterator<Item = (f64, &'a str)> {
        let middle = |index: usize| self.left + self.width * (index as f64 + 0.5);
        (0..self.columns.len()).map(move |index| (middle(index), self.columns[index]))
    }

    /// Width of a label that stays within its column \[px\].
    pub(super) fn label_width(&self) -> f64 {
        self.width - 0.5 * GAP
    }

    /// Where a point lies \[px\].
    pub(super) fn place(&self, point: &DataPoint<'_>) -> f64 {
        let column = self.columns().find(|(_, label)| *label == point.label);
        let middle = column.map_or(self.left, |(middle, _)| middle);
        let lane = self
            .lanes
            .iter()
            .position(|label| *label == point.series.label);
        let lanes = self.lanes.len() as f64;
        let distance = LANE.min((self.width - GAP) / lanes);
        middle + distance * (lane.unwrap_or(0) as f64 - 0.5 * (lanes - 1.0))
    }
}
