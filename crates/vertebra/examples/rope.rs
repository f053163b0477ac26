//! A rope of 2048 links, held at one end, falls from a horizontal line.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::files::strands::{Strand, Strands};
use vertebra::glam::DVec3;
use vertebra::{Joint, Simulation};

const LINKS: usize = 2048;
/// \[m\]
const LENGTH: f64 = 20.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let line = vec![DVec3::ZERO, DVec3::new(LENGTH, 0.0, 0.0)];
    let rope = Strands {
        strands: vec![Strand::new("rope", line, 0.01, 1000.0)],
    };
    // What bends in a rope rubs: damping in every joint [N m s/rad].
    let model = rope.build(&Joint::spherical().with_damping(1e-4), Some(LINKS))?;
    let parts = rope.parts(&model, Some(LINKS));
    let tip = model.last_body();
    println!(
        "{} links, {} degrees of freedom",
        model.bodies().len(),
        model.dof_count()
    );

    let scene = Scene::new(&model, parts, [2e-4, 1.0 / 30.0], 20)?;
    let mut simulation = Simulation::new(model)?;
    let start = simulation.mechanics()?;
    scene.run(&mut simulation, |_| Ok(()))?;
    let end = simulation.mechanics()?;
    println!(
        "after {:.4} s: tip at {:.4} m",
        simulation.time(),
        simulation.pose(tip)?.translation
    );
    println!(
        "potential energy {:+.3e} J, kinetic {:+.3e} J, taken by the joints {:.3e} J",
        end.potential_energy - start.potential_energy,
        end.kinetic_energy - start.kinetic_energy,
        -simulation.work()?.dampers,
    );
    Ok(())
}
