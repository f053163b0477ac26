//! Tolerances where ball joints carry bodies that are heavier than those between them.

use glam::DVec3;
use vertebra_assembly::generate::{self, Masses, RandomTree};
use vertebra_assembly::{Joint, MassProperties, ModelDescription, State};
use vertebra_dynamics::{
    Algorithm, Forces, Precision, Solver, SolverOptions, Workspace, aba, forward_error, refine,
};
use vertebra_spatial::Pose;

/// A light body between two ball joints and a heavy one beyond: of some freedoms factors in f64 have few digits, and
/// corrections, which change others more, do not show how little they gain of those.
#[test]
fn light_bodies_between_balls_are_met() {
    let block = |mass: f64| MassProperties {
        center: DVec3::new(0.02, 0.05, 0.1),
        ..MassProperties::cuboid(mass, DVec3::new(0.1, 0.15, 0.3))
    };
    let ball = || Joint::spherical().at(Pose::from_translation(DVec3::new(0.0, 0.1, 0.3)));
    for (root, light) in [
        (Joint::free(), 1e-2),
        (Joint::free(), 1e-6),
        (Joint::free(), 1e-8),
        (Joint::spherical(), 1e-2),
        (Joint::spherical(), 1.1e-3),
        (Joint::spherical(), 1e-6),
        (Joint::spherical(), 1e-10),
    ] {
        let model = ModelDescription::new("tie")
            .body("a", None, root, block(10.0))
            .body("link", Some("a"), ball(), block(light))
            .body("c", Some("link"), ball(), block(10.0))
            .build()
            .unwrap();
        let forces = Forces::none(&model);
        for seed in 0..2000 {
            let state = State::random(&model, seed);
            let mut reference = Workspace::new(&model, Precision::Reference);
            aba(&model, &state, &forces, &mut reference).unwrap();
            refine(&forces, &mut reference).unwrap();
            for tolerance in [1e-6, 1e-9, 1e-10, 1e-12] {
                let options = SolverOptions::to_tolerance(tolerance);
                let mut solver = Solver::new(&model, &options).unwrap();
                let qdd = solver.forward_dynamics(&model, &state, &forces).unwrap();
                let error = forward_error(qdd, &reference).unwrap();
                assert!(
                    error <= tolerance,
                    "{light:e} kg, seed {seed}: {error:e} of {tolerance:e}"
                );
            }
        }
    }
}

/// The same wherever a tree of all joints has it, over many decades of masses.
#[test]
fn decades_of_masses_on_all_joints_are_met() {
    for (seed, decades) in (0..1500).zip([6.0, 8.0, 10.0, 12.0, 16.0].into_iter().cycle()) {
        let tree = RandomTree {
            reach: if seed % 3 == 0 { 4 } else { 1 },
            floating: seed % 2 == 0,
            ..RandomTree::mixed(20)
        };
        let model = generate::random_tree(&tree, seed).unwrap();
        let model = generate::weighted(&model, &Masses::Decades(decades), seed).unwrap();
        let (state, forces) = (State::random(&model, seed + 1), Forces::none(&model));
        let mut reference = Workspace::new(&model, Precision::Reference);
        aba(&model, &state, &forces, &mut reference).unwrap();
        refine(&forces, &mut reference).unwrap();
        for (tolerance, algorithm) in [
            (1e-6, Algorithm::Aba),
            (1e-10, Algorithm::Aba),
            (1e-10, Algorithm::Dca),
            (1e-12, Algorithm::Aba),
        ] {
            let options = SolverOptions {
                algorithm: Some(algorithm),
                ..SolverOptions::to_tolerance(tolerance)
            };
            let mut solver = Solver::new(&model, &options).unwrap();
            let qdd = solver.forward_dynamics(&model, &state, &forces).unwrap();
            let error = forward_error(qdd, &reference).unwrap();
            assert!(
                error <= tolerance,
                "seed {seed}, {algorithm}: {error:e} of {tolerance:e}"
            );
        }
    }
}
