//! `bench`: measures what was asked for, and writes it.

use crate::cli::BenchArgs;
use crate::compare::{compare, to_table as comparison_table};
use crate::frames::write_frames;
use crate::interrupt::Interrupt;
use crate::measure::Budget;
use crate::progress::Progress;
use crate::results::{read_results, write_results};
use crate::row::Row;
use crate::scenario::{Measurement, Meter, chain, meshes, model};
use crate::table::to_table;
use anyhow::Context;
use std::fs::File;
use std::path::Path;
use vertebra::assembly::urdf;
use vertebra::{PlyPart, Pose, TriangleMesh, write_ply};

/// Runs `bench`; whether nothing got worse than in the results compared with.
///
/// # Errors
/// If an input cannot be read, a method refuses it, or a result cannot be written.
pub fn bench(arguments: &BenchArgs) -> anyhow::Result<bool> {
    let old = match &arguments.compare {
        Some(path) => Some(read_results(path)?),
        None => None,
    };
    let models = models(arguments)?;
    let meshes = mesh_pairs(arguments)?;
    let meter = Meter {
        budget: if arguments.quick {
            Budget::quick()
        } else {
            Budget::default()
        },
        interrupt: Interrupt::on_ctrl_c()?,
    };

    let selection = arguments.selection();
    let mut list: Vec<Measurement<'_>> = Vec::new();
    for subject in &models {
        list.extend(subject.measurements(&selection));
    }
    for subject in &meshes {
        list.extend(subject.measurements(&selection));
    }
    let rows = measure_all(list, &meter)?;
    if rows.is_empty() {
        anyhow::bail!(
            "nothing was measured: the methods and precisions asked for do not occur in these scenarios"
        );
    }
    println!("{}", to_table(&rows));
    for path in write_results(&arguments.out, &rows)? {
        println!("wrote {}", path.display());
    }
    if let (Some(path), Some(subject)) = (&arguments.hits, meshes.last()) {
        write_hits(path, subject)?;
    }
    if let Some(path) = &arguments.frames {
        write_frames(path, models.first(), &meter.interrupt)?;
    }
    let Some(old) = old else { return Ok(true) };
    let verdicts = compare(&old, &rows);
    println!("{}", comparison_table(&verdicts));
    Ok(!(arguments.fail_on_regression && verdicts.iter().any(|v| v.is_regression())))
}

/// Measures until all is done or Ctrl-C; a method that fails stops the run with what it said.
fn measure_all(list: Vec<Measurement<'_>>, meter: &Meter) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    let mut progress = Progress::new(list.len());
    for measurement in list {
        if meter.interrupt.requested() {
            break;
        }
        let label = measurement.label.clone();
        progress.begin(&label);
        let row = measurement.run(meter).with_context(|| label.clone())?;
        if let Some(row) = row {
            progress.done(&format!("{label}: {:.3e} s", row.time_median_s));
            rows.push(row);
        }
    }
    progress.finish();
    Ok(rows)
}

fn models(arguments: &BenchArgs) -> anyhow::Result<Vec<model::Subject>> {
    let mut subjects = Vec::new();
    if let Some(path) = &arguments.model {
        let mut options = urdf::Options::default();
        options.floating_base = arguments.floating_base;
        let robot = urdf::read(path, &options)?;
        print_robot(&robot);
        let name = format!("model {}", robot.model.name());
        subjects.push(model::Subject::new(&name, robot.model, arguments.seed));
    }
    if arguments.wants(chain::NAME) {
        subjects.extend(chain::subjects(&arguments.selection())?);
    }
    Ok(subjects)
}

/// Says what was read, and what of it has no effect.
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
}

fn mesh_pairs(arguments: &BenchArgs) -> anyhow::Result<Vec<meshes::Subject>> {
    let mut subjects = Vec::new();
    if arguments.wants(meshes::NAME) {
        subjects.extend(meshes::subjects()?);
    }
    if let (Some(a), Some(b)) = (&arguments.mesh_a, &arguments.mesh_b) {
        subjects.push(meshes::Subject {
            scenario: format!("{} x {}", file_stem(a), file_stem(b)),
            a: read_mesh(a)?,
            b: read_mesh(b)?,
            pose_b: arguments.pose_b.unwrap_or(Pose::IDENTITY),
            published: None,
        });
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

/// Colours as the source's figures have them: what collides red and green, the rest white and blue.
fn write_hits(path: &Path, subject: &meshes::Subject) -> anyhow::Result<()> {
    let (hit_a, hit_b) = subject.query()?.threads(0).mask()?;
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
    let file = File::create(path).with_context(|| path.display().to_string())?;
    write_ply(
        file,
        &[
            part(&subject.a, Pose::IDENTITY, &color_a),
            part(&subject.b, subject.pose_b, &color_b),
        ],
    )
    .with_context(|| path.display().to_string())?;
    let count = |hits: &[bool]| hits.iter().filter(|hit| **hit).count();
    println!(
        "wrote {}: {} and {} colliding triangles coloured",
        path.display(),
        count(&hit_a),
        count(&hit_b)
    );
    Ok(())
}
