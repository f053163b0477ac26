//! A figure of the rows against size, both logarithmic, size to base two as in the source's figure
//! 5-2.

use super::axis::{LogAxis, count_label, power_label, seconds_label};
use super::figure::{Figure, Point};
use super::frame::{Frame, HEIGHT, Legend, Titles, devices, times};
use super::series::{Published, Series, explained, published, series};
use crate::row::Row;

/// Room for labels such as `500 µs` \[px\].
const LABELS: f64 = 62.0;

/// What stands over size.
struct Quantity {
    name: &'static str,
    /// Title of its axis.
    axis: &'static str,
    remark: &'static str,
    label: fn(f64) -> String,
    /// Every value shown.
    all: fn(&[&Row]) -> Vec<f64>,
    value: fn(&Row) -> f64,
    /// Whether a bar shows the quartiles of the samples behind the value.
    quartiles: bool,
}

const TIME: Quantity = Quantity {
    name: "time",
    axis: "time of one call",
    remark: "Medians; bars from the first to the third quartile of the samples.",
    label: seconds_label,
    all: times,
    value: |row| row.time_median_s,
    quartiles: true,
};

const ERROR: Quantity = Quantity {
    name: "error",
    axis: "forward error, relative to the largest reference value",
    remark: "Largest over the inputs of a row. Threads make no difference. Errors of exactly zero are left out.",
    label: power_label,
    all: |rows| rows.iter().map(|row| error(row)).collect(),
    value: error,
    quartiles: false,
};

/// The forward error, zero for none.
fn error(row: &Row) -> f64 {
    row.error_forward.unwrap_or(0.0)
}

/// Time against size of the rows of one scenario: a curve a series with the quartiles of its
/// samples, and the published curve.
pub(super) fn time(scenario: &str, rows: &[&Row]) -> Figure {
    let series = series(rows);
    figure(scenario, rows, &TIME, &series, &published(&series))
}

/// Forward error against size of the rows of one scenario; none unless there are errors at several
/// sizes.
pub(super) fn forward_error(scenario: &str, rows: &[&Row]) -> Option<Figure> {
    fn way(row: &Row) -> (&str, &str, &str, &str, u64) {
        let Row {
            method,
            precision,
            backend,
            device,
            size,
            ..
        } = row;
        (method, precision, backend, device, *size)
    }
    let mut shown: Vec<&Row> = Vec::new();
    for row in rows.iter().filter(|row| error(row) > 0.0) {
        if !shown.iter().any(|other| way(other) == way(row)) {
            shown.push(row);
        }
    }
    let first = shown.first()?;
    shown.iter().find(|row| row.size != first.size)?;
    Some(figure(scenario, &shown, &ERROR, &series(&shown), &[]))
}

fn figure(
    scenario: &str,
    rows: &[&Row],
    quantity: &Quantity,
    series: &[Series<'_>],
    published: &[Published],
) -> Figure {
    let titles = Titles {
        title: format!("{scenario}: {} against size", quantity.name),
        subtitle: devices(rows),
        vertical: Some(quantity.axis),
        remark: format!("{}{}", quantity.remark, explained(rows)),
    };
    let legend = Legend::of_lines(series, published);
    let mut frame = Frame::new(&titles, &legend, HEIGHT, LABELS);
    frame.horizontal_title(&format!("size [{}]", rows[0].size_unit));
    let area = frame.area;

    let values = (quantity.all)(rows);
    let vertical = LogAxis::decimal(values, (area.bottom - 8.0, area.top + 8.0));
    let mut sizes: Vec<f64> = rows.iter().map(|row| row.size as f64).collect();
    let horizontal = LogAxis::binary(sizes.iter().copied(), (area.left + 8.0, area.right - 8.0));
    frame.vertical_axis(&vertical, quantity.label);
    let mut ticks = horizontal.binary_ticks(12);
    if ticks.len() < 2 {
        sizes.sort_by(f64::total_cmp);
        sizes.dedup();
        ticks = sizes;
    }
    let ticks: Vec<_> = ticks
        .into_iter()
        .map(|size| (horizontal.place(size), count_label(size)))
        .collect();
    frame.horizontal_ticks(&ticks);
    frame.axis_lines();

    for curve in published {
        let place =
            |(size, time): &(u64, f64)| (horizontal.place(*size as f64), vertical.place(*time));
        let points: Vec<_> = curve.points.iter().map(place).collect();
        frame.published(&points);
    }
    let points = |series: &Series<'_>| -> Vec<Point> {
        let place = |row: &&Row| {
            (
                horizontal.place(row.size as f64),
                vertical.place((quantity.value)(row)),
            )
        };
        series.rows.iter().map(place).collect()
    };
    for series in series {
        for row in series.rows.iter().filter(|_| quantity.quartiles) {
            let x = horizontal.place(row.size as f64);
            let (q1, q3) = row.middle_half_s();
            let ends = [q1, q3].map(|time| (x, vertical.place(time)));
            frame.bar(ends[0], ends[1], series.color);
        }
    }
    for series in series {
        frame.figure.line(&points(series), series.color, 2.0);
    }
    // Over all the lines.
    for series in series {
        for point in points(series) {
            frame
                .figure
                .marker(point, series.marker, series.color, series.hollow);
        }
    }
    frame.figure
}
