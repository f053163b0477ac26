//! An arm of an octopus reaches out: a bend travels from its root to its tip, driven by motors.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::assembly::{BodyShape, Builder};
use vertebra::dynamics::Motor;
use vertebra::files::recording::sticks;
use vertebra::glam::DVec3;
use vertebra::{Joint, Pose, Simulation};

const SEGMENTS: u32 = 40;
/// \[m\]
const LENGTH: f64 = 0.6;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let segment = LENGTH / f64::from(SEGMENTS);
    let arm = Builder::new("octopus arm").repeat(SEGMENTS, |arm, index| {
        // The arm tapers, and its segments turn about x and y by turns.
        let radius = 0.03 * (1.0 - 0.9 * f64::from(index) / f64::from(SEGMENTS));
        let axis = if index % 2 == 0 { DVec3::X } else { DVec3::Y };
        let at = if index == 0 { 0.0 } else { segment };
        let flesh = BodyShape::cylinder(radius, segment)
            .of_density(1050.0)
            .placed(&Pose::from_translation(DVec3::new(0.0, 0.0, 0.5 * segment)));
        let joint = Joint::revolute(axis).at(Pose::from_translation(DVec3::new(0.0, 0.0, at)));
        arm.body(format!("segment-{index}"), joint, flesh)
    });
    // In water what floats has no weight.
    let model = arm.gravity(DVec3::ZERO).build()?.model;
    let tip = model.last_body();
    println!(
        "{} segments, {} degrees of freedom",
        model.bodies().len(),
        model.dof_count()
    );

    let scene = Scene::new(&model, sticks(&model), [2e-3, 1.0 / 30.0], 50)?;
    let bodies: Vec<_> = model.body_ids().collect();
    let mut simulation = Simulation::new(model)?;
    scene.run(&mut simulation, |simulation| {
        let time = simulation.time();
        for (&id, index) in bodies.iter().zip(0..) {
            // A bump of curvature that runs outwards at 20 segments a second, from before the root, again and again.
            let along = f64::from(index) + 12.0 - (20.0 * time) % f64::from(2 * SEGMENTS);
            let bend = 0.35 * (-0.02 * along * along).exp();
            let thin = 1.0 - 0.9 * f64::from(index) / f64::from(SEGMENTS);
            let stiffness = 20.0 * thin.powi(3);
            let motor = Motor::position(bend, stiffness, 0.2 * stiffness).limited(3.0 * thin);
            simulation.set_motor(id, motor)?;
        }
        Ok(())
    })?;
    println!(
        "after {:.3} s: tip at {:.4} m",
        simulation.time(),
        simulation.pose(tip)?.translation
    );
    println!("the motors did {:.4} J of work", simulation.work()?.motors);
    Ok(())
}
