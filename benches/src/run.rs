//! `bench`: measures what was asked for, and writes it.

use crate::cli::BenchArgs;
use crate::compare::{Verdict, compare, to_table as comparison_table};
use crate::frames::write_frames;
use crate::interrupt::Interrupt;
use crate::measure::Budget;
use crate::progress::Progress;
use crate::results::{RESULTS_JSON, check_writable, read_results, write_atomically, write_results};
use crate::row::Row;
use crate::scenario::{
    Measurement, Meter, Selection, batch, batch_gpu, chain, chunks, error_table, gpu, joints,
    joints_gpu, loops, meshes, model, needs, queries, scaling,
};
use crate::table::to_table;
use anyhow::Context;
use std::path::Path;
use vertebra::assembly::urdf;
use vertebra::collision::gpu::{MeshPair, Processor};
use vertebra::{PlyPart, Pose, TriangleMesh, write_ply};
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
        .map(|(label, error)| format!("not measured: {label}: {error:#}"))
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

/// Writes the files of `--hits` and `--frames`; what went wrong, a line each.
fn write_further(arguments: &BenchArgs, subjects: &Subjects, interrupt: &Interrupt) -> Vec<String> {
    let mut failures = Vec::new();
    if let Some(path) = &arguments.hits {
        let written = subjects
            .meshes
            .last()
            .context("no meshes are measured: add `collision`, or --mesh-a and --mesh-b")
            .and_then(|subject| {
                let device = subjects.device.as_ref().map(gpu::Subject::device);
                write_hits(path, subject, device)
            });
        failures.extend(written.err().map(|error| format!("--hits: {error:#}")));
    }
    if let Some(path) = &arguments.frames {
        let written = write_frames(path, subjects.models.first(), interrupt);
        failures.extend(written.err().map(|error| format!("--frames: {error:#}")));
    }
    failures
}

/// Everything that is measured.
struct Subjects {
    models: Vec<model::Subject>,
    needs: Vec<model::Subject>,
    lengths: Option<chunks::Subject>,
    joints: Option<joints::Subject>,
    batches: Vec<batch::Subject>,
    loops: Vec<loops::Subject>,
    gpu_batches: Option<batch_gpu::Subject>,
    meshes: Vec<meshes::Subject>,
    queries: Option<queries::Subject>,
    error_lists: Vec<error_table::Subject>,
    spheres: Vec<scaling::Subject>,
    gpu: Option<gpu::Subject>,
    /// Whether rows of the CPU are wanted.
    on_cpu: bool,
    /// The GPU on which models are measured too.
    device: Option<gpu::Subject>,
}

impl Subjects {
    /// What is asked for.
    fn of(arguments: &BenchArgs) -> anyhow::Result<Self> {
        let selection = arguments.selection();
        Ok(Self {
            models: models(arguments)?,
            needs: if arguments.wants(needs::NAME) && arguments.wants_backend("cpu") {
                needs::subjects(&selection)?
            } else {
                Vec::new()
            },
            lengths: if arguments.wants(chunks::NAME) {
                Some(chunks::Subject::new(arguments.seed)?)
            } else {
                None
            },
            joints: if arguments.wants(joints::NAME) {
                Some(joints::Subject::new(arguments.seed)?)
            } else {
                None
            },
            batches: if arguments.wants(batch::NAME) && arguments.wants_backend("cpu") {
                batch::subjects(&selection)?
            } else {
                Vec::new()
            },
            loops: if arguments.wants(loops::NAME) {
                loops::subjects(&selection)?
            } else {
                Vec::new()
            },
            gpu_batches: if arguments.wants(batch::NAME) && arguments.wants_backend("gpu") {
                batch_gpu::Subject::find(!arguments.backend.is_empty(), &selection)?
            } else {
                None
            },
            meshes: mesh_pairs(arguments)?,
            queries: if arguments.wants(queries::NAME) {
                Some(queries::Subject::new(&selection)?)
            } else {
                None
            },
            error_lists: if arguments.wants(error_table::NAME) {
                error_table::subjects(&selection)?
            } else {
                Vec::new()
            },
            spheres: if arguments.wants(scaling::NAME) {
                scaling::subjects(&selection)
            } else {
                Vec::new()
            },
            gpu: if arguments.wants(gpu::NAME) {
                gpu::Subject::find(arguments.scenarios.iter().any(|name| name == gpu::NAME))?
            } else {
                None
            },
            on_cpu: arguments.wants_backend("cpu"),
            device: if arguments.wants_backend("gpu") {
                gpu::Subject::find(!arguments.backend.is_empty())?
            } else {
                None
            },
        })
    }

