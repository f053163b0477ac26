//! A haptic probe pulls a chain: its force goes out 1000 times a second.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use std::time::Instant;
use support::Scene;
use vertebra::files::recording::sticks;
use vertebra::glam::DVec3;
use vertebra::{Joint, Simulation, Wrench, generate};

const LINKS: usize = 64;
/// Time from one force to the next \[s\].
const PERIOD: f64 = 1e-3;
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
    println!("{LINKS} links; a force every {:.0} ms", 1e3 * PERIOD);

    let scene = Scene::new(&model, sticks(&model), [PERIOD, 1.0 / 30.0], 200)?;
    let mut simulation = Simulation::new(model)?;
    let rest = simulation.pose(tip)?.transform_point(end);
    let (mut strongest, mut took) = (0.0_f64, Vec::new());
    let mut last = Instant::now();
    scene.run(&mut simulation, |simulation| {
        let (pose, motion) = (simulation.pose(tip)?, simulation.velocity(tip)?);
        let speed = motion.linear + motion.angular.cross(pose.rotation * end);
        let pull = (probe(rest, simulation.time()) - pose.transform_point(end)) * COUPLING[0]
            - speed * COUPLING[1];
        // Here the force goes out: what the hand feels is the opposite of what the chain gets.
        strongest = strongest.max(pull.length());
        simulation.forces_mut().clear_external();
        simulation
            .forces_mut()
            .push(tip, Wrench::at_point(pull, end));
        let due = PERIOD * took.len() as f64;
        if (simulation.time() - due).abs() > 1e-9 {
            return Err(format!("a force for {due:.6} s is of {:.6} s", simulation.time()).into());
        }
        took.push(last.elapsed().as_secs_f64());
        last = Instant::now();
        Ok(())
    })?;
    println!(
        "in {:.3} s the hand felt {} forces of up to {strongest:.3} N",
        simulation.time(),
        took.len()
    );
    report(took);
    Ok(())
}

/// How long the forces took \[s\], each from the one before, and how many would have been late for the hand.
fn report(mut took: Vec<f64>) {
    // Each starts when its millisecond does, or when the one before is out, and must be out at the end of it.
    let (mut now, mut late) = (0.0_f64, 0);
    for (index, time) in took.iter().enumerate() {
        let start = PERIOD * index as f64;
        now = now.max(start) + time;
        late += usize::from(now > start + PERIOD);
    }
    took.sort_by(f64::total_cmp);
    let Some(&slowest) = took.last() else { return };
    let (half, most) = (took[took.len() / 2], took[took.len() * 99 / 100]);
    println!(
        "half of them took up to {:.0} us, 99 % up to {:.0} us, the slowest {:.0} us",
        1e6 * half,
        1e6 * most,
        1e6 * slowest
    );
    println!(
        "{late} of {} would have come late; {:.0} a second can be held for 99 % of them",
        took.len(),
        most.recip()
    );
}
