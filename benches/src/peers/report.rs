//! What a comparison shows: on the terminal, as a page, and as files for programs.

use super::Judged;
use super::rounds::Plan;
use crate::csv::to_csv;
use crate::report::notes;
use crate::row::Row;
use crate::table::format::{count, error_figure, seconds, times};
use crate::table::{Grid, by_scenario, escape_markdown, machines, to_table};
use std::fs;

/// One run.
pub(crate) struct Report<'a> {
    /// What was compared.
    pub(crate) what: &'a str,
    /// How it was measured.
    pub(crate) plan: Plan,
    /// The measurements, problem by problem.
    pub(crate) measured: &'a [Judged],
    /// What could not be measured, a line each.
    pub(crate) missing: &'a [String],
    /// Load of the machine before and after.
    pub(crate) loads: [Option<String>; 2],
}

/// Processes that wanted to run, on average over the last minute; none where the system does not
/// tell.
pub(crate) fn load() -> Option<String> {
    let text = fs::read_to_string("/proc/loadavg").ok()?;
    text.split(' ').next().map(str::to_owned)
}

impl Report<'_> {
    fn rows(&self) -> Vec<Row> {
        self.measured.iter().map(|m| m.row.clone()).collect()
    }

    /// The run for a terminal.
    pub(crate) fn terminal(&self) -> String {
        let mut text = to_table(&self.rows());
        text.push_str("\nours against the fastest peer without a wrong answer\n");
        text.push_str(&self.verdicts().terminal());
        text.push('\n');
        text.push_str(&self.missing.join("\n"));
        text
    }

    /// Endings and texts of the files.
    pub(crate) fn files(&self) -> anyhow::Result<[(&'static str, String); 3]> {
        let rows = self.rows();
        Ok([
            ("json", serde_json::to_string_pretty(&rows)? + "\n"),
            ("csv", to_csv(&rows)?),
            ("md", self.markdown()),
        ])
    }

    fn markdown(&self) -> String {
        let rows = self.rows();
        let mut text = format!("# Peers: {}\n\n", self.what);
        for machine in machines(&rows) {
            text.push_str(&format!("- {}\n", escape_markdown(&machine)));
        }
        let cores = std::thread::available_parallelism().map_or(0, usize::from);
        if let [Some(before), Some(after)] = &self.loads {
            text.push_str(&format!(
                "- {cores} cores; load {before} before and {after} after the run, of which the run itself is 1\n"
            ));
        }
        text.push_str(&format!(
            "- one thread; {} rounds in which every method has a turn of {} s; median over all calls\n",
            self.plan.rounds, self.plan.turn
        ));
        text.push_str("\n`docs/peers.md` says how it is made and how to read it.\n\n");
        text.push_str("## Ours against the fastest peer without a wrong answer\n\n");
        text.push_str(&self.verdicts().markdown());
        text.push('\n');
        for (scenario, rows) in by_scenario(&rows) {
            let unit = rows.first().map_or("", |row| row.size_unit.as_str());
            text.push_str(&format!(
                "## {}\n\nSize in {unit}.\n\n",
                escape_markdown(scenario)
            ));
            text.push_str(&Grid::of_rows(&rows).markdown());
            text.push_str(&format!("\n- {}\n\n", notes(&rows).join("\n- ")));
        }
        if !self.missing.is_empty() {
            let lines: Vec<String> = self.missing.iter().map(|l| escape_markdown(l)).collect();
            text.push_str(&format!("## Not measured\n\n- {}\n", lines.join("\n- ")));
        }
        text
    }

    /// Each of our methods beside the fastest peer of its stage whose answer has no wrong pair.
    fn verdicts(&self) -> Grid {
        let headings = vec![
            ("scenario", false),
            ("size", true),
            ("stage", false),
            ("ours", false),
            ("prec", false),
            ("median", true),
            ("error", true),
            ("fastest peer", false),
            ("median", true),
            ("error", true),
            ("ours/peer", true),
            ("fastest calls", true),
        ];
        let lines = self.measured.iter().filter(|m| m.own).map(|own| {
            let mut line = vec![
                own.row.scenario.clone(),
                count(own.row.size),
                own.stage.clone(),
                own.row.method.clone(),
                own.row.precision.replace('-', ""),
                seconds(own.row.time_median_s),
                error(&own.row),
            ];
            match self.fastest_peer(own) {
                Some(peer) => line.extend([
                    peer.method.clone(),
                    seconds(peer.time_median_s),
                    error(peer),
                    times(own.row.time_median_s / peer.time_median_s),
                    times(own.row.time_min_s / peer.time_min_s),
                ]),
                None => line.extend(["-"; 5].map(str::to_owned)),
            }
            line
        });
        Grid::new(headings, lines.collect())
    }

    fn fastest_peer(&self, own: &Judged) -> Option<&Row> {
        let rivals = self.measured.iter().filter(|m| {
            !m.own
                && m.stage == own.stage
                && m.row.scenario == own.row.scenario
                && m.row.size == own.row.size
                && m.row.wrong_pairs().unwrap_or(0) == 0
        });
        rivals
            .map(|m| &m.row)
            .min_by(|a, b| a.time_median_s.total_cmp(&b.time_median_s))
    }
}

/// The error figure of a row: wrong pairs, or the forward error.
fn error(row: &Row) -> String {
    match (row.wrong_pairs(), row.error_forward) {
        (Some(pairs), _) => count(pairs),
        (None, Some(forward)) => error_figure(forward),
        (None, None) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    fn judged(method: &str, stage: &str, median_s: f64, wrong: u64, own: bool) -> Judged {
        Judged {
            row: Row {
                error_forward: None,
                false_pairs: Some(wrong),
                missed_pairs: Some(0),
                note: "p 1; how".to_owned(),
                ..row("cup x spoon", method, "-", 100, median_s)
            },
            stage: stage.to_owned(),
            own,
        }
    }

    #[test]
    fn ours_is_held_against_the_fastest_peer_that_is_right_at_the_same_stage() {
        let measured = [
            judged("exact-pairs", "total", 1e-3, 0, true),
            judged("fast-and-wrong", "total", 0.1e-3, 3, false),
            judged("slow", "total", 9e-3, 0, false),
            judged("right", "total", 4e-3, 0, false),
            judged("prepared", "query", 0.2e-3, 0, false),
        ];
        let missing = ["libigl: not run: no *internet*".to_owned()];
        let report = Report {
            what: "collision",
            plan: Plan::new(true),
            measured: &measured,
            missing: &missing,
            loads: [Some("0.1".to_owned()), Some("1.0".to_owned())],
        };
        assert_eq!(
            report.fastest_peer(&measured[0]).map(|row| &*row.method),
            Some("right")
        );
        let text = report.terminal();
        assert!(
            text.contains("0.25x") && text.contains("no *internet*"),
            "{text}"
        );
        let [(_, json), (_, csv), (_, page)] = report.files().unwrap();
        assert!(
            page.contains("| right |") && page.contains("no \\*internet\\*"),
            "{page}"
        );
        assert_eq!(csv.lines().count(), 1 + measured.len());
        let back: Vec<Row> = serde_json::from_str(&json).unwrap();
        assert_eq!(back.len(), measured.len());
    }
}
