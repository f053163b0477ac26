//! What closures keep, what cannot be closed, and what is too far open to step.

use super::simulation;
use glam::{DQuat, DVec3};
use vertebra_assembly::{Closure, State, generate, mechanism};
use vertebra_dynamics::{Error, Integrator, Precision, Simulation, Workspace, forward_kinematics};
use vertebra_spatial::Pose;

/// Where a loop's two frames are, found from the bodies' poses.
fn frames(simulation: &mut Simulation, index: usize) -> [Pose; 2] {
    let closed = simulation.model().loops()[index].clone();
    [0, 1].map(|k| {
        let body = match closed.bodies[k] {
            Some(body) => simulation.pose(body).unwrap(),
            None => Pose::IDENTITY,
        };
        body * closed.placements[k]
    })
}

/// What the table of closures says, measured on poses.
#[test]
fn closures_keep_what_they_say() {
    let (axis, second) = (DVec3::new(0.3, -1.0, 0.4), DVec3::new(1.0, 0.2, -0.3));
    let closures = [
        Closure::Weld,
        Closure::Ball,
        Closure::Revolute { axis },
        Closure::Prismatic { axis },
        Closure::Screw { axis, pitch: 0.2 },
        Closure::Cylindrical { axis },
        Closure::Universal {
            first: axis,
            second,
        },
        Closure::Planar { normal: axis },
        Closure::Distance { length: 0.7 },
    ];
    for (closure, seed) in closures.into_iter().zip(5..) {
        let rod = generate::Rod::default();
        let open = generate::random_chain(8, &rod, seed).unwrap();
        let state = State::random(&open, seed);
        let mut workspace = Workspace::new(&open, Precision::F64);
        forward_kinematics(&open, &state, &mut workspace).unwrap();
        let near = workspace.pose(open.last_body()).unwrap();
        let last = open.bodies()[7].name.clone();
        let at = [
            Pose::from_translation(DVec3::Z * 0.4),
            Pose::new(
                near.rotation * DQuat::from_scaled_axis(DVec3::new(0.1, 0.2, -0.1)),
                near.translation + DVec3::new(0.1, -0.1, 0.05),
            ),
        ];
        let model = (open.describe())
            .close("loop", [Some(&last), None], at, closure)
            .build()
            .unwrap();
        let mut simulation = Simulation::new(model.clone()).unwrap();
        simulation.set_state(state).unwrap();
        simulation.close_loops().unwrap();
        let [a, b] = frames(&mut simulation, 0);
        let apart = b.translation - a.translation;
        let turned = (a.rotation.inverse() * b.rotation).normalize();
        let (axis, second) = (axis.normalize(), second.normalize());
        let (z, w) = (a.rotation * axis, b.rotation * axis);
        let together = apart.length();
        let across = z.cross(apart).length();
        let aligned = z.cross(w).length();
        // Half turns about an axis across are another way to assemble.
        let unturned = (0..3).map(|k| {
            let unit = DVec3::AXES[k];
            (turned * unit).cross(unit).length()
        });
        let unturned = unturned.fold(0.0_f64, f64::max);
        let off = match closure {
            Closure::Weld => together.max(unturned),
            Closure::Ball => together,
            Closure::Revolute { .. } => together.max(aligned),
            Closure::Prismatic { .. } => across.max(unturned),
            Closure::Cylindrical { .. } => across.max(aligned),
            Closure::Universal { .. } => together.max(z.dot(b.rotation * second).abs()),
            Closure::Planar { .. } => aligned.max(z.dot(apart).abs()),
            Closure::Distance { length } => (together - length).abs(),
            Closure::Screw { pitch, .. } => {
                let angle = 2.0 * turned.xyz().dot(axis).atan2(turned.w);
                let turns = (z.dot(apart) - pitch * angle) / (core::f64::consts::TAU * pitch);
                across.max(aligned).max((turns - turns.round()).abs())
            }
        };
        assert!(off <= 1e-11, "{closure:?}: {off:e}");
    }
}

