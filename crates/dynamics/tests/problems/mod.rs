//! What batches are tested on, wherever they run.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use glam::{DMat3, DVec3};
use vertebra_assembly::generate::{self, RandomTree};
use vertebra_assembly::{Joint, MassProperties, Model, ModelDescription, Random, State};
use vertebra_dynamics::{Forces, Wrench};

/// All kinds of joints, several trees, forces of all kinds on some items.
pub(crate) fn problem(bodies: usize, items: usize, seed: u64) -> (Model, Vec<State>, Vec<Forces>) {
    let tree = RandomTree {
        floating: seed % 2 == 1,
        articulations: 1 + bodies % 3,
        ..RandomTree::mixed(bodies)
    };
    let model = generate::random_tree(&tree, seed).unwrap();
    let mut random = Random::new(seed);
    let bodies: Vec<_> = model.body_ids().collect();
    let states = (0..items as u64)
        .map(|item| State::random(&model, 100 * seed + item))
        .collect();
    let forces = (0..items).map(|item| {
        let mut forces = Forces::none(&model);
        forces.joint.fill_with(|| random.symmetric());
        for _ in 0..item % 3 {
            let mut wrench = Wrench::at_point(random.direction() * 3.0, random.direction())
                .with_torque(random.direction());
            wrench.body_axes = item % 2 == 0;
            forces.push(bodies[random.below(bodies.len())], wrench);
        }
        forces
    });
    let forces = forces.collect();
    (model, states, forces)
}

/// A wrist in so many states, whose outer axes are parallel in one alone, where `first`, the body between,
/// moves nothing.
pub(crate) fn wrist(items: usize, singular: usize) -> (Model, Vec<State>) {
    let with_inertia = |inertia| MassProperties {
        mass: 1.0,
        center: DVec3::ZERO,
        inertia: DMat3::from_diagonal(DVec3::splat(inertia)),
    };
    let (arm, light) = (with_inertia(1.0), with_inertia(1e-19));
    let model = ModelDescription::new("wrist")
        .body("arm", None, Joint::revolute(DVec3::Y), arm)
        .body("first", Some("arm"), Joint::revolute(DVec3::X), light)
        .body("second", Some("first"), Joint::revolute(DVec3::Z), light)
        .body("hand", Some("second"), Joint::revolute(DVec3::X), arm)
        .build()
        .unwrap();
    let mut states = vec![State::neutral(&model); items];
    for (item, state) in states.iter_mut().enumerate() {
        state.q[2] = if item == singular { 0.0 } else { 1.0 };
    }
    (model, states)
}
