//! Layout and files of plots of made-up runs.

use super::figure::{Align, Rect, Shape, Text, text_width};
use super::*;
use crate::row::tests::row;

/// A chain measured by four methods, with the source's published times.
fn chain() -> Vec<Row> {
    let published = [
        (128, 34.74e-3),
        (256, 40.28e-3),
        (512, 44.84e-3),
        (1024, 52.15e-3),
        (2048, 57.94e-3),
    ];
    let methods = [
        ("aba", "f64", 300e-9, 1e-14),
        ("aba", "f32", 250e-9, 3e-6),
        ("dca", "f64", 900e-9, 4e-14),
        ("chunked", "f64", 420e-9, 0.0),
    ];
    let mut rows = Vec::new();
    for (method, precision, per_body, error) in methods {
        for (size, time) in published {
            let n = size as f64;
            rows.push(Row {
                error_forward: Some(error * (n / 128.0).powf(1.3)),
                reference_time_s: Some(time),
                time_q3_s: Some(per_body * n * (1.1 + 0.4 * (128.0 / n))),
                time_max_s: per_body * n * 2.0,
                ..row("chain", method, precision, size, per_body * n)
            });
        }
    }
    rows
}

/// Scenarios of one size each, exact methods and one that is not.
fn meshes() -> Vec<Row> {
    let scenarios = [
        ("sphere x cylinder", 207_360, 2.34e-3, 3),
        ("cup x bowl", 39_795_000, 0.1839, 1039),
        ("cup x spoon", 197_170_960, 1.08422, 1585),
    ];
    let methods = [
        ("all pairs", 2.1e-9, false),
        ("bvh", 2.4e-11, false),
        ("moller", 1.7e-9, true),
    ];
    let mut rows = Vec::new();
    for (scenario, size, published, wrong) in scenarios {
        for (method, per_pair, inexact) in methods {
            rows.push(Row {
                error_forward: None,
                false_pairs: Some(if inexact { wrong } else { 0 }),
                missed_pairs: Some(0),
                size_unit: "triangle pairs".to_owned(),
                reference_time_s: (method != "bvh").then_some(published),
                ..row(
                    scenario,
                    method,
                    if inexact { "f32" } else { "-" },
                    size,
                    per_pair * size as f64,
                )
            });
        }
    }
    rows
}

/// Rows that crowd every plot: twenty methods with long names at almost the same speed and error.
fn crowd() -> Vec<Row> {
    let mut rows = Vec::new();
    for method in 0..20 {
        for size in [1000, 1010, 1500] {
            rows.push(row(
                "a scenario with a rather long name",
                &format!("a method with a rather long name {method}"),
                "f64",
                size,
                1e-3 + 1e-6 * f64::from(method),
            ));
        }
    }
    for scenario in 0..12 {
        rows.push(row(
            &format!("scenario {scenario} with a name far too long for its place"),
            "aba",
            "f64",
            64,
            1e-3,
        ));
    }
    rows
}

fn texts(plot: &Plot) -> Vec<&Text> {
    let shapes = plot.figure.shapes.iter();
    shapes
        .filter_map(|shape| match shape {
            Shape::Text(text) => Some(text),
            _ => None,
        })
        .collect()
}

/// The area that a text covers.
fn bounds(text: &Text) -> Rect {
    let width = text_width(&text.text, text.em, text.bold);
    let left = match text.align {
        Align::Left => text.at.0,
        Align::Center => text.at.0 - 0.5 * width,
        Align::Right => text.at.0 - width,
    };
    let half = 0.6 * text.em;
    Rect {
        left,
        right: left + width,
        top: text.at.1 - half,
        bottom: text.at.1 + half,
    }
}

#[test]
fn no_text_covers_another_or_leaves_the_picture() {
    for plot in [chain(), meshes(), crowd()]
        .iter()
        .flat_map(|rows| plots(rows))
    {
        let page = Rect {
            left: 0.0,
            top: 0.0,
            right: f64::from(plot.figure.width),
            bottom: f64::from(plot.figure.height),
        };
        let texts = texts(&plot);
        for (index, text) in texts.iter().enumerate() {
            let place = bounds(text);
            assert!(
                page.contains(&place),
                "{}: {text:?} leaves the picture",
                plot.title()
            );
            for other in &texts[..index] {
                assert!(
                    !place.overlaps(&bounds(other)),
                    "{}: {text:?} covers {other:?}",
                    plot.title()
                );
            }
        }
    }
}

