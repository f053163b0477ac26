//! Runs as files: data, a table a scene, and pictures.

use std::path::{Path, PathBuf};

use super::{INTEGRATORS, Run};
use crate::plot::{Curve, Curves, Plot, Unit};
use crate::results::{write_atomically, write_plots};
use crate::table::Grid;
use crate::table::format::error_figure;

/// Name of the file that holds every run.
pub(super) const JSON: &str = "motion.json";

const INTRODUCTION: &str = "\
# Long runs

Made by `vertebra-bench motion`. Energy errors are over the largest kinetic energy of the right motion, momentum over its
scale; the trajectory is compared after one second with steps of 1/16384 s by Runge-Kutta 4, positions in m or rad; *back* is
how far from the start a second forth and one back ends. *open*: the largest violation of a loop over its size. *Ended*: refused, or energy off by ten times its scale.
A dash: there is no such figure.
";

/// Writes the runs and what they show; gives the paths of the files.
pub(super) fn write(dir: &Path, runs: &[Run]) -> anyhow::Result<Vec<PathBuf>> {
    let lines: Vec<String> = runs
        .iter()
        .map(serde_json::to_string)
        .collect::<Result<_, _>>()?;
    let json = format!("[\n{}\n]\n", lines.join(",\n"));
    let scenes = scenes(runs);
    let mut markdown = INTRODUCTION.to_owned();
    let mut plots = Vec::new();
    for scene in scenes {
        let own: Vec<&Run> = runs.iter().filter(|run| run.scene == scene).collect();
        markdown.push_str(&format!("\n## {scene}\n\n{}", table(&own).markdown()));
        for plot in pictures(scene, &own) {
            let link = format!("\n![{}]({})\n", plot.title(), plot.svg_path());
            markdown.push_str(&link);
            plots.push(plot);
        }
    }
    let mut written = Vec::new();
    for (name, contents) in [(JSON, json), ("motion.md", markdown)] {
        let path = dir.join(name);
        write_atomically(&path, contents.as_bytes())?;
        written.push(path);
    }
    written.extend(write_plots(dir, &plots)?);
    Ok(written)
}

fn scenes(runs: &[Run]) -> Vec<&str> {
    let mut scenes: Vec<&str> = Vec::new();
    for run in runs {
        if !scenes.contains(&run.scene.as_str()) {
            scenes.push(&run.scene);
        }
    }
    scenes
}

fn table(runs: &[&Run]) -> Grid {
    let has_loops = runs.iter().any(|run| run.violation.is_some());
    let mut headings = vec![
        ("integrator", false),
        ("steps/s", true),
        ("trajectory", true),
        ("order", true),
        ("back", true),
        ("energy", true),
        ("energy/s", true),
        ("momentum", true),
        ("ended", true),
        ("time/s", true),
    ];
    let figure = |value: Option<f64>| value.map_or("-".to_owned(), error_figure);
    if has_loops {
        headings.insert(8, ("open", true));
    }
    let line = |run: &&Run| {
        let mut cells = vec![
            run.integrator.clone(),
            run.steps_per_second.to_string(),
            figure(run.trajectory_error),
            order(run, runs).map_or("-".to_owned(), |order| format!("{order:.1}")),
            figure(run.return_error),
            figure(Some(run.energy_error)),
            figure(Some(run.energy_trend)),
            figure(run.momentum_error),
            run.ended.map_or("-".to_owned(), |at| format!("{at:.2} s")),
            run.time_per_second
                .map_or("-".to_owned(), |time| format!("{:.3} ms", 1e3 * time)),
        ];
        if has_loops {
            cells.insert(8, figure(run.violation));
        }
        cells
    };
    Grid::new(headings, runs.iter().map(line).collect())
}

/// By which power of the step the error of the trajectory has fallen from twice that step; none where
/// either is rounding or no small error.
fn order(run: &Run, runs: &[&Run]) -> Option<f64> {
    let tells = |error: &f64| (1e-11..0.1).contains(error);
    let coarse = runs.iter().find(|other| {
        other.integrator == run.integrator && 2 * other.steps_per_second == run.steps_per_second
    })?;
    let errors = [coarse.trajectory_error, run.trajectory_error].map(|error| error.filter(tells));
    Some(libm::log2(errors[0]? / errors[1]?))
}

