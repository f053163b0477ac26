//! From which size on a GPU is faster than the best that the processor has.

use crate::row::Row;
use crate::table::format::{count, seconds, times};

/// A whole step on the GPU: one of several in a submission, or alone.
const STEPS: [&str; 2] = ["step-16", "step"];

/// Forward dynamics on the processor, without integration and poses, so that it is not wronged.
const FORWARD: [&str; 2] = ["aba", "dca"];

/// Precision of the processor's rows.
const PRECISION: &str = "f64";

/// For each precision of the GPU's steps among the rows of one scenario, a sentence about where they
/// overtake the processor's fastest forward dynamics; none without rows of both.
pub(crate) fn crossovers(rows: &[&Row]) -> Vec<String> {
    let mut kinds: Vec<(&str, &str)> = Vec::new();
    for row in rows.iter().filter(|row| row.backend == "gpu") {
        let kind = (row.method.as_str(), row.precision.as_str());
        if STEPS.contains(&kind.0) && !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let has = |kinds: &[(&str, &str)], method, precision| kinds.contains(&(method, precision));
    let all = kinds.clone();
    kinds.retain(|&(method, precision)| method == STEPS[0] || !has(&all, STEPS[0], precision));
    let sentence = |(method, precision): (&str, &str)| {
        let of = |row: &&&Row| {
            row.backend == "gpu" && row.method == method && row.precision == precision
        };
        let mut pairs: Vec<(u64, f64, &Row)> = rows
            .iter()
            .filter(of)
            .filter_map(|row| Some((row.size, row.time_median_s, fastest(rows, row.size)?)))
            .collect();
        pairs.sort_by_key(|&(size, ..)| size);
        let &(size, gpu, cpu) = pairs.last()?;
        let from = where_faster(&pairs);
        Some(format!(
            "{method} {precision} on the GPU is faster than the fastest forward dynamics in {PRECISION} on the CPU \
             {from}; at {} it takes {} against {} ({} on {} thread{}), {}",
            count(size),
            seconds(gpu),
            seconds(cpu.time_median_s),
            cpu.method,
            cpu.threads,
            if cpu.threads == 1 { "" } else { "s" },
            times(cpu.time_median_s / gpu),
        ))
    };
    kinds.into_iter().filter_map(sentence).collect()
}

/// The processor's fastest row of a size.
fn fastest<'a>(rows: &[&'a Row], size: u64) -> Option<&'a Row> {
    let on_cpu = rows.iter().copied().filter(|row| {
        row.backend == "cpu"
            && row.size == size
            && row.precision == PRECISION
            && FORWARD.contains(&row.method.as_str())
    });
    on_cpu.min_by(|a, b| a.time_median_s.total_cmp(&b.time_median_s))
}

/// Where the ratio of the times passes 1 for good, by powers of the size between the sizes measured.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a size between two others, to two digits"
)]
fn where_faster(pairs: &[(u64, f64, &Row)]) -> String {
    let log_ratio = |&(_, gpu, cpu): &(u64, f64, &Row)| (gpu / cpu.time_median_s).ln();
    let Some(last_slower) = pairs.iter().rposition(|pair| log_ratio(pair) > 0.0) else {
        return match pairs.first() {
            Some(&(size, ..)) => format!("at every size from {} on", count(size)),
            None => String::new(),
        };
    };
    let below = &pairs[last_slower];
    let Some(above) = pairs.get(last_slower + 1) else {
        return format!("at no size up to {}", count(below.0));
    };
    let part = log_ratio(below) / (log_ratio(below) - log_ratio(above));
    let (from, to) = ((below.0 as f64).ln(), (above.0 as f64).ln());
    let size = (from + part * (to - from)).exp();
    let digits = 10_f64.powf((size.log10() - 1.0).floor());
    format!(
        "from about {} on",
        count(((size / digits).round() * digits) as u64)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    /// A step on a GPU takes 100 us whatever the size, the recursion 200 ns a body.
    fn rows(sizes: &[u64]) -> Vec<Row> {
        let mut rows = Vec::new();
        for &size in sizes {
            rows.push(row("chain", "aba", "f64", size, 200e-9 * size as f64));
            rows.push(row("chain", "dca", "f64", size, 900e-9 * size as f64));
            rows.push(row("chain", "aba", "f32", size, 1e-9));
            for method in ["step", "step-16", "dca"] {
                rows.push(Row {
                    backend: "gpu".to_owned(),
                    ..row("chain", method, "f64/f32", size, 100e-6)
                });
            }
        }
        rows
    }

    fn lines(rows: &[Row]) -> Vec<String> {
        crossovers(&rows.iter().collect::<Vec<_>>())
    }

    #[test]
    fn the_size_is_found_between_those_measured() {
        // 100 us are 500 bodies' worth; times are powers of the size, so interpolation is exact.
        let found = lines(&rows(&[128, 2048]));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("step-16 f64/f32 on the GPU"),
            "{found:?}"
        );
        assert!(found[0].contains("from about 500 on"), "{found:?}");
        assert!(
            found[0].contains("against 410 µs (aba on 1 thread)"),
            "{found:?}"
        );
    }

    #[test]
    fn extremes_are_told_as_such() {
        assert!(lines(&rows(&[32, 64]))[0].contains("at no size up to 64"));
        assert!(lines(&rows(&[1024, 2048]))[0].contains("at every size from 1024 on"));
        let only_gpu: Vec<Row> = rows(&[64])
            .into_iter()
            .filter(|row| row.backend == "gpu")
            .collect();
        assert!(lines(&only_gpu).is_empty() && lines(&[]).is_empty());
    }
}