#[test]
fn every_row_is_a_point_and_every_label_is_there() {
    let rows = chain();
    let plots = plots(&rows);
    let markers = |plot: &Plot| {
        plot.figure
            .shapes
            .iter()
            .filter(|shape| matches!(shape, Shape::Marker { .. }))
            .count()
    };
    let [time, error, error_against_size] = plots.as_slice() else {
        panic!("{plots:?}")
    };
    // Four in the legend beside the rows; the published curve has five points and its entry.
    assert_eq!(markers(time), rows.len() + 4 + 6);
    assert_eq!(markers(error), rows.len() + 4);
    // The method without errors has no place on a logarithmic axis.
    assert_eq!(markers(error_against_size), 3 * 5 + 3);
    let labelled = |size: &str| texts(error).iter().filter(|text| text.text == size).count();
    // Of each of three curves the ends; all of the method without errors.
    assert_eq!(
        ["128", "256", "512", "1024", "2048"].map(labelled),
        [4, 1, 1, 1, 4]
    );
    assert!(
        texts(error)
            .iter()
            .any(|text| text.text == speed_error::EXACT),
        "errors of zero have their own place"
    );
}

#[test]
fn scenarios_without_curves_share_plots_by_unit_and_figure_of_error() {
    let mut rows = meshes();
    rows.push(row("single arm", "aba", "f64", 7, 1e-6));
    rows.push(row("single arm", "aba", "f64", 14, 2e-6));
    rows.push(Row {
        error_forward: None,
        error_residual: Some(1e-9),
        ..row("loops four-bar", "step", "f64", 3, 1e-6)
    });
    let shared: Vec<_> = plots(&rows)
        .iter()
        .map(|plot| (plot.scenario().is_none(), plot.svg_path()))
        .collect();
    assert_eq!(
        shared,
        [
            (
                true,
                "plots/across-triangle-pairs-wrong-pairs.svg".to_owned()
            ),
            (true, "plots/across-bodies-forward-error.svg".to_owned()),
            (true, "plots/across-bodies-opening.svg".to_owned()),
        ]
    );
}

#[test]
fn a_line_of_a_scenario_has_its_time_and_its_error() {
    let mut rows = meshes();
    for row in &mut rows {
        row.method = match row.method.as_str() {
            "all pairs" => "exact-pairs".to_owned(),
            "bvh" => "moller0-pairs".to_owned(),
            _ => "moller-pairs".to_owned(),
        };
    }
    let [plot] = plots(&rows).try_into().unwrap();
    let shapes = || plot.figure.shapes.iter();
    let markers = shapes().filter(|shape| matches!(shape, Shape::Marker { .. }));
    let published = rows.iter().filter(|row| row.reference_time_s.is_some());
    assert_eq!(markers.count(), 2 * rows.len() + published.count());
    for text in [
        "cup x bowl",
        "39 795 000 triangle pairs",
        "moller-pairs f32",
    ] {
        assert!(
            texts(&plot).iter().any(|other| other.text == text),
            "{text}"
        );
    }
    // Of each scenario the fastest method, which is exact; `moller-pairs` is wrong as well as slower.
    let rings =
        shapes().filter(|shape| matches!(shape, Shape::Line { points, .. } if points.len() > 10));
    assert_eq!(rings.count(), 2 * 3);
}

#[test]
fn errors_that_do_not_tell_rows_apart_are_not_drawn() {
    let mut rows = chain();
    for row in &mut rows {
        row.error_forward = Some(0.0);
    }
    let paths: Vec<_> = plots(&rows).iter().map(Plot::svg_path).collect();
    assert_eq!(paths, ["plots/time-chain.svg"]);
    let mut rows = meshes();
    rows.retain(|row| row.wrong_pairs() == Some(0));
    let [plot] = plots(&rows).try_into().unwrap();
    let mentions = |word: &str| texts(&plot).iter().any(|text| text.text.contains(word));
    assert!(mentions("all are exactly 0: wrong pairs") && !mentions("false and missed"));
}

