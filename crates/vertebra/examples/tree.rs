//! A tree in gusts of wind: four generations of springy branches, each a third as thick.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::assembly::{BodyShape, Builder, Spring};
use vertebra::files::recording::sticks;
use vertebra::glam::{DQuat, DVec3};
use vertebra::{Joint, Pose, Simulation, Wrench};

const GENERATIONS: u32 = 4;
const TWIGS: u32 = 3;
/// Density of wood and of air [kg/m^3].
const WOOD: f64 = 700.0;
const AIR: f64 = 1.2;

/// A branch of a radius and length \[m\] on the place where the builder stands, and all that it carries.
fn branch(
    tree: Builder,
    name: &str,
    place: Pose,
    [radius, length]: [f64; 2],
    left: u32,
) -> Builder {
    // A cantilever of Young's modulus 10 GPa, as one joint: 3 E I / l [N m/rad].
    let stiffness = 3.0 * 1e10 * std::f64::consts::PI * radius.powi(4) / 4.0 / length;
    let joint = Joint::spherical()
        .at(place)
        .with_spring(Spring::turned(stiffness, DQuat::IDENTITY))
        .with_damping(0.02 * stiffness);
    let middle = Pose::from_translation(DVec3::new(0.0, 0.0, 0.5 * length));
    let wood = BodyShape::cylinder(radius, length)
        .of_density(WOOD)
        .placed(&middle);
    tree.branch(|tree| {
        let tree = tree.body(name, joint, wood);
        if left == 0 {
            return tree;
        }
        tree.repeat(TWIGS, |tree, index| {
            let around = f64::from(index) * std::f64::consts::TAU / f64::from(TWIGS);
            let turn =
                DQuat::from_rotation_z(around + f64::from(left)) * DQuat::from_rotation_x(0.6);
            let tip = Pose::new(turn, DVec3::new(0.0, 0.0, length));
            let size = [radius / 3.0, 0.7 * length];
            branch(tree, &format!("{name}.{index}"), tip, size, left - 1)
        })
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let trunk = [0.12, 2.0];
    let tree = branch(
        Builder::new("tree"),
        "trunk",
        Pose::IDENTITY,
        trunk,
        GENERATIONS,
    );
    let model = tree.build()?.model;
    let tip = model.last_body();
    println!(
        "{} branches, {} degrees of freedom",
        model.bodies().len(),
        model.dof_count()
    );

    let scene = Scene::new(&model, sticks(&model), [5e-3, 1.0 / 30.0], 20)?;
    // Sides that face the wind [m^2], from the length and thickness that the mass stands for.
    let areas: Vec<f64> = (model.bodies().iter())
        .map(|body| {
            let length = 2.0 * body.mass.center.z;
            2.0 * length * (body.mass.mass / (WOOD * length * std::f64::consts::PI)).sqrt()
        })
        .collect();
    let mut simulation = Simulation::new(model)?;
    let start = simulation.pose(tip)?.translation;
    let mut farthest = 0.0_f64;
    scene.run(&mut simulation, |simulation| {
        // A breeze of 6 m/s with gusts, and the drag of cylinders in it: A rho c v^2 / 2.
        let time = simulation.time();
        let wind = 6.0 + 4.0 * (1.7 * time).sin() + 2.0 * (4.1 * time).sin();
        simulation.forces_mut().clear_external();
        let ids: Vec<_> = simulation.model().body_ids().collect();
        for (id, area) in ids.into_iter().zip(&areas) {
            let force = 0.5 * AIR * 1.2 * area * wind * wind.abs();
            simulation
                .forces_mut()
                .push(id, Wrench::at_center([force, 0.0, 0.0]));
        }
        farthest = farthest.max((simulation.pose(tip)?.translation - start).length());
        Ok(())
    })?;
    println!(
        "in {:.3} s a tip swayed by {farthest:.4} m",
        simulation.time()
    );
    Ok(())
}