    fn measurements(&self, selection: &Selection) -> Vec<Measurement<'_>> {
        let mut list = Vec::new();
        for subject in &self.models {
            if self.on_cpu {
                list.extend(subject.measurements(selection));
            }
            if let Some(gpu) = &self.device {
                list.extend(gpu::chains::measurements(subject, gpu.device(), selection));
            }
        }
        list.extend(needs::measurements(&self.needs, selection));
        if let Some(subject) = &self.lengths {
            list.extend(subject.measurements(selection));
        }
        if let Some(subject) = &self.joints {
            if self.on_cpu {
                list.extend(subject.measurements(selection));
            }
            if let Some(gpu) = &self.device {
                list.extend(joints_gpu::measurements(subject, gpu.device(), selection));
            }
        }
        for subject in &self.batches {
            list.extend(subject.measurements(selection));
        }
        for subject in &self.loops {
            if self.on_cpu {
                list.extend(subject.measurements(selection));
            }
            if let Some(gpu) = &self.device {
                list.extend(gpu::loops::measurements(subject, gpu.device(), selection));
            }
        }
        if let Some(subject) = &self.gpu_batches {
            list.extend(subject.measurements(selection));
        }
        for subject in &self.meshes {
            list.extend(subject.measurements(selection));
        }
        if let Some(subject) = &self.queries {
            list.extend(subject.measurements(selection));
        }
        for subject in &self.error_lists {
            list.extend(subject.measurements(selection));
        }
        for subject in &self.spheres {
            list.extend(subject.measurements(selection));
        }
        if let Some(subject) = &self.gpu {
            list.extend(subject.measurements(selection));
        }
        list
    }
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

fn models(arguments: &BenchArgs) -> anyhow::Result<Vec<model::Subject>> {
    let mut subjects = Vec::new();
    if let Some(path) = &arguments.model {
        let mut options = urdf::Options::default();
        options.floating_base = arguments.floating_base;
        let robot = urdf::read(path, &options)?;
        print_robot(&robot);
        let name = format!("model {}", robot.model.name());
        // What is in its joints is left out: other programs' rows have none of it either.
        subjects.push(model::Subject::new(
            &name,
            robot.model.bare(),
            arguments.seed,
        ));
    }
    if arguments.wants(chain::NAME) {
        subjects.extend(chain::subjects(&arguments.selection())?);
    }
    Ok(subjects)
}

/// Says what was read, what of it has no effect, and what of it is doubtful.
fn print_robot(robot: &urdf::Robot) {
    let model = &robot.model;
    println!(
        "{}: {} bodies, {} degrees of freedom, {} named frames",
        model.name(),
        model.bodies().len(),
        model.dof_count(),
        model.frames().len()
    );
    for item in model.not_simulated() {
        println!("  {item}");
    }
    for item in &robot.ignored {
        println!("  {item}");
    }
    for item in &robot.doubtful {
        println!("  {item}");
    }
    let in_world = model.frames().iter().filter(|frame| frame.body.is_none());
    let fixed: Vec<&str> = in_world.map(|frame| frame.name.as_str()).collect();
    if !fixed.is_empty() {
        println!(
            "  fixed to the world, where their mass has no effect: {}",
            fixed.join(", ")
        );
    }
}

fn mesh_pairs(arguments: &BenchArgs) -> anyhow::Result<Vec<meshes::Subject>> {
    let mut subjects = Vec::new();
    if arguments.wants(meshes::NAME) {
        subjects.extend(meshes::subjects()?);
    }
    if let (Some(a), Some(b)) = (&arguments.mesh_a, &arguments.mesh_b) {
        subjects.push(meshes::Subject::new(
            &format!("{} x {}", file_stem(a), file_stem(b)),
            read_mesh(a)?,
            read_mesh(b)?,
            arguments.pose_b.unwrap_or(Pose::IDENTITY),
        ));
    }
    Ok(subjects)
}

fn read_mesh(path: &Path) -> anyhow::Result<TriangleMesh> {
    let mesh = TriangleMesh::read(path)?;
    let flat = mesh.zero_area();
    println!("{}: {} triangles", path.display(), mesh.len());
    if !flat.is_empty() {
        println!(
            "  {} of them have no area and are treated as the segments or points they are: {}{}",
            flat.len(),
            flat.iter()
                .take(8)
                .map(u32::to_string)
                .collect::<Vec<_>>()
                .join(", "),
            if flat.len() > 8 { ", ..." } else { "" }
        );
    }
    Ok(mesh)
}

fn file_stem(path: &Path) -> String {
    path.file_stem().map_or_else(
        || "mesh".to_owned(),
        |stem| stem.to_string_lossy().into_owned(),
    )
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