#[test]
fn many_ways_are_drawn_question_by_question_and_size_by_size() {
    let mut rows = Vec::new();
    for (method, threads) in (1..=9).map(|threads| ("dca", threads)).chain([("step", 1)]) {
        for size in [128, 256, 512] {
            let time = 1e-6 * size as f64 / threads as f64;
            rows.push(Row {
                threads,
                ..row("chain", method, "f64", size, time)
            });
        }
    }
    let paths: Vec<_> = plots(&rows).iter().map(Plot::svg_path).collect();
    assert_eq!(
        paths,
        [
            "plots/time-chain-forward-dynamics.svg",
            "plots/error-chain-forward-dynamics-128.svg",
            "plots/error-chain-forward-dynamics-256.svg",
            "plots/error-chain-forward-dynamics-512.svg",
            "plots/error-size-chain-forward-dynamics.svg",
            "plots/time-chain-a-whole-step.svg",
            "plots/error-chain-a-whole-step.svg",
            "plots/error-size-chain-a-whole-step.svg",
        ]
    );
}

#[test]
fn a_size_that_is_a_setting_is_no_work_and_has_one_front() {
    let rows =
        [(1, 3e-3, 1e-13), (8, 1e-3, 1e-12), (64, 2e-3, 1e-11)].map(|(size, time, error)| Row {
            size_unit: "joints a chunk".to_owned(),
            error_forward: Some(error),
            ..row("chunks", "dca", "f64", size, time)
        });
    let plots = plots(&rows);
    let plot = &plots[1];
    let labels: Vec<&str> = texts(plot).iter().map(|text| text.text.as_str()).collect();
    assert!(labels.contains(&"speed [calls per second]"), "{labels:?}");
    // The ends of the series, and between them the one that is ringed.
    assert!(
        ["1", "8", "64"].iter().all(|size| labels.contains(size)),
        "{labels:?}"
    );
    let is_ring = |shape: &&Shape| matches!(shape, Shape::Line { points, .. } if points.len() > 10);
    assert_eq!(plot.figure.shapes.iter().filter(is_ring).count(), 2);
}

#[test]
fn a_long_remark_is_wrapped() {
    let words = "one two three four five ".repeat(20);
    let lines = figure::wrap(&words, 13.0, 300.0);
    assert!(lines.len() > 5);
    assert!(
        lines
            .iter()
            .all(|line| text_width(line, 13.0, false) <= 300.0)
    );
    assert_eq!(lines.join(" "), words.trim_end());
}

#[test]
fn names_make_distinct_file_names() {
    let mut rows = Vec::new();
    for scenario in ["a b", "A-b", "../x", "µ"] {
        rows.extend([1, 2, 4].map(|size| row(scenario, "aba", "f64", size, 1e-6)));
    }
    let paths = plots(&rows).into_iter().map(|plot| plot.png_path());
    let names: Vec<_> = paths
        .filter(|path| path.starts_with("plots/time"))
        .collect();
    assert_eq!(
        names,
        [
            "plots/time-a-b.png",
            "plots/time-a-b-2.png",
            "plots/time-x.png",
            "plots/time-unnamed.png"
        ]
    );
}

#[test]
fn both_formats_show_the_picture() {
    for plot in [chain(), meshes()].iter().flat_map(|rows| plots(rows)) {
        let svg = plot.svg().unwrap();
        assert!(
            svg.starts_with("<svg width=\"1200\" height=") && svg.trim_end().ends_with("</svg>")
        );
        assert!(svg.contains("font-family=\"sans-serif\"") && svg.contains("#0072B2"));

        let file = plot.png().unwrap();
        let mut reader = png::Decoder::new(file.as_slice()).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!(
            (info.width, info.height),
            (plot.figure.width, plot.figure.height)
        );
        let colors: BTreeSet<&[u8]> = pixels.chunks_exact(3).collect();
        assert!(
            colors.len() > 100,
            "{} shows {} colours",
            plot.title(),
            colors.len()
        );
        assert!(
            colors.contains([0, 114, 178].as_slice())
                && colors.contains([255, 255, 255].as_slice())
        );
    }
}

#[test]
fn a_title_with_markup_stays_text() {
    let rows = [1, 2, 4].map(|size| row("<b> & \"c\"", "aba", "f64", size, 1e-6));
    let svg = plots(&rows)[0].svg().unwrap();
    assert!(svg.contains("&lt;b&gt; &amp; &quot;c&quot;: time against size"));
}
