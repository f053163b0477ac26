//! Time against size, both logarithmic, size to base two as in the source's figure 5-2.

use super::axis::{LogAxis, count_label, seconds_label};
use super::figure::{Figure, Point};
use super::frame::{Frame, HEIGHT, Legend, Titles, devices, times};
use super::series::{Series, published, series};
use crate::row::Row;

/// Room for labels such as `500 µs` \[px\].
const LABELS: f64 = 62.0;

/// The plot of the rows of one scenario: a curve a series with the quartiles of its samples, and
/// the published curve.
pub(super) fn figure(scenario: &str, rows: &[&Row]) -> Figure {
    let series = series(rows);
    let published = published(&series);
    let titles = Titles {
        title: format!("{scenario}: time against size"),
        subtitle: devices(rows),
        vertical: Some("time of one call"),
        horizontal: &format!("size [{}]", rows[0].size_unit),
        remark: "Medians; bars from the first to the third quartile of the samples.".to_owned(),
    };
    let mut frame = Frame::new(
        &titles,
        &Legend::of_lines(&series, &published),
        HEIGHT,
        LABELS,
    );
    let area = frame.area;

    let vertical = LogAxis::decimal(times(rows), (area.bottom - 8.0, area.top + 8.0));
    let mut sizes: Vec<f64> = rows.iter().map(|row| row.size as f64).collect();
    let horizontal = LogAxis::binary(sizes.iter().copied(), (area.left + 8.0, area.right - 8.0));
    frame.vertical_axis(&vertical, seconds_label);
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

    for curve in &published {
        let place =
            |(size, time): &(u64, f64)| (horizontal.place(*size as f64), vertical.place(*time));
        let points: Vec<_> = curve.points.iter().map(place).collect();
        frame.published(&points);
    }
    let points = |series: &Series<'_>| -> Vec<Point> {
        let place = |row: &&Row| {
            (
                horizontal.place(row.size as f64),
                vertical.place(row.time_median_s),
            )
        };
        series.rows.iter().map(place).collect()
    };
    for series in &series {
        for row in &series.rows {
            let x = horizontal.place(row.size as f64);
            let (q1, q3) = row.middle_half_s();
            let ends = [q1, q3].map(|time| (x, vertical.place(time)));
            frame.bar(ends[0], ends[1], series.color);
        }
    }
    for series in &series {
        frame.figure.line(&points(series), series.color, 2.0);
    }
    // Over all the lines.
    for series in &series {
        for point in points(series) {
            frame
                .figure
                .marker(point, series.marker, series.color, false);
        }
    }
    frame.figure
}