/// The error of a trajectory that is still one.
fn small(run: &Run) -> Option<f64> {
    run.trajectory_error.filter(|error| *error < 1.0)
}

/// The length of a step \[s\].
fn step(run: &Run) -> f64 {
    1.0 / f64::from(run.steps_per_second)
}

/// Convergence, work against precision, energy against the step, and drift.
fn pictures(scene: &str, runs: &[&Run]) -> Vec<Plot> {
    let slug = scene.to_lowercase().replace(' ', "-").replace('\'', "");
    let curves = |points: fn(&Run) -> Vec<(f64, f64)>| -> Vec<Curve> {
        let of = |(turn, (name, _)): (usize, &(&str, _))| Curve {
            label: (*name).to_owned(),
            turn,
            points: runs
                .iter()
                .filter(|run| run.integrator == *name)
                .flat_map(|run| points(run))
                .collect(),
            bars: Vec::new(),
        };
        INTEGRATORS.iter().enumerate().map(of).collect()
    };
    let seconds = runs.first().map_or(0.0, |run| run.seconds);
    let number = |title: &str| (title.to_owned(), Unit::Number);
    let time = |title: &str| (title.to_owned(), Unit::Seconds);
    let remark = "Runs that ended early and errors of 1 or more have no point.".to_owned();
    let trajectory = "error of the positions after 1 s [m or rad]";
    let energy = "largest energy error, over the largest kinetic energy";
    let figures = [
        (
            "convergence",
            Curves {
                title: format!("{scene}: trajectory against the step"),
                subtitle: "Against Runge-Kutta 4 in steps of 1/16384 s".to_owned(),
                vertical: number(trajectory),
                horizontal: time("step"),
                remark: remark.clone(),
                curves: curves(|run| {
                    small(run)
                        .map(|error| (step(run), error))
                        .into_iter()
                        .collect()
                }),
            },
        ),
        (
            "work-precision",
            Curves {
                title: format!("{scene}: work against precision"),
                subtitle: "One thread; best is at the bottom left".to_owned(),
                vertical: time("time of a simulated second"),
                horizontal: number(trajectory),
                remark,
                curves: curves(|run| small(run).zip(run.time_per_second).into_iter().collect()),
            },
        ),
        (
            "energy",
            Curves {
                title: format!("{scene}: energy against the step"),
                subtitle: format!("Over {seconds} s"),
                vertical: number(energy),
                horizontal: time("step"),
                remark: "Runs that ended early have no point.".to_owned(),
                curves: curves(|run| {
                    let error = run.ended.is_none().then_some(run.energy_error);
                    error.map(|error| (step(run), error)).into_iter().collect()
                }),
            },
        ),
        (
            "violation",
            Curves {
                title: format!("{scene}: loops against the step"),
                subtitle: format!("Over {seconds} s"),
                vertical: number("largest violation, over the loop's size"),
                horizontal: time("step"),
                remark: "Runs that ended early have no point.".to_owned(),
                curves: curves(|run| {
                    let violation = run.violation.filter(|_| run.ended.is_none());
                    violation
                        .map(|violation| (step(run), violation))
                        .into_iter()
                        .collect()
                }),
            },
        ),
        (
            "drift",
            Curves {
                title: format!("{scene}: energy over time"),
                subtitle: "Steps of 1/256 s".to_owned(),
                vertical: number(energy),
                horizontal: time("simulated time"),
                remark: "The largest until then: a flat line is no drift.".to_owned(),
                curves: curves(|run| match run.steps_per_second {
                    256 => run.drift.clone(),
                    _ => Vec::new(),
                }),
            },
        ),
    ];
    figures
        .iter()
        .filter_map(|(kind, curves)| Plot::of_curves(&format!("{slug}-{kind}"), curves))
        .collect()
}
