//! A quadruped from URDF holds its pose on its feet, by servos at its hips and knees.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::dynamics::Motor;
use vertebra::files::recording::sticks;
use vertebra::glam::DVec3;
use vertebra::urdf::{self, Options};
use vertebra::{JointKind, Simulation, Wrench};

/// Where the foot is on its shank \[m\].
const FOOT: DVec3 = DVec3::new(0.03, 0.0, -0.22);
/// Stiffness [N/m] and damping [N s/m] of the ground under a foot.
const GROUND: [f64; 2] = [2e4, 150.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // From a file: `urdf::read(path, &options)`.
    let robot = urdf::parse(include_str!("quadruped.urdf"), &Options::default())?;
    let model = robot.model;
    let servos: Vec<_> = (model.body_ids().zip(model.bodies()))
        .filter(|(_, body)| matches!(body.joint.kind, JointKind::Revolute { .. }))
        .map(|(id, _)| id)
        .collect();
    let feet: Vec<_> = (model.body_ids().zip(model.bodies()))
        .filter(|(_, body)| body.name.starts_with("shank"))
        .map(|(id, _)| id)
        .collect();
    println!(
        "{}: {} servos, {} feet",
        model.name(),
        servos.len(),
        feet.len()
    );

    let scene = Scene::new(&model, sticks(&model), [1e-3, 1.0 / 30.0], 200)?;
    let mut simulation = Simulation::new(model)?;
    for &id in &servos {
        simulation.set_motor(id, Motor::position(0.0, 80.0, 2.0).limited(30.0))?;
    }
    scene.run(&mut simulation, |simulation| {
        simulation.forces_mut().clear_external();
        for &id in &feet {
            let pose = simulation.pose(id)?;
            let motion = simulation.velocity(id)?;
            let arm = pose.rotation * FOOT;
            let (place, speed) = (
                pose.translation + arm,
                motion.linear + motion.angular.cross(arm),
            );
            if place.z < 0.0 {
                let up = (-GROUND[0] * place.z - GROUND[1] * speed.z).max(0.0);
                let drag = -0.8 * up * speed.with_z(0.0) / (speed.length() + 0.01);
                let force = DVec3::new(drag.x, drag.y, up);
                simulation
                    .forces_mut()
                    .push(id, Wrench::at_point(force, FOOT));
            }
        }
        Ok(())
    })?;
    let state = simulation.state()?.clone();
    let bent = servos
        .iter()
        .filter_map(|&id| simulation.model().body(id))
        .map(|body| state.q[body.position_start].abs());
    let most = bent.fold(0.0, f64::max);
    println!(
        "after {:.3} s the trunk is {:.4} m high",
        state.time,
        simulation.mechanics()?.center.z
    );
    println!(
        "the servo that gives way most is off by {:.3} degrees",
        most.to_degrees()
    );
    Ok(())
}
