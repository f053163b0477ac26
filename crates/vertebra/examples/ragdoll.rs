//! A motion-captured character walks, then lets go: from there on it is a ragdoll that falls to the floor.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::files::bvh::{Options, parse};
use vertebra::glam::DVec3;
use vertebra::{Simulation, Wrench};

/// Time step \[s\].
const STEP: f64 = 1e-3;
/// When it lets go \[s\].
const TRIPS: f64 = 0.5;
/// Stiffness [N/m] and damping [N s/m] of the floor, per place that touches.
const FLOOR: [f64; 2] = [2e4, 200.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // From a file: `bvh::read(path, &options)`.
    let capture = parse(
        include_str!("../../files/tests/data/walk.bvh"),
        &Options::default(),
    )?;
    let motion = &capture.motion;
    // Limp joints still rub [N m s/rad].
    let mut description = capture.model.describe();
    for body in description
        .bodies
        .iter_mut()
        .filter(|body| body.parent.is_some())
    {
        body.joint.damping = 0.5;
    }
    let model = description.build()?;
    println!(
        "{} joints, {} frames over {:.2} s; it lets go after {TRIPS} s",
        model.bodies().len(),
        motion.len(),
        motion.duration()
    );
    let mut captured = motion.state(&model, 0.0)?;
    let bodies: Vec<_> = model.body_ids().collect();
    let scene = Scene::new(&model, capture.parts, [STEP, 1.0 / 30.0], 600)?;

    let mut simulation = Simulation::new(model)?;
    simulation.set_state(captured.clone())?;
    let begin = simulation.mechanics()?;
    scene.run(&mut simulation, |simulation| {
        // It walks as it was captured, whatever acts on it. The last of these states is where the fall begins.
        let time = simulation.time();
        if time <= TRIPS {
            motion.interpolate(simulation.model(), time, &mut captured)?;
            simulation.set_state(captured.clone())?;
            return Ok(());
        }
        simulation.forces_mut().clear_external();
        for &id in &bodies {
            let (pose, speed) = (simulation.pose(id)?, simulation.velocity(id)?.linear);
            let depth = -pose.translation.z;
            if depth > 0.0 {
                let up = (FLOOR[0] * depth - FLOOR[1] * speed.z).max(0.0);
                let drag = -0.5 * up * speed.with_z(0.0) / (speed.length() + 0.01);
                let force = DVec3::new(drag.x, drag.y, up);
                simulation
                    .forces_mut()
                    .push(id, Wrench::at_point(force, DVec3::ZERO));
            }
        }
        Ok(())
    })?;
    let end = simulation.mechanics()?;
    println!(
        "at {:.3} s its centre of mass is {:.3} m high, from {:.3} m",
        simulation.time(),
        end.center.z,
        begin.center.z
    );
    Ok(())
}
