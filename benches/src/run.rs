//! `bench`: measures what was asked for, and writes it.

mod subjects;

use crate::cli::BenchArgs;
use crate::compare::{Verdict, compare, refuse_strangers, to_table as comparison_table};
use crate::frames::write_frames;
use crate::interrupt::Interrupt;
use crate::measure::Budget;
use crate::progress::Progress;
use crate::results::{RESULTS_JSON, check_writable, read_results, write_atomically, write_results};
use crate::row::Row;
use crate::scenario::{Measurement, Meter, gpu, meshes};
use crate::table::to_table;
use std::path::Path;
use subjects::Subjects;
use vertebra::collision::gpu::{MeshPair, Processor};
use vertebra::{PlyPart, Pose, write_ply};
use vertebra_gpu::Device;

/// How a command ended that ran through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// All is well.
    Success,
    /// Something was not measured or not written, failed a check, or got worse.
    Failure,
    /// Ctrl-C ended it; what there was until then is written.
    Interrupted,
}

impl Outcome {
    /// The outcome of a command that cannot be interrupted.
    #[must_use]
    pub fn of(success: bool) -> Self {
        if success {
            Self::Success
        } else {
            Self::Failure
        }
    }
}

/// Runs `bench`. A row that cannot be measured, or a further file that cannot be written, costs no
/// other: it is named at the end and makes the outcome a failure.
///
/// # Errors
/// If an input cannot be read, the results cannot be written, or nothing at all was measured: then
/// the first error there was.
pub fn bench(arguments: &BenchArgs) -> anyhow::Result<Outcome> {
    arguments.check()?;
    let has_meshes = arguments.wants(meshes::NAME) || arguments.mesh_a.is_some();
    anyhow::ensure!(
        arguments.hits.is_none() || has_meshes,
        "--hits: no meshes are measured; add the scenario `collision`, or --mesh-a and --mesh-b"
    );
    let old = match &arguments.compare {
        Some(path) => Some(read_results(path)?),
        None => None,
    };
    let subjects = Subjects::of(arguments)?;
    let outputs = [
        Some(arguments.folder().join(RESULTS_JSON)),
        arguments.hits.clone(),
        arguments.frames.clone(),
    ];
    outputs
        .iter()
        .flatten()
        .try_for_each(|path| check_writable(path))?;
    let meter = Meter {
        budget: if arguments.quick {
            Budget::quick()
        } else {
            Budget::default()
        },
        interrupt: Interrupt::on_ctrl_c()?,
    };

    let selection = arguments.selection();
    let available = rayon::current_num_threads();
    if selection.threads.iter().any(|&asked| asked > available) {
        println!("there are {available} threads: no row is measured with more");
    }
    let Measured { rows, failures } = measure_all(subjects.measurements(&selection), &meter);
    if rows.is_empty() {
        if let Some((label, error)) = failures.into_iter().next() {
            return Err(error.context(label));
        }
        if meter.interrupt.requested() {
            return Ok(Outcome::Interrupted);
        }
        anyhow::bail!(
            "nothing was measured: the methods and precisions asked for do not occur in these scenarios"
        );
    }
    let mut failures: Vec<String> = failures
        .iter()
        .map(|(label, error)| format!("not measured: {label}: {}", whole(error)))
        .collect();
    println!("{}", to_table(&rows));
    for path in write_results(arguments.folder(), &rows)? {
        println!("wrote {}", path.display());
    }
    if !meter.interrupt.requested() {
        failures.extend(write_further(arguments, &subjects, &meter.interrupt));
    }
    let mut worse = false;
    if let Some(old) = old {
        let verdicts = compare(&old, &rows);
        println!("{}", comparison_table(&verdicts));
        failures.extend(
            refuse_strangers(&verdicts)
                .err()
                .map(|error| error.to_string()),
        );
        worse = verdicts.iter().any(Verdict::is_regression);
    }
    for failure in &failures {
        eprintln!("{failure}");
    }
    if meter.interrupt.requested() {
        return Ok(Outcome::Interrupted);
    }
    let regression = arguments.fail_on_regression && worse;
    Ok(Outcome::of(failures.is_empty() && !regression))
}

