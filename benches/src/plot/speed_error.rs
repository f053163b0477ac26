//! Speed against error of one scenario, both logarithmic: a point a row, labelled with its method; or with its
//! size, the ends of each method's curve.

use super::axis::{LogAxis, metric_label};
use super::figure::{Align, Color, Figure, MUTED, Point, RING, Rect, WHITE, fit, text_width};
use super::frame::{Frame, HEIGHT, LABEL, Legend, SMALL, Titles, devices};
use super::front::{is_on_front, is_one_contest, work};
use super::labels::{self, Label};
use super::measure::Measure;
use super::paint::MARKER;
use super::series::{Series, explained, series};
use super::zero_strip::ZeroStrip;
use crate::row::Row;
use crate::table::format::count;

/// Room for labels such as `500 M` \[px\].
const LABELS: f64 = 56.0;
/// Widest name of a method as a label \[px\].
const NAME: f64 = 240.0;
/// Room for labels at the right of the data where there is no legend \[px\].
const BESIDE: f64 = 40.0;
/// Heading of the strip for errors of zero.
pub(super) const EXACT: &str = "← exactly 0";
/// Lines from a point to a label that found no room beside it.
const LEADER: Color = Color(168, 168, 168);

/// A row as a point.
pub(super) struct DataPoint<'a> {
    error: f64,
    /// \[unit of work per second\]
    speed: f64,
    pub(super) series: &'a Series<'a>,
    pub(super) label: String,
    /// Whether none that it compares with is both faster and more exact.
    on_front: bool,
}

/// What stands beside points.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Labels {
    /// The size, at the ends of each series.
    Size,
    /// What answered, of one size.
    Method,
}

/// The plot of rows of one scenario; none if their errors do not tell them apart.
pub(super) fn figure(title: String, labels: Labels, rows: &[&Row]) -> Option<Figure> {
    let measure = Measure::of(rows);
    if !measure.tells(rows) {
        return None;
    }
    let series = series(rows);
    let error = |row: &Row| (measure.value)(row);
    let mut points = Vec::new();
    for series in &series {
        for row in &series.rows {
            let label = match labels {
                Labels::Size => count(row.size),
                Labels::Method => fit(&series.label, SMALL, false, NAME),
            };
            points.extend(error(row).map(|error| DataPoint {
                error,
                speed: work(row).0 / row.time_median_s,
                series,
                label,
                on_front: is_on_front(row, rows, measure.value),
            }));
        }
    }
    let titles = Titles {
        title,
        subtitle: devices(rows),
        vertical: Some(&format!("speed [{} per second]", work(rows[0]).1)),
        remark: remark(labels, measure, rows, &points),
    };
    let has_points = |series: &&Series<'_>| series.rows.iter().any(|row| error(row).is_some());
    let drawn = match labels {
        Labels::Method => Vec::new(),
        Labels::Size => series.iter().filter(has_points).collect(),
    };
    let legend = Legend {
        series: drawn,
        published: Vec::new(),
        lines: false,
    };
    let mut frame = Frame::new(&titles, &legend, HEIGHT, LABELS);
    frame.horizontal_title(measure.title);
    let area = frame.area;
    let vertical = LogAxis::decimal(
        points.iter().map(|point| point.speed),
        (area.bottom - 24.0, area.top + 24.0),
    );
    frame.vertical_axis(&vertical, metric_label);

    let (exact, inexact): (Vec<DataPoint<'_>>, Vec<DataPoint<'_>>) =
        points.into_iter().partition(|point| point.error == 0.0);
    let strip = ZeroStrip::new(&exact, &area);
    let border = strip.right();
    let names: Vec<_> = strip
        .columns()
        .map(|(x, label)| (x, fit(label, LABEL, false, strip.label_width())))
        .collect();
    frame.labels_below(&names);
    for x in strip.separators() {
        frame.vertical_line(x);
    }
    let plane = Rect {
        left: border,
        ..area
    };
    let horizontal = measure.axis(rows, (plane.left + 24.0, plane.right - 24.0));
    frame.horizontal_axis(&horizontal, measure.label);
    frame.axis_lines();
    if !exact.is_empty() {
        let end = (border - 4.0, area.top - 10.0);
        frame.figure.text(end, EXACT, SMALL, MUTED, Align::Right);
        frame.figure.dashed(
            &[(border, area.top), (border, area.bottom)],
            MUTED,
            1.5,
            (3.0, 4.0),
        );
    }
    for point in &exact {
        let place = (strip.place(point), vertical.place(point.speed));
        frame.figure.marker(
            place,
            point.series.marker,
            point.series.color,
            point.series.hollow,
        );
        if point.on_front {
            frame.figure.ring(place);
        }
    }
    let place =
        |point: &DataPoint<'_>| (horizontal.place(point.error), vertical.place(point.speed));
    if labels == Labels::Size {
        for curve in inexact.chunk_by(same_series) {
            // One by one: joined at a sharp angle, lines end in a spike.
            for ends in curve.windows(2) {
                let line = [place(&ends[0]), place(&ends[1])];
                frame.figure.line(&line, ends[0].series.color.pale(), 1.5);
            }
        }
    }
    let front = if is_one_contest(rows) {
        front(&inexact, place)
    } else {
        Vec::new()
    };
    for part in &front {
        frame.figure.line(part, LEADER, 1.5);
    }
    let which = match labels {
        Labels::Size if is_one_contest(rows) => |point: &DataPoint<'_>| point.on_front,
        Labels::Size => |_: &DataPoint<'_>| false,
        Labels::Method => |_: &DataPoint<'_>| true,
    };
    let bounds = match labels {
        Labels::Size => plane,
        Labels::Method => Rect {
            right: plane.right + BESIDE,
            ..plane
        },
    };
    draw_labelled(&mut frame.figure, &inexact, place, &front, &bounds, which);
    Some(frame.figure)
}

