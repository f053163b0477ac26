//! What the scenes share: how long they run, and a file of what they did.
//!
//! `cargo run --release --example rope -- 5 rope.glb rope.json` runs for 5 s and writes an animation, and the poses as a
//! table. Without a time a scene takes its first few steps only.

use std::error::Error;
use std::path::{Path, PathBuf};
use vertebra::files::Part;
use vertebra::files::recording::Recording;
use vertebra::{Model, Simulation};

/// What a scene is told on the command line.
pub(crate) struct Scene {
    /// Time step \[s\].
    step: f64,
    steps: usize,
    /// Steps between two frames.
    stride: usize,
    files: Vec<PathBuf>,
    recording: Recording,
}

impl Scene {
    /// A scene of steps \[s\], drawn every `frame` \[s\]; without arguments it takes `few` steps.
    pub(crate) fn new(
        model: &Model,
        parts: Vec<Part>,
        [step, frame]: [f64; 2],
        few: usize,
    ) -> Result<Self, Box<dyn Error>> {
        let mut arguments = std::env::args().skip(1).peekable();
        let count = |time: f64| {
            (1..)
                .take_while(|&n| f64::from(n) * step < time + 0.5 * step)
                .count()
        };
        // What has no ending is no file, but a time.
        let is_time = |argument: &String| {
            Path::new(argument).extension().is_none() || argument.parse::<f64>().is_ok()
        };
        let steps = match arguments.next_if(is_time) {
            Some(seconds) => count(seconds.parse()?),
            None => few,
        };
        Ok(Self {
            step,
            steps,
            stride: count(frame).max(1),
            files: arguments.map(PathBuf::from).collect(),
            recording: Recording::new(model, parts),
        })
    }

    /// Steps the simulation, after `act` has set what acts in each step; writes the files that are
    /// asked for.
    pub(crate) fn run(
        mut self,
        simulation: &mut Simulation,
        mut act: impl FnMut(&mut Simulation) -> Result<(), Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        for step in 0..=self.steps {
            if !self.files.is_empty() && step % self.stride == 0 {
                let time = simulation.time();
                self.recording.push(time, simulation.poses()?)?;
            }
            if step < self.steps {
                act(simulation)?;
                simulation.step(self.step)?;
            }
        }
        for file in &self.files {
            self.recording.save(file)?;
        }
        Ok(())
    }
}
