//! `motion`: what integrators make of long runs, against the length of a step.
//!
//! Of each scene, integrator and step: how far energy and momentum stray and loops open, how far the motion is from the
//! right one after a second (comparing trajectories says nothing once chaos has drawn them apart), how
//! far from the start a run is that goes back, when a run ends that cannot go on, and what a simulated
//! second costs.

mod output;
mod scene;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use serde::{Deserialize, Serialize};
use vertebra::{Error, Integrator, Mechanics, Simulation};

use crate::cli::MotionArgs;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::run::Outcome;
use crate::suite::worst_of;
use scene::Scene;

/// Time over which trajectories are compared, and there and back \[s\].
const COMPARED: f64 = 1.0;

/// Energy beyond this many times its scale is a run that has left its scene.
const LEFT: f64 = 10.0;

/// Parts of a second that are timed, of which the numbers of steps are multiples; and runs of each.
const PARTS: u32 = 32;
const RUNS: usize = 5;

/// Points of a curve of drift.
const DRIFT_POINTS: usize = 40;

/// The integrators and their names.
const INTEGRATORS: [(&str, Integrator); 3] = [
    ("semi-implicit Euler", Integrator::SemiImplicitEuler),
    ("Runge-Kutta 4", Integrator::RungeKutta4),
    ("implicit midpoint", Integrator::ImplicitMidpoint),
];

/// One scene, integrator and step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Name of the scene.
    pub scene: String,
    /// Name of the integrator.
    pub integrator: String,
    /// Steps a second of simulated time \[1/s\].
    pub steps_per_second: u32,
    /// Simulated time asked for \[s\].
    pub seconds: f64,
    /// When the run ended early, refused or with energy out of all bounds; absent if it did not \[s\].
    pub ended: Option<f64>,
    /// Largest |E - E(0)| over the largest kinetic energy of the right motion.
    pub energy_error: f64,
    /// Slope of the straight line nearest to (E - E(0)) over that energy \[1/s\].
    pub energy_trend: f64,
    /// Largest change of momentum and of angular momentum about the centre of mass, each over its
    /// scale; absent where they are not conserved.
    pub momentum_error: Option<f64>,
    /// Largest violation of a loop over its size; absent without loops.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub violation: Option<f64>,
    /// Largest difference of a position after a second from the right one, in the model's lengths
    /// or rad; absent if there is no motion to a second.
    pub trajectory_error: Option<f64>,
    /// The same after a second forth and one back, from the start.
    pub return_error: Option<f64>,
    /// Time that a simulated second takes \[s\].
    pub time_per_second: Option<f64>,
    /// Time \[s\] and largest energy error until then.
    pub drift: Vec<(f64, f64)>,
}

/// Runs `motion`.
///
/// # Errors
/// If a scene cannot be made, or the files not written.
pub fn run(arguments: &MotionArgs) -> anyhow::Result<Outcome> {
    let interrupt = Interrupt::on_ctrl_c()?;
    let mut scenes = scene::all()?;
    let order: Vec<&str> = scenes.iter().map(|scene| scene.name).collect();
    let wanted = |name: &str| {
        arguments.only.is_empty() || arguments.only.iter().any(|part| name.contains(part))
    };
    scenes.retain(|scene| wanted(scene.name));
    anyhow::ensure!(
        !scenes.is_empty(),
        "no scene is named like `{}`: there are {}",
        arguments.only.join("`, `"),
        order.join(", ")
    );
    let rates = if arguments.quick {
        vec![64, 256]
    } else {
        vec![8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096]
    };
    let seconds = if arguments.quick {
        2.0
    } else {
        arguments.seconds
    };
    let mut progress = Progress::new(scenes.len() * rates.len() * INTEGRATORS.len());
    let mut runs = Vec::new();
    'all: for scene in &scenes {
        let right = Right::of(scene)?;
        for integrator in INTEGRATORS {
            for &rate in &rates {
                if interrupt.requested() {
                    break 'all;
                }
                let label = format!("{}: {}, {rate} steps a second", scene.name, integrator.0);
                progress.begin(&label);
                runs.push(measure(scene, &right, integrator, rate, seconds)?);
                progress.done(&label);
            }
        }
    }
    progress.finish();
    if runs.is_empty() {
        return Ok(Outcome::Interrupted);
    }
    let kept = stored(&arguments.out)?.unwrap_or_default();
    runs.extend(kept.into_iter().filter(|run| !wanted(&run.scene)));
    runs.sort_by_key(|run| order.iter().position(|name| *name == run.scene));
    for path in output::write(&arguments.out, &runs)? {
        println!("wrote {}", path.display());
    }
    Ok(if interrupt.requested() {
        Outcome::Interrupted
    } else {
        Outcome::Success
    })
}

