//! A motion-captured character walks, driven by motors in its joints, then lets go: from there on it is a ragdoll
//! that falls to the floor, its joints within their ranges.

#![expect(clippy::print_stdout, reason = "an example shows what it did")]

mod support;

use support::Scene;
use vertebra::files::bvh::{self, Options};
use vertebra::files::{Part, Shape};
use vertebra::glam::{DQuat, DVec3};
use vertebra::{
    BallRange, BodyId, JointKind, Model, Precision, Simulation, SphericalMotor, State, Workspace,
    Wrench, forward_kinematics,
};

/// Time step \[s\].
const STEP: f64 = 1e-3;
/// When it lets go \[s\].
const TRIPS: f64 = 0.5;
/// Stiffness [N/m] and damping [N s/m] of the floor, per place that touches.
const FLOOR: [f64; 2] = [6e4, 400.0];
/// How fast limbs follow the motion [rad/s].
const FIRMNESS: f64 = 25.0;
/// How fast the hips do, by forces that a step takes as they are at its start [rad/s].
const LEAD: f64 = 6.0;
/// Square of about how far from a joint the mass is that it carries \[m^2\].
const ARM: f64 = 0.1;
/// The same of what turns with the hips \[m^2\].
const HIPS: f64 = 0.01;
/// Standard gravity [m/s^2].
const GRAVITY: f64 = 9.81;

/// How far joints go: what swings is the bone's axis, down or to a side.
fn range(name: &str) -> BallRange {
    match name {
        "Spine" | "Head" => BallRange::cone_and_twist(DVec3::Y, 0.7, -0.8, 0.8),
        "LeftLeg" | "RightLeg" => BallRange::cone_and_twist(DVec3::Y, 1.6, -0.6, 0.6),
        "LeftArm" | "RightArm" => BallRange::turn(2.0),
        _ => BallRange::turn(1.8),
    }
}

/// The balls at the ends of bones, which are what touches the floor: body, centre in its frame \[m\], radius \[m\].
fn knobs(parts: &[Part]) -> Vec<(BodyId, DVec3, f64)> {
    let bones = parts.iter().filter_map(|part| match part.shape {
        Shape::Capsule { radius, length } => Some((part, radius, 0.5 * length)),
        _ => None,
    });
    let ends = bones.flat_map(|(part, radius, half)| {
        let at = [half, -half].map(|z| part.placement.transform_point(DVec3::Z * z));
        at.map(|at| (part.body, at, radius))
    });
    ends.filter_map(|(body, at, radius)| Some((body?, at, radius)))
        .collect()
}

/// The mass that each body carries, its own included \[kg\].
fn carried(model: &Model) -> Vec<f64> {
    let mut masses: Vec<f64> = model.bodies().iter().map(|body| body.mass.mass).collect();
    for (index, body) in model.bodies().iter().enumerate().rev() {
        if let Some(parent) = body.parent {
            masses[parent.index()] += masses[index];
        }
    }
    masses
}