/// What stands at the foot.
fn remark(labels: Labels, measure: &Measure, rows: &[&Row], points: &[DataPoint<'_>]) -> String {
    let kind = match labels {
        Labels::Size if is_one_contest(rows) => &format!(
            "{}, at the ends of each series and ringed",
            rows[0].size_unit
        ),
        Labels::Size => "size, at the ends of each series",
        Labels::Method => "method, precision of chunks/joins, and what computes",
    };
    let columns = if points.iter().any(|point| point.error == 0.0) {
        ", and columns at exactly 0"
    } else {
        ""
    };
    let mut remark = format!("Labels{columns}: {kind}. Best is at the top left.");
    if points.iter().any(|point| point.on_front) {
        remark
            .push_str(" Ringed: of one input and question, nothing is both faster and more exact.");
    }
    if points.len() < rows.len() {
        remark.push_str(&format!(
            " Rows without {}, not drawn: {}.",
            measure.name,
            rows.len() - points.len()
        ));
    }
    remark.push_str(explained(rows));
    remark
}

/// The parts, level and upright, of a line along the front, which no point is beyond.
fn front(points: &[DataPoint<'_>], place: impl Fn(&DataPoint<'_>) -> Point) -> Vec<[Point; 2]> {
    let mut front: Vec<&DataPoint<'_>> = points.iter().filter(|point| point.on_front).collect();
    front.sort_by(|a, b| a.error.total_cmp(&b.error));
    let parts = |ends: &[&DataPoint<'_>]| {
        // Up where it gets faster: to the left of that nothing is.
        let [from, to] = [place(ends[0]), place(ends[1])];
        let corner = (to.0, from.1);
        [[from, corner], [corner, to]]
    };
    front.windows(2).flat_map(parts).collect()
}

fn same_series(one: &DataPoint<'_>, other: &DataPoint<'_>) -> bool {
    std::ptr::eq(one.series, other.series)
}

/// Draws the points, and within `bounds` the labels of the ends of each series and of `which` points, off these
/// `lines`.
fn draw_labelled(
    figure: &mut Figure,
    points: &[DataPoint<'_>],
    place: impl Fn(&DataPoint<'_>) -> Point,
    lines: &[[Point; 2]],
    bounds: &Rect,
    which: fn(&DataPoint<'_>) -> bool,
) {
    let around = |point: &DataPoint<'_>| {
        let half = if point.on_front { RING } else { MARKER };
        Rect::around(place(point), half + 2.0)
    };
    let along = |line: &[Point; 2]| Rect::along(*line, 1.0);
    let markers = points.iter().map(around);
    let obstacles: Vec<Rect> = markers.chain(lines.iter().map(along)).collect();
    let labelled: Vec<&DataPoint<'_>> = points
        .chunk_by(same_series)
        .flat_map(|curve| {
            let last = curve.len() - 1;
            let is_shown = move |at: &usize| *at == 0 || *at == last || which(&curve[*at]);
            (0..=last).filter(is_shown).map(|at| &curve[at])
        })
        .collect();
    let label = |point: &&DataPoint<'_>| Label {
        point: place(point),
        width: text_width(&point.label, SMALL, false) + 4.0,
        height: SMALL + 3.0,
    };
    let labels: Vec<Label> = labelled.iter().map(label).collect();
    let places = labels::place(&labels, &obstacles, bounds);
    for (label, place) in labels.iter().zip(&places) {
        if let Some(end) = place.and_then(|place| labels::leader_end(label.point, &place)) {
            figure.line(&[label.point, end], LEADER, 1.0);
        }
    }
    for point in points {
        let Series {
            marker,
            color,
            hollow,
            ..
        } = *point.series;
        figure.marker(place(point), marker, color, hollow);
        if point.on_front {
            figure.ring(place(point));
        }
    }
    for (point, place) in labelled.iter().zip(&places) {
        if let Some(place) = place {
            let middle = (
                0.5 * (place.left + place.right),
                0.5 * (place.top + place.bottom),
            );
            // A ground that keeps the grid and lines to other labels out of the text.
            let ground = [(place.left, middle.1), (place.right, middle.1)];
            figure.line(&ground, WHITE, SMALL);
            let color = point.series.color.for_text();
            figure.text(middle, &point.label, SMALL, color, Align::Center);
        }
    }
}
