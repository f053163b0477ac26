//! What acts in the joints of loops, and joints that follow others.

use super::{off, simulation};
use glam::DVec3;
use vertebra_assembly::{Joint, MassProperties, Mimic, ModelDescription, mechanism};
use vertebra_dynamics::{Forces, Integrator, Simulation, Solver, SolverOptions};

/// Dampers and rotors in the joints of a linkage: it comes to rest, closed. All elements: `loop_elements.rs`.
#[test]
fn elements_act_in_closed_loops() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let mut description = model.describe();
    for body in &mut description.bodies {
        body.joint.damping = 0.5;
        body.joint.armature = 0.01;
    }
    let model = description.build().unwrap();
    let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
    let start = simulation.mechanics().unwrap().potential_energy;
    for _ in 0..8000 {
        simulation.step(1e-3).unwrap();
    }
    let found = simulation.loop_violation().unwrap().unwrap();
    assert!(found.position <= 1e-12, "{found:?}");
    let end = simulation.mechanics().unwrap();
    let lost = start - end.potential_energy;
    assert!(
        lost > 0.1 && end.kinetic_energy <= 1e-6 * lost,
        "{lost}, {end:?}"
    );
    let dampers = simulation.work().unwrap().dampers;
    assert!((dampers + lost).abs() <= 0.02 * lost, "{dampers} of {lost}");
}

/// A rolls on B: two hinges coupled move as one with the inertia of both, the follower's times the ratio squared.
#[test]
fn coupled_joints_move_as_one() {
    let wheel = MassProperties::rod(2.0, 0.1, 0.3);
    let description = ModelDescription::new("gears")
        .gravity(DVec3::ZERO)
        .body("driver", None, Joint::revolute(DVec3::Z), wheel)
        .body("driven", None, Joint::revolute(DVec3::Z), wheel);
    let ratio = -2.5;
    let coupled = description
        .clone()
        .couple("mesh", "driven", "driver", ratio, 0.3)
        .build()
        .unwrap();
    let mut mimicking = description;
    mimicking.bodies[1].joint.mimic = Some(Mimic {
        body: "driver".to_owned(),
        multiplier: ratio,
        offset: 0.3,
    });
    let mimicking = mimicking.build().unwrap();
    assert!(mimicking.not_simulated().is_empty());
    for model in [coupled, mimicking] {
        let mut simulation = Simulation::new(model.clone()).unwrap();
        simulation.close_loops().unwrap();
        let q = simulation.state().unwrap().q.clone();
        assert!((q[1] - ratio * q[0] - 0.3).abs() <= 1e-14, "{q:?}");
        simulation.forces_mut().joint[0] = 1.5;
        let inertia = wheel.about(DVec3::ZERO).z_axis.z;
        let expected = 1.5 / (inertia * (1.0 + ratio * ratio));
        let qdd = simulation
            .solve()
            .unwrap()
            .joint_accelerations()
            .unwrap()
            .to_vec();
        assert!((qdd[0] - expected).abs() <= 1e-12 * expected);
        assert!((qdd[1] - ratio * expected).abs() <= 1e-12 * expected);
        let forces = simulation.loop_forces().unwrap();
        assert!((forces.couplings[0] - inertia * ratio * expected).abs() <= 1e-9);
        for _ in 0..100 {
            simulation.step(0.01).unwrap();
        }
        assert!(simulation.loop_violation().unwrap().unwrap().position <= 1e-13);
    }
}

/// A rack on a pinion: they move together, and the force between them is that of their inertias.
#[test]
fn a_rack_follows_its_pinion() {
    let (radius, wheel) = (0.004, MassProperties::rod(0.02, 0.001, 0.003));
    let model = ModelDescription::new("rack and pinion")
        .gravity(DVec3::ZERO)
        .body("pinion", None, Joint::revolute(DVec3::Z), wheel)
        .body("rack", None, Joint::prismatic(DVec3::X), wheel)
        .couple("mesh", "rack", "pinion", radius, 0.0)
        .build()
        .unwrap();
    let inertia = wheel.about(DVec3::ZERO).z_axis.z;
    let mut simulation = Simulation::new(model).unwrap();
    simulation.forces_mut().joint[0] = 1e-3;
    let expected = 1e-3 / (inertia + wheel.mass * radius * radius);
    let qdd = simulation.solve().unwrap().joint_accelerations().unwrap();
    assert!((qdd[0] - expected).abs() <= 1e-12 * expected, "{qdd:?}");
    assert!((qdd[1] - radius * expected).abs() <= 1e-12 * radius * expected);
    let force = simulation.loop_forces().unwrap().couplings[0];
    let right = wheel.mass * radius * expected;
    assert!((force - right).abs() <= 1e-9 * right, "{force} or {right}");
}

/// Gravity of one's own acts in `solve` as in steps.
#[test]
fn own_gravity_acts_on_closed_loops() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let mut forces = Forces::none(&model);
    for root in ["crank", "rocker"] {
        let root = model.find(root).unwrap();
        forces.set_gravity(&model, root, [0.3, 1.0, -1.62]).unwrap();
    }
    let mut solver = Solver::new(&model, &SolverOptions::default()).unwrap();
    let right = solver.forward_dynamics(&model, &state, &forces).unwrap();
    let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
    *simulation.forces_mut() = forces;
    let found = simulation.solve().unwrap().joint_accelerations().unwrap();
    assert!(off(found, right) <= 1e-9, "{found:?} or {right:?}");
}