/// The largest swing or turn of a joint over what its range allows.
fn furthest(state: &State, model: &Model) -> f64 {
    let balls = model.bodies().iter();
    let parts = balls.filter_map(|body| {
        let q = DQuat::from_slice(state.q.get(body.position_range())?.get(..4)?);
        Some(match body.joint.limits?.orientation? {
            BallRange::Turn { angle } => q.angle_between(DQuat::IDENTITY) / angle,
            BallRange::Cone { axis, swing, .. } => (q * axis).angle_between(axis) / swing,
        })
    });
    parts.fold(0.0, f64::max)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // From a file: `bvh::read(path, &options)`.
    let capture = bvh::parse(
        include_str!("../../files/tests/data/walk.bvh"),
        &Options::default(),
    )?;
    let motion = &capture.motion;
    let mut description = capture.model.describe();
    for body in &mut description.bodies {
        if body.joint.kind == JointKind::Spherical {
            // Limp joints still rub [N m s/rad, N m].
            let joint = body.joint.clone().with_damping(0.2).with_friction(0.5);
            body.joint = joint.with_ball_range(range(&body.name));
        }
    }
    let model = description.build()?;
    println!(
        "{} joints, {} frames over {:.2} s; it lets go after {TRIPS} s",
        model.bodies().len(),
        motion.len(),
        motion.duration()
    );
    let masses = carried(&model);
    let gains = |id: BodyId| {
        let inertia = masses[id.index()] * ARM;
        [inertia * FIRMNESS * FIRMNESS, 2.0 * inertia * FIRMNESS]
    };
    let bodies: Vec<_> = model.body_ids().collect();
    let (hips, total) = (bodies[0], masses[0]);
    let mut wanted = motion.state(&model, 0.0)?;
    let mut target = Workspace::new(&model, Precision::F64);
    let knobs = knobs(&capture.parts);
    let scene = Scene::new(&model, capture.parts, [STEP, 1.0 / 30.0], 600)?;

    let mut simulation = Simulation::new(model.clone())?;
    simulation.set_state(wanted.clone())?;
    let begin = simulation.mechanics()?;
    let (mut lags, mut is_limp, mut stretched) = (0.0_f64, false, 0.0_f64);
    scene.run(&mut simulation, |simulation| {
        simulation.forces_mut().clear_external();
        if simulation.time() < TRIPS {
            motion.interpolate(&model, simulation.time(), &mut wanted)?;
            for (body, motor) in bvh::motors(&model, &wanted, gains) {
                simulation.set_spherical_motor(body, motor)?;
            }
            // The hips, which nothing carries, are led by a force and a torque.
            forward_kinematics(&model, &wanted, &mut target)?;
            let (to, moves) = (target.pose(hips)?, target.velocity(hips)?);
            let (at, goes) = (simulation.pose(hips)?, simulation.velocity(hips)?);
            let pull = (to.translation - at.translation) * (LEAD * LEAD)
                + (moves.linear - goes.linear) * (2.0 * LEAD)
                + DVec3::Z * GRAVITY;
            let turn = (to.rotation * at.rotation.inverse()).to_scaled_axis();
            let turn = turn * (LEAD * LEAD) + (moves.angular - goes.angular) * (2.0 * LEAD);
            let led = Wrench::at_point(pull * total, DVec3::ZERO);
            let led = led.with_torque(turn * (total * HIPS));
            simulation.forces_mut().push(hips, led);
            for body in model.bodies().iter().skip(1) {
                let range = body.position_range();
                let [a, b] = [&simulation.state()?.q, &wanted.q]
                    .map(|q| DQuat::from_slice(&q[range.clone()]));
                lags = lags.max(a.angle_between(b));
            }
            return Ok(());
        }
        if !is_limp {
            is_limp = true;
            for (body, _) in bvh::motors(&model, &wanted, gains) {
                simulation.set_spherical_motor(body, SphericalMotor::OFF)?;
            }
        }
        for &(id, at, radius) in &knobs {
            let (pose, moves) = (simulation.pose(id)?, simulation.velocity(id)?);
            let point = pose.transform_point(at);
            let depth = radius - point.z;
            if depth > 0.0 {
                let speed = moves.linear + moves.angular.cross(point - pose.translation);
                let up = (FLOOR[0] * depth - FLOOR[1] * speed.z).max(0.0);
                let drag = -0.5 * up * speed.with_z(0.0) / (speed.length() + 0.01);
                let force = DVec3::new(drag.x, drag.y, up);
                let sole = at - pose.rotation.inverse() * (DVec3::Z * radius);
                simulation
                    .forces_mut()
                    .push(id, Wrench::at_point(force, sole));
            }
        }
        stretched = stretched.max(furthest(simulation.state()?, &model));
        Ok(())
    })?;
    let end = simulation.mechanics()?;
    println!("driven, its joints are never off those captured by more than {lags:.3} rad");
    println!(
        "at {:.3} s its centre of mass is {:.3} m high, from {:.3} m; joints went to {stretched:.3} of their ranges",
        simulation.time(),
        end.center.z,
        begin.center.z
    );
    Ok(())
}
