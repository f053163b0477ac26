//! `--frames`: a model in motion, as the poses of its bodies over time.

use crate::interrupt::Interrupt;
use crate::results::write_atomically;
use crate::scenario::model::Subject;
use anyhow::Context;
use serde::Serialize;
use std::path::Path;
use vertebra::generate::{self, Rod};
use vertebra::{Integrator, Precision, Simulation};

/// Length of the motion and time between frames \[s\].
const DURATION: f64 = 2.0;
const FRAME: f64 = 0.02;
/// Steps between two frames: 50 us each, Runge-Kutta. Long chains whip: a chain of 64 rods of 1 m from a
/// random state overflows after 1.6 s under semi-implicit Euler with steps of 200 us.
const STEPS: usize = 400;
/// Bodies of the chain that moves when no model is given.
const CHAIN: usize = 128;

/// The file: enough to draw the model at every time.
#[derive(Serialize)]
struct Frames {
    model: String,
    bodies: Vec<String>,
    parents: Vec<Option<u32>>,
    /// x, y, z, qx, qy, qz, qw \[m\].
    layout: &'static str,
    frames: Vec<Frame>,
}

#[derive(Serialize)]
struct Frame {
    time: f64,
    energy: f64,
    poses: Vec<[f64; 7]>,
}

/// Moves the subject, or a chain of 128, from its first random input and writes the poses. Ctrl-C
/// ends the motion early, and so does a step that fails: what moved until then is written.
///
/// # Errors
/// If a step fails, after the file is written, or if the file cannot be written.
pub fn write_frames(
    path: &Path,
    subject: Option<&Subject>,
    interrupt: &Interrupt,
) -> anyhow::Result<()> {
    let chain;
    let subject = match subject {
        Some(subject) => subject,
        None => {
            let model = generate::random_chain(CHAIN, &Rod::default(), 1)?;
            chain = Subject::new("frames", model, 1);
            &chain
        }
    };
    let (state, forces) = &subject.inputs[0];
    let mut simulation = subject
        .simulation(Precision::F64, state, forces)?
        .with_integrator(Integrator::RungeKutta4);
    let mut frames = vec![frame(&mut simulation)?];
    let mut moved = Ok(());
    while moved.is_ok() && simulation.time() < DURATION && !interrupt.requested() {
        moved = next_frame(&mut simulation).map(|frame| frames.push(frame));
    }
    let model = &subject.model;
    let file = Frames {
        model: model.name().to_owned(),
        bodies: model.bodies().iter().map(|b| b.name.clone()).collect(),
        parents: model
            .bodies()
            .iter()
            .map(|b| b.parent.map(|p| p.0))
            .collect(),
        layout: "x, y, z [m], qx, qy, qz, qw",
        frames,
    };
    write_atomically(path, &serde_json::to_vec(&file)?)?;
    println!("wrote {}: {} frames", path.display(), file.frames.len());
    if let (Some(first), Some(last)) = (file.frames.first(), file.frames.last()) {
        // The force on one body does work, so this is a plausibility check, not an error.
        println!(
            "  energy {:.6} J at the start, {:.6} J at the end",
            first.energy, last.energy
        );
    }
    moved.with_context(|| {
        let time = simulation.time();
        format!(
            "the motion ended at {time:.4} s of {DURATION} s; {} holds it until then",
            path.display()
        )
    })
}

fn next_frame(simulation: &mut Simulation) -> anyhow::Result<Frame> {
    for _ in 0..STEPS {
        simulation.step(FRAME / STEPS as f64)?;
    }
    frame(simulation)
}

fn frame(simulation: &mut Simulation) -> anyhow::Result<Frame> {
    let sums = simulation.mechanics()?;
    let mut poses = Vec::new();
    for id in simulation.model().body_ids() {
        let pose = simulation.pose(id)?;
        let (p, q) = (pose.translation, pose.rotation);
        poses.push([p.x, p.y, p.z, q.x, q.y, q.z, q.w]);
    }
    Ok(Frame {
        time: simulation.time(),
        energy: sums.kinetic_energy + sums.potential_energy,
        poses,
    })
}