/// A violation is the gap over the longest link, whatever unit the model works in.
#[test]
fn violations_are_over_the_longest_link() {
    let of_ground = [1.7, 0.5, 1.5, 1.2];
    let of_coupler = [1.0, 0.5, 1.6, 1.4];
    for (lengths, scale, longest) in [
        (of_ground, 1.0, 1.7),
        (of_ground, 1e-6, 1.7e-6),
        (of_coupler, 1e5, 1.6e5),
    ] {
        let [ground, crank, coupler, rocker] = lengths.map(|length| length * scale);
        let (model, mut state) = mechanism::four_bar(ground, crank, coupler, rocker, 0.4).unwrap();
        state.q[1] += 0.01;
        state.qd[1] = 0.3;
        let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
        let open = simulation.loop_violation().unwrap().unwrap();
        let mut later = state.clone();
        later.q[1] += 0.3 * 1e-6;
        simulation.set_state(later).unwrap();
        let opening = simulation.loop_violation().unwrap().unwrap().position - open.position;
        assert!(
            (opening.abs() / 1e-6 - open.rate).abs() <= 1e-3 * open.rate,
            "{scale}: {open:?}"
        );
        simulation.set_state(state).unwrap();
        let [a, b] = frames(&mut simulation, 0);
        let gap = a.rotation.inverse() * (b.translation - a.translation);
        let expected = gap.abs().max_element() / longest;
        let found = simulation.loop_violation().unwrap().unwrap().position;
        // The frames' axes across the hinge's are the library's own choice.
        assert!(
            found <= 1.4143 * expected && expected <= 1.4143 * found,
            "{scale}: {found:e} or {expected:e}"
        );
    }
}

#[test]
fn what_cannot_be_closed_is_refused_by_name() {
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    // The coupler is too short to reach.
    let mut description = model.describe();
    description.loops[0].placements[0] = Pose::from_translation(DVec3::NEG_Z * 5.0);
    let mut simulation = Simulation::new(description.build().unwrap()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let error = simulation.close_loops().unwrap_err();
    assert!(matches!(error, Error::LoopNotClosed { .. }), "{error}");
    assert_eq!(simulation.state().unwrap(), &state);
    assert!(simulation.step(1e-3).is_err());
    assert_eq!(simulation.state().unwrap(), &state);
}

#[test]
fn loops_close_from_afar() {
    let (model, state) = mechanism::jansen_leg().unwrap();
    let mut simulation = Simulation::new(model).unwrap();
    let mut far = state;
    for (k, q) in far.q.iter_mut().enumerate().skip(1) {
        *q += 0.2 * (k as f64).sin();
    }
    simulation.set_state(far).unwrap();
    assert!(simulation.loop_violation().unwrap().unwrap().position > 0.05);
    simulation.close_loops().unwrap();
    assert!(simulation.loop_violation().unwrap().unwrap().position <= 1e-12);
}

/// A step does not throw bodies across the room.
#[test]
fn steps_from_open_loops_are_refused() {
    let (model, state) = mechanism::jansen_leg().unwrap();
    for integrator in [
        Integrator::SemiImplicitEuler,
        Integrator::RungeKutta4,
        Integrator::ImplicitMidpoint,
    ] {
        let mut open = state.clone();
        open.q[1] += 0.1;
        let mut simulation = simulation(&model, &open, integrator);
        let error = simulation.step(1e-3).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, Error::LoopOpen { .. }), "{text}");
        assert!(
            text.contains("`top`") && text.contains("close_loops"),
            "{text}"
        );
        assert_eq!(simulation.state().unwrap(), &open);
        simulation.close_loops().unwrap();
        simulation.step(1e-3).unwrap();
        // As closed as a file's digits make it.
        let mut rounded = state.clone();
        rounded
            .q
            .iter_mut()
            .for_each(|q| *q = (*q * 1e3).round() / 1e3);
        simulation.set_state(rounded).unwrap();
        simulation.step(1e-3).unwrap();
    }
}

/// Rates that overflow are seen, not dropped.
#[test]
fn rates_that_overflow_are_infinite() {
    let (model, mut state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    state.qd = vec![f64::MAX, f64::MAX, f64::MAX];
    let mut simulation = simulation(&model, &state, Integrator::SemiImplicitEuler);
    let found = simulation.loop_violation().unwrap().unwrap();
    assert!(found.position <= 1e-12, "{found:?}");
    assert_eq!(found.rate, f64::INFINITY, "{found:?}");
}
