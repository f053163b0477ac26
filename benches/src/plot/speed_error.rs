//! Speed against error, both logarithmic: a point a row, labelled with its scenario or its method; or with its size,
//! the ends of each method's curve.

use std::collections::BTreeSet;

use super::axis::{LogAxis, count_label, metric_label, power_label};
use super::figure::{Align, Color, Figure, INK, MUTED, Point, Rect, WHITE, fit, text_width};
use super::frame::{Frame, HEIGHT, LABEL, Legend, SMALL, Titles, devices};
use super::labels::{self, Label};
use super::paint::MARKER;
use super::series::{Series, series};
use super::zero_strip::ZeroStrip;
use crate::row::Row;
use crate::table::format::count;

/// Room for labels such as `500 M` \[px\].
const LABELS: f64 = 56.0;
/// Widest name of a scenario as a label \[px\].
const NAME: f64 = 200.0;
/// Heading of the strip for errors of zero.
pub(super) const EXACT: &str = "← exactly 0";
/// Radius of the ring about a point of the front \[px\].
const RING: f64 = MARKER + 3.5;
/// Lines from a point to a label that found no room beside it.
const LEADER: Color = Color(168, 168, 168);

/// A row as a point.
pub(super) struct DataPoint<'a> {
    error: f64,
    /// \[size unit per second\]
    speed: f64,
    pub(super) series: &'a Series<'a>,
    pub(super) label: String,
    /// Whether it is on the front of its [`rivals`].
    on_front: bool,
}

/// What a row is asked for, whatever answers it.
pub(super) fn task(row: &Row) -> &str {
    let (family, question) = row.method.split_once('-').unwrap_or((&row.method, ""));
    match family {
        _ if row.method == "aba-derivatives" => &row.method,
        "aba" | "crba" | "dca" | "mujoco" | "pinocchio" | "tolerance" => "forward dynamics",
        "step" if matches!(question, "" | "16") => "a whole step",
        "exact" | "moller" | "moller0" | "separating" => question,
        // Meshes lie on the device, unless they are uploaded for each answer.
        "collision" => match question {
            "pairs-upload" => "pairs",
            "pairs" | "pairs-all" | "pairs-tree" | "pairs-chosen" | "moller" => "pairs-resident",
            "any" => "any-resident",
            "count" => "count-resident",
            "mask" => "mask-resident",
            _ => &row.method,
        },
        _ => &row.method,
    }
}

/// What a row is compared with: the same input, and asked the same of it.
fn rivals(row: &Row) -> (&str, u64, &str) {
    (&row.scenario, row.size, task(row))
}

/// Whether no other row of the same input, of which there are some, is both faster and more exact:
/// the Pareto front.
fn is_on_front(row: &Row, rows: &[&Row], error: impl Fn(&Row) -> Option<f64>) -> bool {
    let others = || {
        rows.iter()
            .filter(|other| rivals(other) == rivals(row) && error(other).is_some())
    };
    let (time, own) = (row.time_median_s, error(row));
    let beats = |other: &Row| {
        let (faster, better) = (other.time_median_s <= time, error(other) <= own);
        faster && better && (other.time_median_s < time || error(other) < own)
    };
    others().nth(1).is_some() && !others().any(|other| beats(other))
}

/// An error figure that rows have in common.
struct Measure {
    /// Title of the axis.
    title: &'static str,
    /// What rows without it lack.
    name: &'static str,
    value: fn(&Row) -> Option<f64>,
    label: fn(f64) -> String,
}

const MEASURES: [Measure; 3] = [
    Measure {
        title: "forward error, relative to the largest reference value",
        name: "forward error",
        value: |row| row.error_forward,
        label: power_label,
    },
    Measure {
        title: "residual, relative to its terms",
        name: "residual",
        value: |row| row.error_residual,
        label: power_label,
    },
    Measure {
        title: "wrong pairs, false and missed",
        name: "count of wrong pairs",
        value: |row| row.wrong_pairs().map(|pairs| pairs as f64),
        label: count_label,
    },
];

