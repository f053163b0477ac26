//! Rows as series: a colour for each method, a marker for each precision and way of running it.

use std::collections::BTreeSet;

use super::figure::{Color, Marker};
use crate::row::Row;

/// Colours told apart by readers with any kind of colour vision, dark enough for a white ground
/// (M. Okabe and K. Ito, "Color universal design", 2008; their yellow left out).
const COLORS: [Color; 7] = [
    Color(0, 114, 178),
    Color(213, 94, 0),
    Color(0, 158, 115),
    Color(204, 121, 167),
    Color(230, 159, 0),
    Color(86, 180, 233),
    Color(0, 0, 0),
];
/// Forms about equally heavy, first filled, then hollow.
const MARKERS: [Marker; 5] = [
    Marker::Circle,
    Marker::Square,
    Marker::Diamond,
    Marker::Up,
    Marker::Down,
];

/// The rows of one method run in one way.
pub(super) struct Series<'a> {
    pub(super) label: String,
    pub(super) color: Color,
    pub(super) marker: Marker,
    pub(super) hollow: bool,
    /// In order of size.
    pub(super) rows: Vec<&'a Row>,
}

/// The series of these rows in order of first appearance. Labels name only what differs, besides
/// the method: threads are the processor's, and a device is named where there are several of its kind.
pub(super) fn series<'a>(rows: &[&'a Row]) -> Vec<Series<'a>> {
    fn way(row: &Row) -> (&str, &str, &str, usize, &str) {
        (
            &row.method,
            &row.precision,
            &row.backend,
            row.threads,
            &row.device,
        )
    }
    let several = |of: &dyn Fn(&Row) -> bool, part: fn(&Row) -> String| {
        let rows = rows.iter().filter(|row| of(row));
        rows.map(|row| part(row)).collect::<BTreeSet<_>>().len() > 1
    };
    let several_backends = several(&|_| true, |row| row.backend.clone());
    let several_threads = several(&|row| row.backend == "cpu", |row| row.threads.to_string());
    let several_devices =
        |backend: &str| several(&|row| row.backend == backend, |row| row.device.clone());
    let devices = [
        ("cpu", several_devices("cpu")),
        ("gpu", several_devices("gpu")),
    ];

    let mut series: Vec<Series<'a>> = Vec::new();
    for row in rows {
        if let Some(series) = series
            .iter_mut()
            .find(|series| way(series.rows[0]) == way(row))
        {
            series.rows.push(row);
            continue;
        }
        let mut label = row.method.clone();
        if row.precision != "-" {
            label.push_str(&format!(" {}", row.precision));
        }
        let is_gpu = row.backend == "gpu";
        if several_backends && is_gpu {
            label.push_str(", GPU");
        } else if several_backends || several_threads {
            let plural = if row.threads == 1 { "" } else { "s" };
            label.push_str(&format!(", {} thread{plural}", row.threads));
        }
        if devices.contains(&(row.backend.as_str(), true)) {
            label.push_str(&format!(", {}", row.device));
        }
        let (color, (marker, hollow)) = look(&series, row, several_backends && is_gpu);
        series.push(Series {
            label,
            color,
            marker,
            hollow,
            rows: vec![row],
        });
    }
    for series in &mut series {
        series.rows.sort_by_key(|row| row.size);
    }
    series
}

/// What names of methods among these rows mean that does not show, after a space; empty for nothing.
pub(super) fn explained(rows: &[&Row]) -> &'static str {
    let has = |method: &str| (rows.iter()).any(|row| row.backend == "gpu" && row.method == method);
    if has("step-16") {
        " On a GPU, step-16 is one of sixteen steps submitted together, step one alone."
    } else {
        ""
    }
}

/// Colour and marker of a curve by its turn: colours first.
pub(super) fn nth_look(index: usize) -> (Color, (Marker, bool)) {
    let marker = MARKERS[index % MARKERS.len()];
    let hollow = index / COLORS.len() % 2 == 1;
    (COLORS[index % COLORS.len()], (marker, hollow))
}

