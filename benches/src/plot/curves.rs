//! Named curves of one figure over another, both logarithmic: what is no benchmark row.

use super::axis::{LogAxis, count_label, power_label, seconds_label};
use super::figure::Figure;
use super::frame::{Frame, HEIGHT, Legend, Titles};
use super::series::{Series, nth_look};

/// Room for labels such as `500 µs` \[px\].
const LABELS: f64 = 62.0;

/// A curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name in the legend.
    pub label: String,
    /// Points in the order they are joined; those that are not above zero are left out.
    pub points: Vec<(f64, f64)>,
}

/// What the numbers of an axis are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Powers of ten.
    Number,
    /// Counts.
    Count,
    /// Times \[s\].
    Seconds,
}

impl Unit {
    const fn label(self) -> fn(f64) -> String {
        match self {
            Self::Number => power_label,
            Self::Count => count_label,
            Self::Seconds => seconds_label,
        }
    }
}

/// A figure of curves.
#[derive(Clone, Debug)]
pub struct Curves {
    /// Heading.
    pub title: String,
    /// Below the heading.
    pub subtitle: String,
    /// Title and unit of the vertical axis.
    pub vertical: (String, Unit),
    /// Title and unit of the horizontal axis.
    pub horizontal: (String, Unit),
    /// At the foot.
    pub remark: String,
    /// The curves.
    pub curves: Vec<Curve>,
}

impl Curves {
    /// The picture; none if no curve has a point.
    pub(super) fn figure(&self) -> Option<Figure> {
        let drawn = |curve: &Curve| -> Vec<(f64, f64)> {
            let is_drawn =
                |&(x, y): &(f64, f64)| x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite();
            curve.points.iter().copied().filter(is_drawn).collect()
        };
        let curves: Vec<(&str, Vec<(f64, f64)>)> = (self.curves.iter())
            .map(|curve| (curve.label.as_str(), drawn(curve)))
            .filter(|(_, points)| !points.is_empty())
            .collect();
        if curves.is_empty() {
            return None;
        }
        let series: Vec<Series<'_>> = (curves.iter().enumerate())
            .map(|(index, (label, _))| {
                let (color, (marker, hollow)) = nth_look(index);
                Series {
                    label: (*label).to_owned(),
                    color,
                    marker,
                    hollow,
                    rows: Vec::new(),
                }
            })
            .collect();
        let titles = Titles {
            title: self.title.clone(),
            subtitle: self.subtitle.clone(),
            vertical: Some(&self.vertical.0),
            horizontal: &self.horizontal.0,
            remark: self.remark.clone(),
        };
        let legend = Legend::of_lines(&series, &[]);
        let mut frame = Frame::new(&titles, &legend, HEIGHT, LABELS);
        let area = frame.area;
        let all = || curves.iter().flat_map(|(_, points)| points.iter());
        let vertical = LogAxis::decimal(
            all().map(|point| point.1),
            (area.bottom - 8.0, area.top + 8.0),
        );
        let horizontal = LogAxis::decimal(
            all().map(|point| point.0),
            (area.left + 8.0, area.right - 8.0),
        );
        frame.vertical_axis(&vertical, self.vertical.1.label());
        frame.horizontal_axis(&horizontal, self.horizontal.1.label());
        frame.axis_lines();
        let place = |&(x, y): &(f64, f64)| (horizontal.place(x), vertical.place(y));
        for ((_, points), series) in curves.iter().zip(&series) {
            // One by one: joined at a sharp angle, lines end in a spike.
            for ends in points.windows(2) {
                let line = [place(&ends[0]), place(&ends[1])];
                frame.figure.line(&line, series.color, 2.0);
            }
        }
        for ((_, points), series) in curves.iter().zip(&series) {
            for point in points {
                frame
                    .figure
                    .marker(place(point), series.marker, series.color, series.hollow);
            }
        }
        Some(frame.figure)
    }
}
