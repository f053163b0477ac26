//! Random mechanisms with closed loops.

use crate::kinematics::{Placed, of_body};
use crate::{Closure, Model, ModelError, Random, State, generate};
use glam::{DQuat, DVec3};
use vertebra_spatial::Pose;

/// A random mechanism of `count` bodies ([`generate::random_mechanism`]) with two closed loops: two of its bodies, and
/// another and the world, are connected as they are, the former by a closure of the seed's kind, the latter by one of one
/// or three equations; every other seed a coupling of two joints. The state has all joints at zero, so that loops are
/// closed, and random rates, which open them: `Simulation::close_loops` takes out what does.
///
/// # Errors
/// [`ModelError`] if `count` is less than 3 or above what indices can count.
///
/// ```
/// use vertebra_assembly::mechanism;
///
/// let (model, state) = mechanism::random(9, true, 4)?;
/// assert_eq!(model.loops().len(), 2);
/// assert_eq!(state.qd.len(), model.dof_count());
/// # Ok::<(), vertebra_assembly::ModelError>(())
/// ```
pub fn random(count: usize, elements: bool, seed: u64) -> Result<(Model, State), ModelError> {
    if count < 3 {
        return Err(ModelError::BadParameter {
            parameter: "count",
            requirement: "at least 3",
        });
    }
    let open = generate::random_mechanism(count, elements, seed)?;
    let mut random = Random::new(seed ^ 0x0010_0095);
    let mut state = State::neutral(&open);
    let poses = poses(&open, &state);
    // Those that carry mass; between the joints of compound ones there are more.
    let named = |index: usize| {
        let name = format!("body-{index}");
        let pose = open.find(&name).map(|id| poses[id.index()]);
        (name, pose.unwrap_or(Pose::IDENTITY))
    };
    let mut description = open.describe();
    for (name, kind, ends) in [
        ("inner", seed % 9, [Some(count - 1), Some(count / 2)]),
        ("outer", seed % 3, [Some(count - 2), None]),
    ] {
        let closure = closure(kind, &mut random);
        let ends = ends.map(|end| end.map(named));
        let here = ends[0].as_ref().map_or(Pose::IDENTITY, |end| end.1);
        let turn = DQuat::from_scaled_axis(vector(&mut random));
        let place = here * Pose::new(turn, 0.3 * vector(&mut random));
        let mut places = [place; 2];
        if let Closure::Distance { length } = closure {
            places[1].translation += length * random.direction();
        }
        let frames = [0, 1].map(|end| match &ends[end] {
            Some((_, pose)) => pose.inverse() * places[end],
            None => places[end],
        });
        let names = [0, 1].map(|end| ends[end].as_ref().map(|end| end.0.as_str()));
        description = description.close(name, names, frames, closure);
    }
    let mut single = (open.bodies().iter()).filter(|body| body.dof_range().len() == 1);
    if let (Some(driver), Some(driven), 1) = (single.next(), single.next_back(), seed % 2) {
        let ratio = 1.5 * random.symmetric();
        description = description.couple("gear", &driven.name, &driver.name, ratio, 0.0);
    }
    state.qd.fill_with(|| 2.0 * random.symmetric());
    Ok((description.build()?, state))
}

/// Where the bodies are in the world.
fn poses(model: &Model, state: &State) -> Vec<Pose> {
    let mut placed: Vec<Placed> = Vec::with_capacity(model.bodies().len());
    for body in model.bodies() {
        let parent = body.parent.map_or(Placed::WORLD, |id| placed[id.index()]);
        placed.push(of_body(&parent, body, state));
    }
    placed.into_iter().map(|body| body.pose).collect()
}

fn vector(random: &mut Random) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| random.symmetric()))
}

/// A closure of one of nine kinds, in any direction.
fn closure(kind: u64, random: &mut Random) -> Closure {
    let axis = random.direction();
    match kind {
        0 => Closure::Distance {
            length: 0.5 + random.unit(),
        },
        1 => Closure::Ball,
        2 => Closure::Planar { normal: axis },
        3 => Closure::Cylindrical { axis },
        4 => Closure::Universal {
            first: axis,
            second: axis.any_orthonormal_vector(),
        },
        5 => Closure::Revolute { axis },
        6 => Closure::Prismatic { axis },
        7 => Closure::Screw {
            axis,
            pitch: 0.2 * random.symmetric(),
        },
        _ => Closure::Weld,
    }
}
