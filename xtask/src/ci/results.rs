//! What must hold for the `results.json` of any benchmark run.

use anyhow::{Context, Result, ensure};
use serde_json::Value;

/// A run with fewer rows has left scenarios out.
const FEWEST_ROWS: usize = 10;
/// Parts of the names of the methods that may report wrong pairs: the source's single-precision test
/// and the test of separating axes, kept as baselines.
const INEXACT: [&str; 2] = ["moller", "separating-axes"];

/// Checks the text of a `results.json` and counts its rows.
pub(super) fn check(text: &str) -> Result<usize> {
    let results: Value = serde_json::from_str(text).context("results.json is not JSON")?;
    let rows = results.as_array().context("results.json is not an array")?;
    ensure!(
        rows.len() >= FEWEST_ROWS,
        "results.json has {} rows, fewer than {FEWEST_ROWS}",
        rows.len()
    );
    for (index, row) in rows.iter().enumerate() {
        check_row(row).with_context(|| {
            format!(
                "row {} of results.json: {} / {} at size {}",
                index + 1,
                row["scenario"],
                row["method"],
                row["size"]
            )
        })?;
    }
    let any = |present: fn(&Value) -> bool| rows.iter().any(present);
    ensure!(
        any(|row| row["error_forward"].is_number()),
        "no row has an `error_forward`: no dynamics were measured"
    );
    ensure!(
        any(counts_pairs),
        "no row has `false_pairs` and `missed_pairs`: no collisions were measured"
    );
    Ok(rows.len())
}

fn check_row(row: &Value) -> Result<()> {
    for field in ["scenario", "method", "device"] {
        ensure!(
            row[field].as_str().is_some_and(|text| !text.is_empty()),
            "`{field}` is empty"
        );
    }
    let time = |field: &str| {
        let value = row[field]
            .as_f64()
            .with_context(|| format!("`{field}` is not a number"))?;
        ensure!(value > 0.0 && value.is_finite(), "`{field}` is {value}");
        Ok(value)
    };
    let times = [
        time("time_min_s")?,
        time("time_q1_s")?,
        time("time_median_s")?,
        time("time_q3_s")?,
        time("time_max_s")?,
    ];
    ensure!(times.is_sorted(), "the times {times:?} are not in order");
    ensure!(
        row["error_forward"].is_number() || row["error_residual"].is_number() || counts_pairs(row),
        "there is no error figure"
    );
    let exact = !row["method"]
        .as_str()
        .map(str::to_lowercase)
        .is_some_and(|method| INEXACT.iter().any(|name| method.contains(name)));
    for field in ["false_pairs", "missed_pairs"] {
        let right = row[field].is_null() || row[field] == 0;
        ensure!(
            right || !exact,
            "an exact method has `{field}` = {}",
            row[field]
        );
    }
    Ok(())
}

fn counts_pairs(row: &Value) -> bool {
    row["false_pairs"].is_u64() && row["missed_pairs"].is_u64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Results that are in order.
    fn good() -> Vec<Value> {
        let dynamics = json!({
            "scenario": "chain", "method": "aba", "device": "cpu", "size": 128, "time_min_s": 1e-6,
            "time_q1_s": 1.5e-6, "time_median_s": 2e-6, "time_q3_s": 2.5e-6, "time_max_s": 3e-6, "error_forward": 1e-14, "error_residual": null,
            "false_pairs": null, "missed_pairs": null,
        });
        let mut collision = dynamics.clone();
        collision["method"] = json!("exact");
        collision["error_forward"] = Value::Null;
        collision["false_pairs"] = json!(0);
        collision["missed_pairs"] = json!(0);
        let mut baseline = collision.clone();
        baseline["method"] = json!("Moller 1997");
        baseline["false_pairs"] = json!(1039);
        let mut rows = vec![dynamics; FEWEST_ROWS - 2];
        rows.extend([collision, baseline]);
        rows
    }

    fn judge(rows: &[Value]) -> Result<usize> {
        check(&json!(rows).to_string())
    }

    #[test]
    fn results_in_order_pass() {
        assert_eq!(judge(&good()).unwrap(), FEWEST_ROWS);
    }

    #[test]
    fn each_planted_error_is_found() {
        let plant = |index: usize, field: &str, value: Value| {
            let mut rows = good();
            rows[index][field] = value;
            format!("{:#}", judge(&rows).unwrap_err())
        };
        let (exact, last) = (FEWEST_ROWS - 2, FEWEST_ROWS - 1);
        assert!(plant(3, "error_forward", Value::Null).contains("row 4"));
        assert!(plant(0, "time_median_s", json!(0.0)).contains("time_median_s"));
        assert!(plant(0, "time_median_s", Value::Null).contains("not a number"));
        assert!(plant(0, "time_max_s", json!(1e-6)).contains("order"));
        assert!(plant(0, "time_q3_s", json!(1.9e-6)).contains("order"));
        assert!(plant(0, "time_q1_s", Value::Null).contains("not a number"));
        assert!(plant(0, "method", json!("")).contains("method"));
        assert!(plant(exact, "false_pairs", json!(1)).contains("exact method"));
        assert!(plant(exact, "missed_pairs", json!(1)).contains("exact method"));
        assert!(plant(last, "missed_pairs", Value::Null).contains("no error figure"));
        assert!(judge(&good()[1..]).is_err());
        assert!(
            judge(&vec![good()[0].clone(); FEWEST_ROWS])
                .unwrap_err()
                .to_string()
                .contains("no collisions")
        );
        assert!(
            judge(&vec![good()[exact].clone(); FEWEST_ROWS])
                .unwrap_err()
                .to_string()
                .contains("no dynamics")
        );
        assert!(check("{").is_err() && check("{}").is_err());
    }
}
