//! `results.csv`: the fields of `results.json`, a line a row.

use serde::Serialize;
use serde_json::Value;

use crate::row::Row;

/// The columns, in the order of the fields of [`Row`].
pub const COLUMNS: [&str; 24] = [
    "scenario",
    "method",
    "precision",
    "backend",
    "device",
    "os",
    "threads",
    "size",
    "size_unit",
    "time_median_s",
    "time_min_s",
    "time_q1_s",
    "time_q3_s",
    "time_max_s",
    "samples",
    "error_forward",
    "error_residual",
    "false_pairs",
    "missed_pairs",
    "hits",
    "reference_time_s",
    "note",
    "version",
    "commit",
];

/// The rows as CSV (RFC 4180 with Unix line ends): a header, then a line a row; an absent figure is
/// an empty cell.
///
/// # Errors
/// When a row cannot be serialised, which no row made of text and numbers does.
pub fn to_csv(rows: &[Row]) -> Result<String, serde_json::Error> {
    lines(&COLUMNS, rows)
}

/// Flat records as CSV: these fields of each.
///
/// # Errors
/// When a record cannot be serialised.
pub(crate) fn lines<T: Serialize>(
    columns: &[&str],
    records: &[T],
) -> Result<String, serde_json::Error> {
    let mut text = columns.join(",");
    text.push('\n');
    for record in records {
        let fields = serde_json::to_value(record)?;
        let cells: Vec<String> = columns
            .iter()
            .map(|column| cell(&fields[*column]))
            .collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    Ok(text)
}

/// A field as a cell. Quoted when a separator, a quote or an outer space would be misread.
fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => {
            let plain = !text.contains([',', '"', '\n', '\r']) && text.trim() == text;
            if plain {
                text.clone()
            } else {
                format!("\"{}\"", text.replace('"', "\"\""))
            }
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    /// Cells of every line, by the grammar of RFC 4180: written against the standard, not against
    /// `cell`.
    fn parse(text: &str) -> Vec<Vec<String>> {
        let (mut lines, mut line, mut cell) = (Vec::new(), Vec::new(), String::new());
        let mut chars = text.chars().peekable();
        let mut quoted = false;
        while let Some(c) = chars.next() {
            match (quoted, c) {
                (true, '"') if chars.peek() == Some(&'"') => {
                    chars.next();
                    cell.push('"');
                }
                (_, '"') => quoted = !quoted,
                (false, ',') => line.push(std::mem::take(&mut cell)),
                (false, '\n') => {
                    line.push(std::mem::take(&mut cell));
                    lines.push(std::mem::take(&mut line));
                }
                (_, c) => cell.push(c),
            }
        }
        lines
    }

    #[test]
    fn columns_are_the_fields_in_their_order() {
        let json = serde_json::to_string(&row("chain", "aba", "f64", 128, 1e-3)).unwrap();
        let places: Vec<_> = COLUMNS
            .iter()
            .map(|column| json.find(&format!("\"{column}\":")))
            .collect();
        assert!(
            places.iter().all(Option::is_some) && places.is_sorted(),
            "{places:?}"
        );
        let fields: serde_json::Map<String, Value> = serde_json::from_str(&json).unwrap();
        assert_eq!(fields.len(), COLUMNS.len());
    }

    #[test]
    fn cells_survive_quotes_separators_and_line_breaks() {
        let note = "a \"quoted\", two-line\nnote, µs";
        let rows = [
            Row {
                note: note.to_owned(),
                commit: None,
                ..row("chain, heavy", "aba", "f64", 128, 0.1 + 0.2)
            },
            row(" spaced ", "aba", "f64", 256, 1e-9),
        ];
        let lines = parse(&to_csv(&rows).unwrap());
        assert_eq!(lines.len(), 3);
        assert!(
            lines.iter().all(|line| line.len() == COLUMNS.len()),
            "{lines:?}"
        );
        let field = |line: usize, name: &str| {
            let index = COLUMNS.iter().position(|column| *column == name).unwrap();
            lines[line][index].clone()
        };
        assert_eq!(field(1, "note"), note);
        assert_eq!(field(1, "scenario"), "chain, heavy");
        assert_eq!(field(2, "scenario"), " spaced ");
        assert_eq!(field(1, "false_pairs"), "");
        assert_eq!(field(1, "time_median_s").parse::<f64>().unwrap(), 0.1 + 0.2);
        assert_eq!(field(2, "time_median_s").parse::<f64>().unwrap(), 1e-9);
    }
}
