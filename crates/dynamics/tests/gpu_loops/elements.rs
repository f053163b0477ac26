//! What acts in joints between loops.

use crate::driven::{assert_alike, chain, moved, moved_by};
use crate::mechanisms::{closed, tie};
use crate::remote::{PRECISIONS, device};
use crate::{bound, largest, off, options};
use glam::DVec3;
use vertebra_assembly::{Closure, Model, State};
use vertebra_dynamics::{Forces, Monitor, Simulation};
use vertebra_spatial::Pose;

/// A chain with everything that acts in joints, which are also held by closures, gears and a hook in the world.
fn loaded() -> (Model, State) {
    let open = chain(24, 3);
    let mut simulation = Simulation::new(open.clone()).unwrap();
    let mut state = State::neutral(&open);
    let poses = simulation.poses().unwrap().to_vec();
    let axis = DVec3::new(0.3, -1.0, 0.4).normalize();
    let mut description = open.describe();
    for (name, pair, closure) in [
        ("sleeve", [5, 11], Closure::Cylindrical { axis }),
        (
            "cardan",
            [8, 15],
            Closure::Universal {
                first: axis,
                second: axis.any_orthonormal_vector(),
            },
        ),
        ("wire", [12, 18], Closure::Ball),
    ] {
        description = tie(description, name, pair, &poses, closure);
    }
    let model = description
        .close(
            "hook",
            [None, Some("body-20")],
            [
                Pose::from_translation(poses[20].translation),
                Pose::IDENTITY,
            ],
            Closure::Ball,
        )
        .couple("gear", "body-21", "body-23", -0.5, 0.0)
        .build()
        .unwrap();
    state.qd.copy_from_slice(&State::random(&model, 3).qd);
    closed(model, state)
}

/// Springs, dampers, friction, rotors, stops and motors act between loops as on the CPU, and steps are checked with them.
#[test]
fn elements_act_between_loops() {
    let Some(device) = device() else { return };
    let (model, state) = loaded();
    let expected = moved(Simulation::new(model.clone()).unwrap(), &state, 1e-3, 20);
    let work = expected.1;
    for work in [
        work.motors,
        work.springs,
        work.dampers,
        work.friction,
        work.stops,
    ] {
        assert!(work != 0.0, "{:?}", expected.1);
    }
    let gpu = Simulation::on_gpu(&device, model, &options(PRECISIONS[2])).unwrap();
    // Stops are met to the square root of what solutions are known to.
    let mut gpu = gpu
        .with_monitor(Monitor::every(1, f64::EPSILON.sqrt()))
        .unwrap();
    let found = moved_by(&mut gpu, &state, 1e-3, 20);
    assert_alike(&found, &expected, 1e-6, "between loops");
    let monitor = gpu.monitor().unwrap();
    let worst = monitor.worst();
    assert_eq!((monitor.checks(), monitor.exceeded()), (40, 0), "{worst:?}");
}

/// And inertia of freedoms' own, in accelerations.
#[test]
fn freedoms_between_loops_have_inertia_of_their_own() {
    let Some(device) = device() else { return };
    let (model, state) = loaded();
    let mut forces = Forces::none(&model);
    forces.joint_inertia = (0..model.dof_count()).map(|dof| (dof % 3) as f64).collect();
    let (bare, options) = (model.bare(), options(PRECISIONS[2]));
    let run = |mut simulation: Simulation| {
        simulation.set_state(state.clone()).unwrap();
        *simulation.forces_mut() = forces.clone();
        simulation.accelerations().unwrap()
    };
    let exact = run(Simulation::new(bare.clone()).unwrap());
    let found = run(Simulation::on_gpu(&device, bare, &options).unwrap());
    let off = off(&found, &exact);
    let bound = bound(PRECISIONS[2]) * largest(&exact);
    assert!(off <= bound, "{off:e} of {bound:e}");
}