/// Writes tables and pictures again from the runs in a folder; gives the paths of the files, none if
/// there are no runs there.
///
/// # Errors
/// If the runs cannot be read, or the files not written.
pub fn write_again(folder: &Path, out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    match stored(folder)? {
        Some(runs) => output::write(out, &runs),
        None => Ok(Vec::new()),
    }
}

/// The runs in a folder, if there are any.
fn stored(folder: &Path) -> anyhow::Result<Option<Vec<Run>>> {
    let path = folder.join(output::JSON);
    if !path.exists() {
        return Ok(None);
    }
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let runs = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    Ok(Some(runs))
}

/// All the energy there is \[J\].
fn energy(simulation: &mut Simulation, now: &Mechanics) -> Result<f64, Error> {
    let stored = simulation.stored()?;
    Ok(now.kinetic_energy + now.potential_energy + stored.springs + stored.rotors)
}

/// What the right motion is like.
struct Right {
    /// Positions after a second.
    q: Vec<f64>,
    /// The largest kinetic energy until then \[J\].
    energy: f64,
}

impl Right {
    /// By the most exact integrator in steps so short that rounding is the larger error.
    fn of(scene: &Scene) -> anyhow::Result<Self> {
        const RATE: u32 = 16_384;
        let mut simulation = scene.simulation(Integrator::RungeKutta4)?;
        let mut energy = 0.0_f64;
        for step in 0..RATE {
            simulation.step(COMPARED / f64::from(RATE))?;
            if step % 64 == 0 {
                energy = energy.max(simulation.mechanics()?.kinetic_energy);
            }
        }
        Ok(Self {
            q: simulation.state()?.q.clone(),
            energy,
        })
    }
}

fn measure(
    scene: &Scene,
    right: &Right,
    (name, integrator): (&str, Integrator),
    rate: u32,
    seconds: f64,
) -> anyhow::Result<Run> {
    let mut run = Run {
        scene: scene.name.to_owned(),
        integrator: name.to_owned(),
        steps_per_second: rate,
        seconds,
        ended: None,
        energy_error: 0.0,
        energy_trend: 0.0,
        momentum_error: scene.conserves_momentum.then_some(0.0),
        violation: None,
        trajectory_error: None,
        return_error: None,
        time_per_second: None,
        drift: Vec::new(),
    };
    compare(scene, right, integrator, &mut run)?;
    watch(scene, right, integrator, &mut run)?;
    Ok(run)
}

/// A second forth, timed, and one back.
fn compare(
    scene: &Scene,
    right: &Right,
    integrator: Integrator,
    run: &mut Run,
) -> anyhow::Result<()> {
    let h = COMPARED / f64::from(run.steps_per_second);
    let mut simulation = scene.simulation(integrator)?;
    let steps = |simulation: &mut Simulation, count: u32| -> Result<(), Error> {
        (0..count).try_for_each(|_| simulation.step(h))
    };
    // Of each part of the second the fastest of some runs: what else the machine does comes and goes.
    let parts = PARTS.min(run.steps_per_second);
    let mut fastest = vec![f64::INFINITY; parts as usize];
    for _ in 0..RUNS {
        simulation.set_state(scene.state.clone())?;
        for fastest in &mut fastest {
            let start = Instant::now();
            if steps(&mut simulation, run.steps_per_second / parts).is_err() {
                return Ok(());
            }
            *fastest = fastest.min(start.elapsed().as_secs_f64());
        }
    }
    run.time_per_second = Some(fastest.iter().sum());
    run.trajectory_error = Some(farthest(&simulation.state()?.q, &right.q));
    let mut back = simulation.state()?.clone();
    back.qd.iter_mut().for_each(|qd| *qd = -*qd);
    simulation.set_state(back)?;
    if steps(&mut simulation, run.steps_per_second).is_ok() {
        run.return_error = Some(farthest(&simulation.state()?.q, &scene.state.q));
    }
    Ok(())
}