/// Colour and marker of the series that starts with `row`, after the others: the colour of its
/// method, and the first marker from that of its turn among the method's series that no other series
/// of this colour has, as long as there is one; hollow ones first if asked for.
fn look(others: &[Series<'_>], row: &Row, hollow_first: bool) -> (Color, (Marker, bool)) {
    let of_method = |series: &&Series<'_>| series.rows[0].method == row.method;
    let color = others.iter().find(of_method).map_or_else(
        || {
            let methods: BTreeSet<&str> = others
                .iter()
                .map(|series| series.rows[0].method.as_str())
                .collect();
            COLORS[methods.len() % COLORS.len()]
        },
        |series| series.color,
    );
    let alike = |series: &&Series<'_>| of_method(series) && series.rows[0].backend == row.backend;
    let turn = others.iter().filter(alike).count();
    let markers: Vec<(Marker, bool)> = [hollow_first, !hollow_first]
        .iter()
        .flat_map(|hollow| MARKERS.map(|marker| (marker, *hollow)))
        .collect();
    let taken = |look: &(Marker, bool)| {
        others
            .iter()
            .any(|series| series.color == color && (series.marker, series.hollow) == *look)
    };
    let turn = turn % markers.len();
    let marker = markers[turn..]
        .iter()
        .chain(&markers[..turn])
        .find(|marker| !taken(marker))
        .unwrap_or(&markers[turn]);
    (color, *marker)
}

/// Published times of the source.
pub(super) struct Published {
    pub(super) label: String,
    /// Size and time \[s\], in order of size.
    pub(super) points: Vec<(u64, f64)>,
}

/// The published times of these series: one curve, or one for each method where methods have
/// different times.
pub(super) fn published(series: &[Series<'_>]) -> Vec<Published> {
    struct Curve<'a> {
        methods: BTreeSet<&'a str>,
        points: Vec<(u64, f64)>,
    }
    let mut curves: Vec<Curve<'_>> = Vec::new();
    for series in series {
        let points: Vec<(u64, f64)> = series
            .rows
            .iter()
            .filter_map(|row| Some((row.size, row.reference_time_s?)))
            .collect();
        if points.is_empty() {
            continue;
        }
        let same = |(size, time): &(u64, f64), curve: &Curve<'_>| {
            curve.points.iter().all(|(s, t)| s != size || t == time)
        };
        let method = series.rows[0].method.as_str();
        match curves
            .iter_mut()
            .find(|curve| points.iter().all(|point| same(point, curve)))
        {
            Some(curve) => {
                curve.methods.insert(method);
                curve.points.extend(points);
            }
            None => curves.push(Curve {
                methods: BTreeSet::from([method]),
                points,
            }),
        }
    }
    let several = curves.len() > 1;
    curves
        .into_iter()
        .map(
            |Curve {
                 methods,
                 mut points,
             }| {
                points.sort_by_key(|(size, _)| *size);
                points.dedup();
                let methods: Vec<&str> = methods.into_iter().collect();
                let label = if several {
                    format!("published for {}", methods.join(", "))
                } else {
                    "published".to_owned()
                };
                Published { label, points }
            },
        )
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    #[test]
    fn labels_name_what_differs() {
        let rows = [
            row("chain", "aba", "f64", 256, 2e-3),
            row("chain", "aba", "f64", 128, 1e-3),
            Row {
                threads: 4,
                ..row("chain", "aba", "f64", 128, 1e-3)
            },
            row("chain", "moller", "-", 128, 1e-3),
        ];
        let all: Vec<&Row> = rows.iter().collect();
        let labels: Vec<String> = series(&all)
            .into_iter()
            .map(|series| series.label)
            .collect();
        assert_eq!(
            labels,
            [
                "aba f64, 1 thread",
                "aba f64, 4 threads",
                "moller, 1 thread"
            ]
        );
        let on_gpu = Row {
            backend: "gpu".to_owned(),
            device: "a GPU".to_owned(),
            ..row("chain", "aba", "f64", 128, 1e-3)
        };
        let both = series(&[&rows[0], &on_gpu]);
        assert_eq!(
            [&both[0].label, &both[1].label],
            ["aba f64, 1 thread", "aba f64, GPU"]
        );
        assert_eq!([both[0].hollow, both[1].hollow], [false, true]);
        let few = series(&all[..2]);
        assert_eq!(few[0].label, "aba f64");
        assert!(few[0].rows.iter().map(|row| row.size).is_sorted());
    }

    #[test]
    fn a_colour_is_a_method_and_no_two_series_look_the_same() {
        let mut rows = Vec::new();
        for precision in ["f64", "f32", "f64/f32", "1", "2"] {
            for method in 0..10 {
                rows.push(row("chain", &method.to_string(), precision, 128, 1e-3));
            }
        }
        let rows: Vec<&Row> = rows.iter().collect();
        let all = series(&rows);
        for (index, one) in all.iter().enumerate() {
            assert_eq!(one.color, all[index % 10].color);
            for other in &all[..index] {
                let look = |of: &Series<'_>| (of.color, of.marker, of.hollow);
                assert_ne!(look(one), look(other), "{} and {}", one.label, other.label);
            }
        }
        // Where there are colours enough, a marker is a way.
        assert!(all[1..7].iter().all(|one| one.marker == all[0].marker));
    }

    #[test]
    fn published_times_join_into_one_curve_unless_they_contradict() {
        let with = |method: &str, size, time| Row {
            reference_time_s: Some(time),
            ..row("c", method, "f64", size, 1e-3)
        };
        let rows = [
            with("a", 128, 0.03),
            with("a", 256, 0.04),
            with("b", 256, 0.04),
            with("b", 512, 0.05),
        ];
        let curves = published(&series(&rows.iter().collect::<Vec<_>>()));
        assert_eq!(curves.len(), 1);
        assert_eq!(
            (curves[0].label.as_str(), curves[0].points.len()),
            ("published", 3)
        );
        let rows = [with("gpu", 128, 0.03), with("cpu", 128, 0.3)];
        let curves = published(&series(&rows.iter().collect::<Vec<_>>()));
        assert_eq!(
            curves
                .iter()
                .map(|curve| curve.label.as_str())
                .collect::<Vec<_>>(),
            ["published for gpu", "published for cpu"]
        );
    }
}
