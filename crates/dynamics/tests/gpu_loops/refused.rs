//! What cannot be closed, and what does not fit.

use crate::remote::device;
use crate::{bound, largest, off};
use glam::DVec3;
use vertebra_assembly::{
    Closure, Joint, MassProperties, Model, ModelDescription, State, mechanism,
};
use vertebra_dynamics::gpu::{self, Options};
use vertebra_dynamics::{Error, Simulation};
use vertebra_gpu::Device;
use vertebra_spatial::Pose;

/// The error of the first of some steps, after which the state is as it was.
fn refusal(device: &Device, model: Model, state: &State) -> Error {
    let mut simulation = Simulation::on_gpu(device, model, &Options::default()).unwrap();
    simulation.set_state(state.clone()).unwrap();
    let error = simulation.steps(1e-3, 40).unwrap_err();
    assert_eq!(simulation.state().unwrap(), state);
    assert!(matches!(
        simulation.close_loops(),
        Err(Error::LoopNotClosed { .. })
    ));
    match error {
        Error::Step {
            step: 0, source, ..
        } => *source,
        other => other,
    }
}

/// What cannot be closed is an error that names the loop.
#[test]
fn what_cannot_be_closed_is_refused_by_name() {
    let Some(device) = device() else { return };
    let (model, state) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    // The coupler is too short to reach.
    let mut description = model.describe();
    description.loops[0].placements[0] = Pose::from_translation(DVec3::NEG_Z * 5.0);
    let error = refusal(&device, description.build().unwrap(), &state);
    assert!(
        matches!(&error, Error::LoopOpen { name, violation, .. } if name == "pin" && *violation > 0.1),
        "{error}"
    );
    // A wire that is five thousandths too short.
    let tip = Pose::from_translation(DVec3::X);
    let hook = Pose::from_translation(DVec3::X * 2.005);
    let model = ModelDescription::new("pendulum")
        .body(
            "rod",
            None,
            Joint::revolute(DVec3::Y),
            MassProperties::rod(1.0, 1.0, 0.1),
        )
        .close(
            "wire",
            [Some("rod"), None],
            [tip, hook],
            Closure::Distance { length: 1.0 },
        )
        .build()
        .unwrap();
    let mut state = State::neutral(&model);
    state.q[0] = 0.05;
    let error = refusal(&device, model, &state);
    assert!(
        matches!(&error, Error::LoopNotClosed { name, violation, .. } if name == "wire" && *violation > 1e-3),
        "{error}"
    );
}

/// Forces at the end of the range of numbers that a device counts on: loops hold there as they do elsewhere, or it is an error.
#[test]
fn loops_are_not_left_open_by_what_overflows() {
    let Some(device) = device() else { return };
    let (model, bar) = mechanism::four_bar(1.0, 0.3, 0.9, 0.7, 0.4).unwrap();
    let mut description = model.describe();
    // Of heavy bodies among light ones accelerations are small beside what they ask of loops, in units of their compliance.
    for body in &mut description.bodies {
        (body.mass.mass, body.mass.inertia) = (1e8 * body.mass.mass, 1e8 * body.mass.inertia);
    }
    for light in 0..12 {
        let rod = MassProperties::rod(1.0, 1.0, 0.1);
        description = description.body(
            format!("light-{light}"),
            None,
            Joint::revolute(DVec3::Y),
            rod,
        );
    }
    let model = description.build().unwrap();
    let mut state = State::neutral(&model);
    state.q[..bar.q.len()].copy_from_slice(&bar.q);
    let mut simulation = Simulation::on_gpu(&device, model, &Options::default()).unwrap();
    simulation.set_state(state).unwrap();
    let joins = simulation.choice().tree;
    let mut by = |force: f64| {
        simulation.forces_mut().joint[0] = force;
        let qdd = simulation.accelerations()?;
        Ok::<Vec<f64>, Error>(qdd.iter().map(|qdd| qdd / force).collect())
    };
    let right = by(1e20).unwrap();
    let (mut held, mut refused) = (0, 0);
    for halving in 0..60 {
        match by(1e42 * f64::from(-halving).exp2()) {
            Ok(found) => {
                let off = off(&found, &right) / largest(&right);
                assert!(off <= bound((joins, joins)), "1e42 / 2^{halving}: {off:e}");
                held += 1;
            }
            Err(Error::Overflow { .. }) => refused += 1,
            Err(other) => panic!("{other:?}"),
        }
    }
    assert!(held > 0 && refused > 0, "{held} held, {refused} refused");
}

/// More equations than a workgroup keeps.
#[test]
fn too_many_loops_are_refused() {
    let Some(device) = device() else { return };
    let (model, _) = mechanism::chain_mail(14, 15).unwrap();
    let refused = gpu::Simulation::on(&device, &model, &Options::default()).unwrap_err();
    assert!(
        matches!(refused, Error::TooManyLoops { fit: 1024, .. }),
        "{refused}"
    );
}