fn farthest(found: &[f64], right: &[f64]) -> f64 {
    let differences = found.iter().zip(right).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, worst_of)
}

/// The whole run, with its energy and momentum.
fn watch(
    scene: &Scene,
    right: &Right,
    integrator: Integrator,
    run: &mut Run,
) -> anyhow::Result<()> {
    let h = 1.0 / f64::from(run.steps_per_second);
    let mut simulation = scene.simulation(integrator)?;
    let start = simulation.mechanics()?;
    let all = energy(&mut simulation, &start)?;
    // Spread evenly over the logarithm of time.
    let mut due = h;
    let growth = (run.seconds / h).powf(1.0 / DRIFT_POINTS as f64);
    let mut sums = [0.0_f64; 4];
    while simulation.time() < run.seconds - 0.5 * h {
        let stepped = simulation.step(h);
        let time = simulation.time();
        let seen = stepped.and_then(|()| {
            let now = simulation.mechanics()?;
            Ok((energy(&mut simulation, &now)?, now))
        });
        let Ok((whole, now)) = seen else {
            run.ended = Some(time);
            break;
        };
        if let Some(found) = simulation.loop_violation()? {
            run.violation = Some(
                run.violation
                    .map_or(found.position, |worst| worst_of(worst, found.position)),
            );
        }
        let off = (whole - all) / right.energy;
        run.energy_error = run.energy_error.max(off.abs());
        for (sum, term) in sums.iter_mut().zip([1.0, time, time * time, time * off]) {
            *sum += term;
        }
        if let Some(momentum) = &mut run.momentum_error {
            let turned = (now.angular_momentum - start.angular_momentum).length()
                / start.angular_momentum.length();
            let pushed = (now.linear_momentum - start.linear_momentum).length()
                / (2.0 * right.energy * start.mass).sqrt();
            *momentum = momentum.max(turned).max(pushed);
        }
        if time >= due {
            run.drift.push((time, run.energy_error));
            due = (due * growth).max(time + 0.5 * h);
        }
        if run.energy_error > LEFT {
            run.ended = Some(time);
            break;
        }
    }
    // Through the origin: the error is none at the start.
    let [_, _, squares, products] = sums;
    if squares > 0.0 {
        run.energy_trend = products / squares;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Orders of convergence, a return to the start, and momentum, as the integrators promise them.
    #[test]
    fn integrators_are_told_apart() {
        let scenes = scene::all().unwrap();
        let tumbling = scenes
            .iter()
            .find(|scene| scene.conserves_momentum)
            .unwrap();
        let right = Right::of(tumbling).unwrap();
        let of =
            |index: usize, rate| measure(tumbling, &right, INTEGRATORS[index], rate, 1.0).unwrap();
        for (index, order) in [(0, 1.0), (1, 4.0), (2, 2.0)] {
            let [coarse, fine] = [64, 128].map(|rate| of(index, rate).trajectory_error.unwrap());
            let found = libm::log2(coarse / fine);
            assert!((found - order).abs() < 0.3, "{index}: {found}");
        }
        let returns = [0, 2].map(|index| of(index, 64).return_error.unwrap());
        assert!(returns[1] < 1e-9 && returns[0] > 1e-6, "{returns:?}");
        assert!(of(1, 128).momentum_error.unwrap() < 1e-4);
    }
}
