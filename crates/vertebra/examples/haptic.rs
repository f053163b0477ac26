//! A haptic probe pulls a chain: its force goes out 1000 times a second.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use std::time::{Duration, Instant};
use support::Scene;
use vertebra::files::recording::sticks;
use vertebra::glam::DVec3;
use vertebra::{Joint, Simulation, Wrench, generate};

const LINKS: usize = 64;
/// The virtual coupling between probe and chain [N/m, N s/m]. It acts through the step before, so that
/// its stiffness is bounded by the mass of the tip.
const COUPLING: [f64; 2] = [40.0, 0.4];

/// Where the hand holds the probe: it draws a circle about the tip's place at rest.
fn probe(rest: DVec3, time: f64) -> DVec3 {
    let turn = 3.0 * time;
    rest + DVec3::new(
        0.1 * turn.sin(),
        0.1 * (1.0 - turn.cos()),
        0.05 * turn.sin(),
    )
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rod = generate::Rod {
        mass: 0.02,
        length: 0.02,
        radius: 0.004,
    };
    let joint = Joint::spherical().with_damping(1e-4);
    let mut description = generate::chain(LINKS, &joint, &rod)?.describe();
    // Rods point up at q = 0; gravity along +z makes that the way they hang.
    description.gravity = DVec3::new(0.0, 0.0, 9.81);
    let model = description.build()?;
    let tip = model.last_body();
    let end = DVec3::new(0.0, 0.0, rod.length);
    println!("{LINKS} links; a force every millisecond");

    let scene = Scene::new(&model, sticks(&model), [1e-3, 1.0 / 30.0], 200)?;
    let mut simulation = Simulation::new(model)?;
    let rest = simulation.pose(tip)?.transform_point(end);
    let (mut strongest, mut slowest) = (0.0_f64, Duration::ZERO);
    let mut last = Instant::now();
    scene.run(&mut simulation, |simulation| {
        let (pose, motion) = (simulation.pose(tip)?, simulation.velocity(tip)?);
        let speed = motion.linear + motion.angular.cross(pose.rotation * end);
        let pull = (probe(rest, simulation.time()) - pose.transform_point(end)) * COUPLING[0]
            - speed * COUPLING[1];
        // What the hand feels is the opposite of what the chain gets.
        strongest = strongest.max(pull.length());
        simulation.forces_mut().clear_external();
        simulation
            .forces_mut()
            .push(tip, Wrench::at_point(pull, end));
        slowest = slowest.max(last.elapsed());
        last = Instant::now();
        Ok(())
    })?;
    println!(
        "in {:.3} s the hand felt up to {strongest:.3} N",
        simulation.time()
    );
    println!("the slowest of the steps took {slowest:?}");
    Ok(())
}
