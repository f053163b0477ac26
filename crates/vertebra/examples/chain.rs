//! A hanging chain is pushed at its tip for a tenth of a second, then swings freely: where the tip
//! goes, and how well energy is kept once nothing pushes any more.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

use vertebra::glam::DVec3;
use vertebra::{Integrator, Joint, Simulation, Wrench, generate};

const LINKS: usize = 32;
/// \[s\]
const STEP: f64 = 1e-3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Rods point up at q = 0; gravity along +z makes that the way they hang.
    let mut description =
        generate::chain(LINKS, &Joint::spherical(), &generate::Rod::with_length(0.1))?.describe();
    description.gravity = DVec3::new(0.0, 0.0, 9.81);
    let model = description.build()?;
    let tip = model.last_body();
    println!(
        "{LINKS} links, {} degrees of freedom, step {STEP} s",
        model.dof_count()
    );

    let mut simulation = Simulation::new(model)?.with_integrator(Integrator::RungeKutta4);
    let push = Wrench::at_center([20.0, 5.0, 0.0]);
    simulation.forces_mut().push(tip, push);
    for _ in 0..100 {
        simulation.step(STEP)?;
    }
    simulation.forces_mut().clear_external();

    let start = simulation.mechanics()?;
    let start_energy = start.kinetic_energy + start.potential_energy;
    println!(
        "after the push: kinetic energy {:.4} J",
        start.kinetic_energy
    );
    for tenth in 1..=5 {
        for _ in 0..100 {
            simulation.step(STEP)?;
        }
        let pose = simulation.pose(tip)?;
        let now = simulation.mechanics()?;
        let drift = now.kinetic_energy + now.potential_energy - start_energy;
        println!(
            "{:.1} s later: tip at {:.3} m, kinetic energy {:.4} J, energy drift {:+.1e} of it",
            0.1 * f64::from(tenth),
            pose.translation,
            now.kinetic_energy,
            drift / start.kinetic_energy,
        );
    }
    Ok(())
}
