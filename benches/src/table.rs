//! Rows as tables for people: on a terminal and in Markdown, from one list of columns.

pub(crate) mod format;

use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, LineStyle, Table};

use crate::crossover::crossovers;
use crate::row::Row;
use format::{count, error_figure, rate, seconds, spread, times};

/// One column: its heading, how it is aligned, and its cell of a row; a column of empty cells is
/// left out.
struct Column {
    heading: &'static str,
    right: bool,
    cell: fn(&Row) -> String,
}

/// The columns of a scenario's table.
const COLUMNS: [Column; 14] = [
    Column {
        heading: "method",
        right: false,
        cell: |row| row.method.clone(),
    },
    Column {
        heading: "prec",
        right: false,
        cell: |row| row.precision.replace('-', ""),
    },
    Column {
        heading: "on",
        right: false,
        cell: |row| row.backend.clone(),
    },
    Column {
        heading: "thr",
        right: true,
        cell: |row| row.threads.to_string(),
    },
    Column {
        heading: "size",
        right: true,
        cell: |row| count(row.size),
    },
    Column {
        heading: "median",
        right: true,
        cell: |row| seconds(row.time_median_s),
    },
    Column {
        heading: "q1..q3",
        right: true,
        cell: |row| spread(row.middle_half_s(), row.time_median_s),
    },
    Column {
        heading: "pairs/s",
        right: true,
        cell: |row| {
            if row.size_unit.ends_with("pairs") {
                rate(row.size as f64 / row.time_median_s)
            } else {
                String::new()
            }
        },
    },
    Column {
        heading: "hits",
        right: true,
        cell: |row| row.hits.map(count).unwrap_or_default(),
    },
    Column {
        heading: "forward",
        right: true,
        cell: |row| row.error_forward.map(error_figure).unwrap_or_default(),
    },
    Column {
        heading: "residual",
        right: true,
        cell: |row| row.error_residual.map(error_figure).unwrap_or_default(),
    },
    Column {
        heading: "false/missed",
        right: true,
        cell: false_and_missed,
    },
    Column {
        heading: "published",
        right: true,
        cell: |row| row.reference_time_s.map(seconds).unwrap_or_default(),
    },
    Column {
        heading: "ratio",
        right: true,
        cell: |row| {
            row.reference_time_s
                .map(|published| times(published / row.time_median_s))
                .unwrap_or_default()
        },
    },
];

/// `false/missed`, with a dash for the one that was not counted.
fn false_and_missed(row: &Row) -> String {
    if row.false_pairs.is_none() && row.missed_pairs.is_none() {
        return String::new();
    }
    let text = |pairs: Option<u64>| pairs.map_or("-".to_owned(), count);
    format!("{}/{}", text(row.false_pairs), text(row.missed_pairs))
}

