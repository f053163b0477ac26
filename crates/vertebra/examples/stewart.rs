//! A Stewart platform: six legs, six closed loops; servos in the slides of the legs tilt it round.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::dynamics::Motor;
use vertebra::files::recording::sticks;
use vertebra::glam::DVec3;
use vertebra::{Simulation, mechanism};

/// Stroke of the legs \[m\] and how fast the tilt goes round [rad/s].
const STROKE: f64 = 0.05;
const RATE: f64 = 2.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (model, state) = mechanism::stewart_platform()?;
    let platform = model.find("platform").ok_or("a platform")?;
    let slides: Vec<_> = (0..6)
        .filter_map(|leg| model.find(&format!("upper {leg}")))
        .collect();

    let scene = Scene::new(&model, sticks(&model), [1e-3, 1.0 / 30.0], 200)?;
    let mut simulation = Simulation::new(model)?;
    simulation.set_state(state)?;
    let mut worst = 0.0_f64;
    scene.run(&mut simulation, |simulation| {
        let turn = RATE * simulation.time();
        let swell = turn.min(1.0); // from rest
        for (corner, pair) in (0_u8..).zip(slides.chunks(2)) {
            let phase = f64::from(corner) * core::f64::consts::TAU / 3.0;
            let stroke = STROKE * swell * (turn + phase).sin();
            for &slide in pair {
                simulation.set_motor(slide, Motor::position(stroke, 2e4, 400.0))?;
            }
        }
        if let Some(violation) = simulation.loop_violation()? {
            worst = worst.max(violation.position);
        }
        Ok(())
    })?;
    let pose = simulation.pose(platform)?;
    let tilt = (pose.rotation * DVec3::Z).z.acos();
    println!(
        "after {:.3} s the platform is {:.4} m high and tilted by {:.2} degrees",
        simulation.time(),
        pose.translation.z,
        tilt.to_degrees()
    );
    println!("no leg was off its corner by more than {worst:.1e} of the platform");
    Ok(())
}