/// What a method is asked: the part of its name after the first hyphen, `count` of `exact-count`.
fn question(row: &Row) -> &str {
    row.method
        .split_once('-')
        .map_or("", |(_, question)| question)
}

/// The rows whose question some row answers with an error, and the other questions; all rows if
/// there is no error at all. What every method answers exactly tells of speed only, of which
/// there is another plot.
fn telling<'a>(
    rows: &[&'a Row],
    error: impl Fn(&Row) -> Option<f64>,
) -> (Vec<&'a Row>, BTreeSet<&'a str>) {
    let is_wrong = |row: &&&Row| error(row).is_some_and(|error| error > 0.0);
    let wrong: BTreeSet<&str> = rows
        .iter()
        .filter(is_wrong)
        .map(|row| question(row))
        .collect();
    let tells = |row: &&Row| wrong.is_empty() || wrong.contains(question(row));
    let (telling, others): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|row| tells(row));
    (telling, others.into_iter().map(question).collect())
}

/// What stands beside points.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Labels {
    /// The scenario, of which there are several of one size each.
    Scenario,
    /// The size, at the ends of each series, of one scenario.
    Size,
    /// What answered, of one scenario and one size.
    Method,
}

/// The plot of rows of one scenario, or of several that have one size each.
pub(super) fn figure(title: String, labels: Labels, rows: &[&Row]) -> Figure {
    let measured = |measure: &Measure| {
        rows.iter()
            .filter(|row| (measure.value)(row).is_some())
            .count()
    };
    // The figure that most rows have, the first of equals.
    let [mut measure, others @ ..] = MEASURES.each_ref();
    for other in others {
        if measured(other) > measured(measure) {
            measure = other;
        }
    }
    let (rows, exact_questions) = match labels {
        Labels::Method => (rows.to_vec(), BTreeSet::new()),
        Labels::Scenario | Labels::Size => telling(rows, measure.value),
    };
    let series = series(&rows);
    let speed = |row: &Row| row.size as f64 / row.time_median_s;
    let error = |row: &Row| (measure.value)(row);
    let mut points = Vec::new();
    for series in &series {
        for row in &series.rows {
            let label = match labels {
                Labels::Size => count(row.size),
                Labels::Scenario => fit(&row.scenario, SMALL, false, NAME),
                Labels::Method => fit(&series.label, SMALL, false, NAME),
            };
            points.extend(error(row).map(|error| DataPoint {
                error,
                speed: speed(row),
                series,
                label,
                on_front: is_on_front(row, &rows, measure.value),
            }));
        }
    }
    let kind = match labels {
        Labels::Size => "size, at the ends of each series",
        Labels::Scenario => "scenario",
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
    if !exact_questions.is_empty() {
        let names: Vec<&str> = exact_questions.into_iter().collect();
        let named = match names.len() {
            0..=5 => names.join(", "),
            count => format!("{count} other questions"),
        };
        remark.push_str(&format!(" Not drawn, as no answer is wrong: {named}."));
    }
    let titles = Titles {
        title,
        subtitle: devices(&rows),
        vertical: Some(&format!("speed [{} per second]", rows[0].size_unit)),
        horizontal: measure.title,
        remark,
    };
    let has_points = |series: &&Series<'_>| series.rows.iter().any(|row| error(row).is_some());
    let drawn = match labels {
        Labels::Method => Vec::new(),
        Labels::Scenario | Labels::Size => series.iter().filter(has_points).collect(),
    };
    let legend = Legend {
        series: drawn,
        published: Vec::new(),
        lines: false,
    };
    let mut frame = Frame::new(&titles, &legend, HEIGHT, LABELS);
    let area = frame.area;
    let vertical = LogAxis::decimal(
        points.iter().map(|point| point.speed),
        (area.bottom - 24.0, area.top + 24.0),
    );
    frame.vertical_axis(&vertical, metric_label);

    let (exact, inexact): (Vec<DataPoint<'_>>, Vec<DataPoint<'_>>) =
        points.into_iter().partition(|point| point.error == 0.0);
    let strip = ZeroStrip::new(&exact, &area, inexact.is_empty());
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
    let horizontal = LogAxis::decimal(
        inexact.iter().map(|point| point.error),
        (plane.left + 24.0, plane.right - 24.0),
    );
    if !inexact.is_empty() {
        frame.horizontal_axis(&horizontal, measure.label);
    }
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
        if point.on_front {
            ring(&mut frame.figure, place);
        }
        frame.figure.marker(
            place,
            point.series.marker,
            point.series.color,
            point.series.hollow,
        );
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
    if labels == Labels::Method {
        front(&mut frame.figure, &inexact, place);
    }
    let ends_only = labels == Labels::Size;
    draw_labelled(&mut frame.figure, &inexact, place, &plane, ends_only);
    frame.figure
}

/// Marks a point of the front.
fn ring(figure: &mut Figure, (x, y): Point) {
    const CORNERS: u32 = 32;
    let corner = |index: u32| {
        let angle = core::f64::consts::TAU * f64::from(index) / f64::from(CORNERS);
        (x + RING * angle.cos(), y + RING * angle.sin())
    };
    let circle: Vec<Point> = (0..=CORNERS).map(corner).collect();
    figure.line(&circle, INK, 1.5);
}

/// A line along the front, which no point is beyond.
fn front(figure: &mut Figure, points: &[DataPoint<'_>], place: impl Fn(&DataPoint<'_>) -> Point) {
    let mut front: Vec<&DataPoint<'_>> = points.iter().filter(|point| point.on_front).collect();
    front.sort_by(|a, b| a.error.total_cmp(&b.error));
    for ends in front.windows(2) {
        // Up where it gets faster: to the left of that nothing is.
        let [(x, y), (to_x, to_y)] = [place(ends[0]), place(ends[1])];
        figure.line(&[(x, y), (to_x, y), (to_x, to_y)], LEADER, 1.5);
    }
}

fn same_series(one: &DataPoint<'_>, other: &DataPoint<'_>) -> bool {
    std::ptr::eq(one.series, other.series)
}

/// Draws the points with their labels, or those of the ends of each series, within `bounds`.
fn draw_labelled(
    figure: &mut Figure,
    points: &[DataPoint<'_>],
    place: impl Fn(&DataPoint<'_>) -> Point,
    bounds: &Rect,
    ends_only: bool,
) {
    let around = |point: &DataPoint<'_>| {
        let half = if point.on_front { RING } else { MARKER };
        Rect::around(place(point), half + 2.0)
    };
    let markers: Vec<Rect> = points.iter().map(around).collect();
    let labelled: Vec<&DataPoint<'_>> = points
        .chunk_by(same_series)
        .flat_map(|curve| {
            let last = curve.len() - 1;
            let is_shown = move |at: &usize| !ends_only || *at == 0 || *at == last;
            (0..=last).filter(is_shown).map(|at| &curve[at])
        })
        .collect();
    let label = |point: &&DataPoint<'_>| Label {
        point: place(point),
        width: text_width(&point.label, SMALL, false) + 4.0,
        height: SMALL + 3.0,
    };
    let labels: Vec<Label> = labelled.iter().map(label).collect();
    let places = labels::place(&labels, &markers, bounds);
    for (label, place) in labels.iter().zip(&places) {
        if let Some(end) = place.and_then(|place| labels::leader_end(label.point, &place)) {
            figure.line(&[label.point, end], LEADER, 1.0);
        }
    }
    for point in points.iter().filter(|point| point.on_front) {
        ring(figure, place(point));
    }
    for point in points {
        let Series {
            marker,
            color,
            hollow,
            ..
        } = *point.series;
        figure.marker(place(point), marker, color, hollow);
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
