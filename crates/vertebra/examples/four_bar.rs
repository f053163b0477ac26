//! A four-bar linkage, closed by a hinge and turned by a motor at its crank.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::dynamics::Motor;
use vertebra::files::recording::sticks;
use vertebra::{Simulation, mechanism};

/// Rate of the crank [rad/s].
const RATE: f64 = 3.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4)?;
    let crank = model.find("crank").ok_or("a crank")?;
    let rocker = model.find("rocker").ok_or("a rocker")?;
    let rocker = model.body(rocker).ok_or("a rocker")?.position_start;

    let scene = Scene::new(&model, sticks(&model), [1e-3, 1.0 / 30.0], 200)?;
    let mut simulation = Simulation::new(model)?;
    simulation.set_state(state)?;
    simulation.set_motor(crank, Motor::velocity(RATE, 200.0))?;
    let mut swing = [f64::INFINITY, f64::NEG_INFINITY];
    let mut worst = 0.0_f64;
    scene.run(&mut simulation, |simulation| {
        let angle = simulation.state()?.q[rocker];
        swing = [swing[0].min(angle), swing[1].max(angle)];
        if let Some(violation) = simulation.loop_violation()? {
            worst = worst.max(violation.position);
        }
        Ok(())
    })?;
    let pin = simulation.loop_forces()?.loops[0];
    println!(
        "after {:.3} s the rocker has been from {:.1} to {:.1} degrees",
        simulation.time(),
        swing[0].to_degrees(),
        swing[1].to_degrees()
    );
    println!(
        "the pin carries {:.1} N and was never open by more than {worst:.1e} of the linkage",
        pin.force.length()
    );
    Ok(())
}
