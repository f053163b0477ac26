//! A head of 2000 strands of hair, 64 links each, that keep their shape against gravity by springs.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use std::f64::consts::{FRAC_PI_2, PI};
use support::Scene;
use vertebra::assembly::Spring;
use vertebra::files::strands::{Strand, Strands};
use vertebra::glam::{DQuat, DVec3};
use vertebra::{Joint, Simulation};

const STRANDS: u32 = 2000;
const LINKS: usize = 64;
/// Radius of the head, length and radius of a hair \[m\].
const HEAD: f64 = 0.09;
const HAIR: f64 = 0.25;
const THICKNESS: f64 = 4e-5;

/// A hair that leaves the scalp straight and falls over in an arc.
fn strand(index: u32) -> Strand {
    // Points evenly over the upper half of a ball, each a golden angle on from the one before.
    let height = 1.0 - 0.8 * (f64::from(index) + 0.5) / f64::from(STRANDS);
    let around = f64::from(index) * PI * (3.0 - 5_f64.sqrt());
    let out = (1.0 - height * height).sqrt();
    let direction = DVec3::new(out * around.cos(), out * around.sin(), height);
    let outward = DVec3::new(around.cos(), around.sin(), 0.0);
    let arc = (0..=LINKS).map(|link| {
        let part = link as f64 / LINKS as f64;
        let bend = part * FRAC_PI_2;
        direction * HEAD
            + outward * (0.3 * HAIR * part)
            + DVec3::Z * (0.2 * HAIR * bend.sin() - 0.9 * HAIR * part * part)
    });
    Strand::new(format!("hair-{index}"), arc.collect(), THICKNESS, 1300.0)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let head = Strands {
        strands: (0..STRANDS).map(strand).collect(),
    };
    // A rod of Young's modulus E bends with E pi r^4 / 4 over the length of a link [N m/rad].
    let stiffness = 4e9 * PI * THICKNESS.powi(4) / 4.0 / (HAIR / LINKS as f64);
    let joint = Joint::spherical()
        .with_spring(Spring::turned(stiffness, DQuat::IDENTITY))
        .with_damping(0.01 * stiffness);
    let model = head.build(&joint, Some(LINKS))?;
    let parts = head.parts(&model, Some(LINKS));
    let tip = model.last_body();
    println!(
        "{} links, {} degrees of freedom",
        model.bodies().len(),
        model.dof_count()
    );

    let scene = Scene::new(&model, parts, [1e-3, 0.1], 3)?;
    let mut simulation = Simulation::new(model)?;
    let start = simulation.pose(tip)?.translation;
    scene.run(&mut simulation, |_| Ok(()))?;
    let moved = simulation.pose(tip)?.translation - start;
    println!(
        "after {:.3} s the last tip has moved by {moved:.5} m",
        simulation.time()
    );
    println!(
        "springs did {:.3e} J, dampers {:.3e} J",
        simulation.work()?.springs,
        simulation.work()?.dampers
    );
    Ok(())
}