/// A table of texts, not yet laid out.
pub(crate) struct Grid {
    /// Heading of each column and whether it is aligned to the right.
    headings: Vec<(&'static str, bool)>,
    lines: Vec<Vec<String>>,
}

impl Grid {
    /// A table of these columns; every line has a cell for each.
    pub(crate) fn new(headings: Vec<(&'static str, bool)>, lines: Vec<Vec<String>>) -> Self {
        Self { headings, lines }
    }

    /// The table of the rows of one scenario, without the columns that would be empty.
    pub(crate) fn of_rows(rows: &[&Row]) -> Self {
        let columns: Vec<&Column> = COLUMNS
            .iter()
            .filter(|column| rows.iter().any(|row| !(column.cell)(row).is_empty()))
            .collect();
        let cell = |column: &Column, row| {
            let text = (column.cell)(row);
            if text.is_empty() {
                "-".to_owned()
            } else {
                text
            }
        };
        let lines = rows
            .iter()
            .map(|row| columns.iter().map(|column| cell(column, row)).collect())
            .collect();
        Self::new(
            columns
                .iter()
                .map(|column| (column.heading, column.right))
                .collect(),
            lines,
        )
    }

    /// The table for a terminal; never wrapped, as wide as its contents.
    pub(crate) fn terminal(&self) -> String {
        let style = NOTHING.header_separator(LineStyle::none().fill('─').junction('─'));
        let mut table = Table::new();
        table
            .load_style(style)
            .set_header(self.headings.iter().map(|(heading, _)| *heading));
        table.add_rows(&self.lines);
        for (column, (_, right)) in table.column_iter_mut().zip(&self.headings) {
            column.set_padding((0, 1));
            if *right {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        table.trim_fmt()
    }

    /// The table in Markdown.
    pub(crate) fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut text = line(
            self.headings
                .iter()
                .map(|(heading, _)| (*heading).to_owned())
                .collect(),
        );
        text.push_str(&line(
            self.headings
                .iter()
                .map(|(_, right)| if *right { "---:" } else { ":---" }.to_owned())
                .collect(),
        ));
        for cells in &self.lines {
            text.push_str(&line(
                cells.iter().map(|cell| escape_markdown(cell)).collect(),
            ));
        }
        text
    }
}

/// Text as it stands, also where it holds characters that Markdown would read as markup or as the
/// end of a cell.
pub(crate) fn escape_markdown(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '|' | '*' | '_' | '`' | '<' | '[' | ']' | '\\' => escaped.extend(['\\', c]),
            '\n' | '\r' => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}

/// The rows of each scenario, scenarios and rows in order of first appearance.
pub(crate) fn by_scenario(rows: &[Row]) -> Vec<(&str, Vec<&Row>)> {
    let mut groups: Vec<(&str, Vec<&Row>)> = Vec::new();
    for row in rows {
        match groups
            .iter_mut()
            .find(|(scenario, _)| *scenario == row.scenario)
        {
            Some((_, group)) => group.push(row),
            None => groups.push((&row.scenario, vec![row])),
        }
    }
    groups
}

/// The distinct machines of the rows, a line each.
pub(crate) fn machines(rows: &[Row]) -> Vec<String> {
    let mut lines = Vec::new();
    for row in rows {
        let commit = row.commit.as_deref().unwrap_or("commit unknown");
        let line = format!(
            "{}, {}, vertebra {} ({commit})",
            row.device, row.os, row.version
        );
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines
}

/// The rows as tables for a terminal, one a scenario, under the machine they were measured on.
#[must_use]
pub fn to_table(rows: &[Row]) -> String {
    let mut text = machines(rows).join("\n");
    text.push('\n');
    for (scenario, rows) in by_scenario(rows) {
        let unit = rows.first().map_or("", |row| row.size_unit.as_str());
        text.push_str(&format!(
            "\n{scenario} (size in {unit})\n{}\n",
            Grid::of_rows(&rows).terminal()
        ));
        for line in crossovers(&rows) {
            text.push_str(&format!("{line}\n"));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    fn chain() -> Vec<Row> {
        let mut rows = Vec::new();
        for size in [128, 2048, 65_536] {
            for (method, precision) in [("divide-conquer", "f32"), ("articulated", "f64")] {
                rows.push(Row {
                    reference_time_s: Some(57.94e-3),
                    error_residual: Some(1e-9),
                    threads: 16,
                    ..row("chain", method, precision, size, 123.4e-9 * size as f64)
                });
            }
        }
        rows
    }

    #[test]
    fn a_full_dynamics_table_fits_in_100_columns() {
        let text = to_table(&chain());
        assert!(
            text.contains("15.8 µs") && text.contains("65 536") && text.contains("1.0e-13"),
            "{text}"
        );
        assert!(
            text.lines().all(|line| line.chars().count() <= 100),
            "{text}"
        );
        assert!(
            !text.contains("false/missed"),
            "an empty column is left out:\n{text}"
        );
        assert_eq!(text.matches("divide-conquer").count(), 3, "{text}");
    }

    #[test]
    fn scenarios_and_machines_are_told_apart() {
        let mut rows = chain();
        rows.push(Row {
            error_forward: None,
            false_pairs: Some(1039),
            missed_pairs: Some(0),
            device: "Other CPU".to_owned(),
            ..row("cup x bowl", "bvh", "-", 39_795_000, 5e-3)
        });
        rows[0].commit = Some("1a2b3c4d5e6f of 2026-01-31".to_owned());
        let text = to_table(&rows);
        assert!(
            text.contains("Test CPU") && text.contains("Other CPU"),
            "{text}"
        );
        assert!(text.contains("(1a2b3c4d5e6f of 2026-01-31)"), "{text}");
        assert!(
            text.contains("\ncup x bowl (size in") && text.contains("1039/0"),
            "{text}"
        );
    }

    #[test]
    fn markdown_cells_cannot_break_the_table() {
        let rows = [row("chain", "a|b *c*", "f64", 128, 1e-3)];
        let text = Grid::of_rows(&[&rows[0]]).markdown();
        assert!(text.contains("| a\\|b \\*c\\* |"), "{text}");
        let pipes = |line: &str| line.replace("\\|", "").matches('|').count();
        assert!(
            text.lines()
                .all(|line| pipes(line) == pipes(text.lines().next().unwrap())),
            "{text}"
        );
    }
}
