//! `report.md`: the run as a page, each scenario's table beside the source's published times, and
//! the plots.

use crate::crossover::crossovers;
use crate::plot::Plot;
use crate::row::Row;
use crate::table::{Grid, by_scenario, escape_markdown, machines};

/// Where published times come from.
const SOURCE: &str = "Y. Lee, *Parallel collision detection and dynamics simulation using CUDA*, master's thesis, Ewha \
                      Womans University, 2009 (GeForce 8800 GTX, Core2 Duo E6550)";

/// How to read the tables.
const LEGEND: &str = "\
## How to read the tables

- **median**: time of one call over the samples, after a warm-up call. Calls shorter than 20 µs are timed in groups.
- **q1..q3**: first to third quartile of the samples, between which the middle half of them lies; the fastest to the \
slowest sample where a run recorded no quartiles.
- **prec**: floating-point type of the computation; **on**: kind of device; **thr**: threads.
- **pairs/s**: pairs of triangles answered for in a second, tested or culled.
- **forward**: largest difference from the reference result over the largest reference value.
- **residual**: largest amount by which the result fails an equation it should satisfy, over the terms of that equation; \
the equations of one body share the largest of their sums. Of scenarios *loops ..*: what the worst loop is open by after 2000 \
steps, over its size.
- **false/missed**: pairs reported that do not intersect in exact arithmetic, and pairs that do and were not \
reported. Of candidate pairs (scenarios *error: ..*) integer arithmetic tells, by separating axes. Else the reference is a list made apart from the queries measured: both meshes' triangles, posed in f64, are swept \
along one axis, and those whose f64 extents overlap go through the exact test of two triangles. So it shares that test \
with the exact methods, but none of their culling and none of their threads; the test suite holds the test itself against \
an oracle in rational arithmetic and against lists made with CGAL. Scenarios *queries: ..* have judges of their own, which \
their notes name; there a hit or an error may be a segment or a point.
- **published**, **ratio**: time published by the source for the same size on its own hardware, and how many times faster \
this run was. The ratio compares two machines more than ten years apart as much as two programs.
";

/// The report of `rows` as Markdown, with links to `plots` relative to the folder of the run.
pub(crate) fn to_markdown(rows: &[Row], plots: &[Plot]) -> String {
    let mut text = String::from("# Benchmark results\n\n");
    for machine in machines(rows) {
        text.push_str(&format!("- {}\n", escape_markdown(&machine)));
    }
    text.push_str("\nEvery row gives the error of the result beside the time it took.\n");
    if rows.iter().any(|row| row.reference_time_s.is_some()) {
        text.push_str(&format!("Published times are from {SOURCE}.\n"));
    }
    text.push('\n');
    let embed = |plot: &Plot| {
        format!(
            "![{}]({})\n\n",
            escape_markdown(plot.title()),
            plot.svg_path()
        )
    };
    for (scenario, rows) in by_scenario(rows) {
        let unit = rows.first().map_or("", |row| row.size_unit.as_str());
        text.push_str(&format!(
            "## {}\n\nSize in {unit}.\n\n",
            escape_markdown(scenario)
        ));
        text.push_str(&Grid::of_rows(&rows).markdown());
        text.push('\n');
        for line in crossovers(&rows) {
            text.push_str(&format!("{}.\n\n", escape_markdown(&line)));
        }
        let notes = notes(&rows);
        if !notes.is_empty() {
            text.push_str(&format!("- {}\n\n", notes.join("\n- ")));
        }
        text.extend(
            plots
                .iter()
                .filter(|plot| plot.scenario() == Some(scenario))
                .map(embed),
        );
    }
    if plots.iter().any(|plot| plot.scenario().is_none()) {
        text.push_str("## Across scenarios\n\n");
        text.extend(
            plots
                .iter()
                .filter(|plot| plot.scenario().is_none())
                .map(embed),
        );
    }
    text.push_str(LEGEND);
    text
}

/// The distinct notes of the rows, each with the methods it is about.
pub(crate) fn notes(rows: &[&Row]) -> Vec<String> {
    let mut notes: Vec<(&str, Vec<&str>)> = Vec::new();
    for row in rows.iter().filter(|row| !row.note.is_empty()) {
        match notes.iter_mut().find(|(note, _)| *note == row.note) {
            Some((_, methods)) if methods.contains(&row.method.as_str()) => {}
            Some((_, methods)) => methods.push(&row.method),
            None => notes.push((&row.note, vec![&row.method])),
        }
    }
    let line = |(note, methods): (&str, Vec<&str>)| format!("{}: {}", methods.join(", "), note);
    notes
        .into_iter()
        .map(line)
        .map(|line| escape_markdown(&line))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::plots;
    use crate::row::tests::row;

    #[test]
    fn each_scenario_has_its_table_its_notes_and_its_plots() {
        let mut rows: Vec<Row> = [128, 256, 512]
            .into_iter()
            .map(|size| Row {
                reference_time_s: Some(34.74e-3),
                note: "mean of 10 runs".to_owned(),
                ..row("chain", "aba", "f64", size, 1e-4)
            })
            .collect();
        rows.push(row("star", "aba", "f64", 64, 1e-5));
        let text = to_markdown(&rows, &plots(&rows));
        let place = |part: &str| {
            text.find(part)
                .unwrap_or_else(|| panic!("{part} is not in\n{text}"))
        };
        assert!(place("## chain") < place("| aba | f64 | cpu | 1 | 128 |"));
        assert_eq!(text.matches("aba: mean of 10 runs").count(), 1);
        assert!(place("](plots/time-chain.svg)") < place("## star"));
        assert!(place("34.7 ms") < place("347x") && text.contains("thesis"));
        assert!(place("## star") < place("## Across scenarios"));
        assert!(place("## How to read") > place("](plots/across-bodies-forward-error.svg)"));
        assert!(!to_markdown(&rows[3..], &[]).contains("thesis"));
    }
}
