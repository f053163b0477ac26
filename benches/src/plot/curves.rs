//! Named curves of one figure over another, both logarithmic: what is no benchmark row.

use super::axis::{LogAxis, count_label, power_label, seconds_label};
use super::figure::Figure;
use super::frame::{Frame, HEIGHT, Legend, Titles};
use super::series::{Series, nth_look};

/// Room for labels such as `500 µs` \[px\].
const LABELS: f64 = 62.0;
/// Distance at which curves with bars lie side by side, so that none hides another \[px\].
const ASIDE: f64 = 6.0;

/// A curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name in the legend.
    pub label: String,
    /// Its turn among all curves of its kind, which has a look of its own on every picture.
    pub turn: usize,
    /// Points in the order they are joined; those that are not above zero are left out.
    pub points: Vec<(f64, f64)>,
    /// Bars from points upwards, by where they end; none of a curve of single values.
    pub bars: Vec<(f64, f64)>,
}

impl Curve {
    /// The points, or the ends of bars, that a logarithmic axis has a place for.
    fn drawn(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let is_drawn = |&(x, y): &(f64, f64)| x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite();
        points.iter().copied().filter(is_drawn).collect()
    }
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
        let curves: Vec<Curve> = (self.curves.iter())
            .map(|curve| Curve {
                points: Curve::drawn(&curve.points),
                bars: Curve::drawn(&curve.bars),
                ..curve.clone()
            })
            .filter(|curve| !curve.points.is_empty())
            .collect();
        if curves.is_empty() {
            return None;
        }
        let series: Vec<Series<'_>> = (curves.iter())
            .map(|curve| {
                let (color, (marker, hollow)) = nth_look(curve.turn);
                Series {
                    label: curve.label.clone(),
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
            remark: self.remark.clone(),
        };
        let legend = Legend::of_lines(&series, &[]);
        let mut frame = Frame::new(&titles, &legend, HEIGHT, LABELS);
        frame.horizontal_title(&self.horizontal.0);
        let area = frame.area;
        let all = || (curves.iter()).flat_map(|curve| curve.points.iter().chain(&curve.bars));
        let has_bars = curves.iter().any(|curve| !curve.bars.is_empty());
        let aside = |index: usize| {
            let from_middle = index as f64 - 0.5 * (curves.len() as f64 - 1.0);
            if has_bars { ASIDE * from_middle } else { 0.0 }
        };
        let margin = 8.0 + aside(curves.len() - 1);
        let vertical = LogAxis::decimal(
            all().map(|point| point.1),
            (area.bottom - 8.0, area.top + 8.0),
        );
        let horizontal = LogAxis::decimal(
            all().map(|point| point.0),
            (area.left + margin, area.right - margin),
        );
        frame.vertical_axis(&vertical, self.vertical.1.label());
        frame.horizontal_axis(&horizontal, self.horizontal.1.label());
        frame.axis_lines();
        let place = |index: usize, &(x, y): &(f64, f64)| {
            (horizontal.place(x) + aside(index), vertical.place(y))
        };
        for (index, (curve, series)) in curves.iter().zip(&series).enumerate() {
            for end in &curve.bars {
                if let Some(point) = curve.points.iter().find(|point| point.0 == end.0) {
                    frame.bar(place(index, point), place(index, end), series.color);
                }
            }
        }
        for (index, (curve, series)) in curves.iter().zip(&series).enumerate() {
            // One by one: joined at a sharp angle, lines end in a spike.
            for ends in curve.points.windows(2) {
                let line = [place(index, &ends[0]), place(index, &ends[1])];
                frame.figure.line(&line, series.color, 2.0);
            }
        }
        for (index, (curve, series)) in curves.iter().zip(&series).enumerate() {
            for point in &curve.points {
                let at = place(index, point);
                frame
                    .figure
                    .marker(at, series.marker, series.color, series.hollow);
            }
        }
        Some(frame.figure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::figure::{Color, Point, Shape};

    fn curve(turn: usize, points: &[(f64, f64)], bars: &[(f64, f64)]) -> Curve {
        Curve {
            label: format!("number {turn}"),
            turn,
            points: points.to_vec(),
            bars: bars.to_vec(),
        }
    }

    fn figure(curves: Vec<Curve>) -> Option<Figure> {
        let curves = Curves {
            title: "curves".to_owned(),
            subtitle: String::new(),
            vertical: ("error".to_owned(), Unit::Number),
            horizontal: ("bodies".to_owned(), Unit::Count),
            remark: String::new(),
            curves,
        };
        curves.figure()
    }

    /// The data points in the order they are drawn: an entry of the legend for each curve, then the curves'.
    fn markers(figure: &Figure) -> Vec<(Point, Color)> {
        let marker = |shape: &Shape| match shape {
            Shape::Marker { at, color, .. } => Some((*at, *color)),
            _ => None,
        };
        figure.shapes.iter().filter_map(marker).collect()
    }

    #[test]
    fn a_curve_looks_the_same_whichever_others_have_points() {
        let points = [(1.0, 1.0), (2.0, 4.0)];
        let colors = |first: &[(f64, f64)]| -> Vec<Color> {
            let figure = figure(vec![curve(0, first, &[]), curve(1, &points, &[])]).unwrap();
            markers(&figure)
                .into_iter()
                .map(|(_, color)| color)
                .collect()
        };
        let both = colors(&points);
        let (first, second) = (both[0], both[1]);
        assert_ne!(first, second);
        assert_eq!(both, [first, second, first, first, second, second]);
        assert_eq!(colors(&[(1.0, 0.0)]), [second; 3]);
        assert!(figure(vec![curve(0, &[], &[])]).is_none());
    }

    #[test]
    fn curves_with_bars_lie_side_by_side() {
        let (points, bars) = ([(32.0, 1e-14), (128.0, 2e-14)], [(32.0, 1e-12)]);
        let figure = figure(vec![curve(0, &points, &bars), curve(1, &points, &bars)]).unwrap();
        let places: Vec<Point> = markers(&figure).into_iter().map(|(at, _)| at).collect();
        let [_, _, first, _, second, _] = places[..] else {
            panic!("{places:?}")
        };
        assert_eq!((first.0 + ASIDE, first.1), second);
        for (x, y) in [first, second] {
            let is_bar = |shape: &&Shape| matches!(shape, Shape::Line { points, .. } if points[..] == [(x, y), (x, points[1].1)]);
            assert_eq!(figure.shapes.iter().filter(is_bar).count(), 1);
        }
    }
}
