//! Mechanisms with closed loops inserted in others and mirrored: they move as they did by themselves.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use glam::{DMat3, DVec3};
use vertebra_assembly::{Builder, Closure, Joint, MassProperties, Model, Random, State};
use vertebra_dynamics::forward_kinematics;
use vertebra_dynamics::{Forces, Precision, Simulation, Solver, SolverOptions, Workspace};
use vertebra_spatial::Pose;

/// Every closure that connects two bodies; those of few equations and of many.
fn closures() -> [Closure; 9] {
    let axis = DVec3::new(0.3, -1.0, 0.4);
    [
        Closure::Weld,
        Closure::Ball,
        Closure::Revolute { axis },
        Closure::Prismatic { axis },
        Closure::Screw { axis, pitch: 0.2 },
        Closure::Cylindrical { axis },
        Closure::Universal {
            first: axis,
            second: DVec3::new(1.0, 0.3, 0.0),
        },
        Closure::Planar { normal: axis },
        Closure::Distance { length: 0.5 },
    ]
}

/// Two limbs of hinges, slides and screws from the world, joints of which are coupled.
fn limbs(random: &mut Random) -> Builder {
    let mut limbs = Builder::new("limbs");
    for limb in ["left", "right"] {
        limbs = limbs.from_world();
        for index in 0..6 {
            let axis = random.direction();
            let joint = match index % 3 {
                0 => Joint::revolute(axis),
                1 => Joint::prismatic(axis),
                _ => Joint::screw(axis, 0.3),
            };
            let joint = joint.at(Pose::new(random.rotation(), 0.5 * random.direction()));
            let mass = MassProperties::sphere(1.0, 0.2);
            let center = 0.1 * random.direction();
            let mass = MassProperties { center, ..mass };
            limbs = limbs.body(format!("{limb} {index}"), joint, mass);
        }
    }
    limbs.couple("gears", "left 3", "right 0", -1.5, 0.0)
}

/// The limbs with their tips, or one of them and the world, held together where they are.
fn held(limbs: &Builder, closure: Closure, to_world: bool) -> Builder {
    let open = limbs.clone().build().unwrap().model;
    let mut workspace = Workspace::of_tree(&open, Precision::F64);
    forward_kinematics(&open, &State::neutral(&open), &mut workspace).unwrap();
    let pose = |name: &str| workspace.pose(open.find(name).unwrap()).unwrap();
    let apart = match closure {
        Closure::Distance { length } => Pose::from_translation(DVec3::Z * length),
        _ => Pose::IDENTITY,
    };
    let met = pose("right 5") * apart;
    let (name, placement) = match to_world {
        true => (None, met),
        false => (Some("left 5"), pose("left 5").inverse() * met),
    };
    let bodies = [name, Some("right 5")];
    (limbs.clone()).close("tips", bodies, [placement, Pose::IDENTITY], closure)
}

fn accelerations(model: &Model, state: &State) -> Vec<f64> {
    let mut solver = Solver::new(model, &SolverOptions::default()).unwrap();
    let forces = Forces::none(model);
    let found = solver.forward_dynamics(model, state, &forces);
    found.unwrap().to_vec()
}

#[test]
fn closed_loops_move_alike_wherever_they_are_inserted_and_in_a_mirror() {
    let mut random = Random::new(17);
    let gravity = DVec3::new(1.0, -2.0, -9.0);
    let normal = DVec3::new(1.0, -2.0, 0.5);
    let n = normal.normalize();
    let mirror = DMat3::IDENTITY - 2.0 * DMat3::from_cols(n * n.x, n * n.y, n * n.z);
    for (index, closure) in closures().into_iter().enumerate() {
        let part = held(&limbs(&mut random), closure, index % 2 == 0).gravity(gravity);
        let own = part.clone().build().unwrap().model;
        // It moves as its loop allows.
        let mut state = State::neutral(&own);
        let mut simulation = Simulation::new(own.clone()).unwrap();
        state
            .qd
            .iter_mut()
            .for_each(|rate| *rate = random.symmetric());
        simulation.set_state(state).unwrap();
        simulation.close_loops().unwrap();
        let state = simulation.state().unwrap().clone();
        let right = accelerations(&own, &state);
        let size = right.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        assert!(size > 0.1, "{closure:?} moves");

        let [base, inner] = [(); 2].map(|()| Pose::new(random.rotation(), random.direction()));
        let here = Builder::new("whole").body(
            "base",
            Joint::fixed().at(base),
            MassProperties::sphere(1.0, 0.1),
        );
        let turned = (base * inner).rotation;
        for (whole, gravity) in [
            (here.clone().attach("p", &part, inner), turned * gravity),
            (
                here.mirror("p", &part, normal, inner),
                turned * (mirror * gravity),
            ),
        ] {
            let model = whole.gravity(gravity).build().unwrap().model;
            assert_eq!(model.loops()[0].name, "p/tips");
            assert_eq!(model.couplings().count(), 1);
            let mut state = state.clone();
            state.time = 0.0;
            let mut simulation = Simulation::new(model.clone()).unwrap();
            simulation.set_state(state.clone()).unwrap();
            let violation = simulation.loop_violation().unwrap().unwrap();
            assert!(violation.position < 1e-9, "{closure:?}: {violation:?}");
            let found = accelerations(&model, &state);
            for (found, right) in found.iter().zip(&right) {
                let off = (found - right).abs() / size;
                assert!(off < 1e-8, "{closure:?}: {off:e}");
            }
        }
    }
}