/// An error and its causes, each said once: some messages have their cause in them already.
#[must_use]
pub fn whole(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// Writes the files of `--hits` and `--frames`; what went wrong, a line each.
fn write_further(arguments: &BenchArgs, subjects: &Subjects, interrupt: &Interrupt) -> Vec<String> {
    let mut failures = Vec::new();
    if let Some(path) = &arguments.hits {
        let device = subjects.device.as_ref().map(gpu::Subject::device);
        let meshes = subjects.meshes.last();
        let written = meshes.map(|subject| write_hits(path, subject, device));
        let failed = written.and_then(Result::err);
        failures.extend(failed.map(|error| format!("--hits: {}", whole(&error))));
    }
    if let Some(path) = &arguments.frames {
        let written = write_frames(path, subjects.models.first(), interrupt);
        failures.extend(
            written
                .err()
                .map(|error| format!("--frames: {}", whole(&error))),
        );
    }
    failures
}

/// What came of a list of measurements.
struct Measured {
    rows: Vec<Row>,
    /// Label and error of each measurement that gave no row.
    failures: Vec<(String, anyhow::Error)>,
}

/// Measures until all is done or Ctrl-C. A row that may not be written is a failure of its own
/// measurement, not of the run.
fn measure_all(list: Vec<Measurement<'_>>, meter: &Meter) -> Measured {
    let (mut rows, mut failures) = (Vec::new(), Vec::new());
    let mut progress = Progress::new(list.len());
    for measurement in list {
        if meter.interrupt.requested() {
            break;
        }
        let label = measurement.label.clone();
        progress.begin(&label);
        let row = measurement.run(meter).and_then(|row| {
            row.as_ref().map_or(Ok(()), Row::validate)?;
            Ok(row)
        });
        match row {
            Ok(Some(row)) => {
                progress.done(&format!("{label}: {:.3e} s", row.time_median_s));
                rows.push(row);
            }
            // Interrupted.
            Ok(None) => {}
            Err(error) => {
                progress.done(&format!("{label}: not measured"));
                failures.push((label, error));
            }
        }
    }
    progress.finish();
    Measured { rows, failures }
}

/// Colours as the source's figures have them: what collides red and green, the rest white and blue. Found on the GPU if
/// rows of it are measured.
fn write_hits(
    path: &Path,
    subject: &meshes::Subject,
    device: Option<&Device>,
) -> anyhow::Result<()> {
    let asked = device.map(|_| Processor::Gpu).or(Some(Processor::Cpu));
    let mut pair = MeshPair::new(device, subject.a.clone(), subject.b.clone(), asked)?;
    pair.set_pose_b(subject.pose_b)?;
    let (hit_a, hit_b) = pair.mask()?;
    let color_a = |i: usize| {
        if hit_a[i] {
            [214, 39, 40]
        } else {
            [235, 235, 235]
        }
    };
    let color_b = |i: usize| {
        if hit_b[i] {
            [44, 160, 44]
        } else {
            [120, 160, 215]
        }
    };
    let part = |mesh, pose, color| PlyPart { mesh, pose, color };
    let mut file = Vec::new();
    write_ply(
        &mut file,
        &[
            part(&subject.a, Pose::IDENTITY, &color_a),
            part(&subject.b, subject.pose_b, &color_b),
        ],
    )?;
    write_atomically(path, &file)?;
    let count = |hits: &[bool]| hits.iter().filter(|hit| **hit).count();
    println!(
        "wrote {}: {} and {} colliding triangles coloured, found on the {}",
        path.display(),
        count(&hit_a),
        count(&hit_b),
        pair.choice().processor
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    fn meter() -> Meter {
        Meter {
            budget: Budget::quick(),
            interrupt: Interrupt::default(),
        }
    }

    #[test]
    fn a_refusing_row_costs_no_other() {
        let good = |method: &str| row("chain", method, "f64", 128, 1e-3);
        let list = vec![
            Measurement::new("first", |_| Ok(Some(good("aba")))),
            Measurement::new("refusing", |_| Err(anyhow::anyhow!("a singular matrix"))),
            Measurement::new("not a number", |_| {
                Ok(Some(Row {
                    error_forward: Some(f64::NAN),
                    ..good("crba")
                }))
            }),
            Measurement::new("last", |_| Ok(Some(good("rnea")))),
        ];
        let Measured { rows, failures } = measure_all(list, &meter());
        let methods: Vec<&str> = rows.iter().map(|row| row.method.as_str()).collect();
        assert_eq!(methods, ["aba", "rnea"]);
        let labels: Vec<&str> = failures.iter().map(|(label, _)| label.as_str()).collect();
        assert_eq!(labels, ["refusing", "not a number"]);
        assert_eq!(failures[0].1.to_string(), "a singular matrix");
        assert!(failures[1].1.to_string().contains("error_forward"));
    }

    #[test]
    fn a_cause_is_said_once() {
        let inner = anyhow::anyhow!("no such file");
        let error = inner
            .context("a.json: no such file; correct the path")
            .context("reading");
        assert_eq!(
            whole(&error),
            "reading: a.json: no such file; correct the path"
        );
    }

    #[test]
    fn an_interrupt_ends_the_list() {
        let meter = meter();
        let list = vec![
            Measurement::new("first", |meter| {
                meter.interrupt.request();
                Ok(Some(row("chain", "aba", "f64", 128, 1e-3)))
            }),
            Measurement::new("second", |_| Err(anyhow::anyhow!("never run"))),
        ];
        let Measured { rows, failures } = measure_all(list, &meter);
        assert_eq!((rows.len(), failures.len()), (1, 0));
    }
}
