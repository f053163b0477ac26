//! Machines of wild models: what acts in their joints, motors, closed loops and couplings.

use core::f64::consts::PI;
use vertebra::glam::DVec3;
use vertebra::{
    BallRange, BodyId, Closure, Error, Joint, JointKind, Model, Motor, Pose, Precision, Random,
    SphericalMotor, Spring, State, Stop, Workspace, body_poses, forward_kinematics,
};

use super::wild::{placement_of, rarely, wide};

/// Loops and couplings at most, of each.
const TIES: usize = 3;

/// A model with elements and loops, and the motors in its joints. Its coordinates are those of the model that it was made of.
#[derive(Debug)]
pub(super) struct Machine {
    /// The model.
    pub(super) model: Model,
    /// Motors by the bodies whose joints they drive.
    pub(super) motors: Vec<(BodyId, Motor)>,
    /// Those of spherical joints.
    pub(super) spherical: Vec<(BodyId, SphericalMotor)>,
}

impl Machine {
    /// Makes one of a bare model; most of its loops are closed in the state.
    ///
    /// # Errors
    /// What the builder refuses, and what has no poses.
    pub(super) fn new(bare: &Model, state: &State, random: &mut Random) -> Result<Self, Error> {
        let units = bare.units();
        let mut description = bare.describe();
        // Steps of second order and more have no friction nor stops.
        let is_smooth = rarely(random, 2);
        for body in &mut description.bodies {
            let strength = match body.joint.kind {
                JointKind::Prismatic { .. } => units.force() / units.length,
                _ => units.energy(),
            };
            elements(&mut body.joint, strength, is_smooth, random);
        }
        let names: Vec<String> = description
            .bodies
            .iter()
            .map(|body| body.name.clone())
            .collect();
        let poses = poses(bare, state)?;
        for index in 0..random.below(TIES + 1) {
            let ends = [random.below(names.len()), random.below(names.len())];
            let to_world = rarely(random, 3);
            let place = poses[ends[0]] * placement_of(random, units.length);
            let mut places = [place; 2];
            let closure = closure(random, units.length);
            if let Closure::Distance { length } = closure {
                places[1].translation += random.direction() * length;
            }
            if rarely(random, 6) {
                places[1] = placement_of(random, units.length);
            }
            let other = (!to_world).then_some(ends[1]);
            let bodies = [
                Some(names[ends[0]].as_str()),
                other.map(|end| names[end].as_str()),
            ];
            let frames = [
                poses[ends[0]].inverse() * places[0],
                other.map_or(places[1], |end| poses[end].inverse() * places[1]),
            ];
            description = description.close(format!("loop-{index}"), bodies, frames, closure);
        }
        let single: Vec<(&str, usize)> = (names.iter().zip(bare.bodies()))
            .filter(|(_, body)| body.dof_range().len() == 1)
            .map(|(name, body)| (name.as_str(), body.position_range().start))
            .collect();
        for index in 0..random.below(TIES) {
            if single.len() < 2 {
                break;
            }
            let [(one, one_at), (other, other_at)] =
                [(); 2].map(|()| single[random.below(single.len())]);
            let ratio = random.symmetric() * wide(random, 2.0);
            let offset = if rarely(random, 6) {
                random.symmetric()
            } else {
                state.q[one_at] - ratio * state.q[other_at]
            };
            description = description.couple(format!("gear-{index}"), one, other, ratio, offset);
        }
        let model = description.build()?;
        let (mut motors, mut spherical) = (Vec::new(), Vec::new());
        for (id, body) in model.body_ids().zip(model.bodies()) {
            if body.dof_range().len() == 1 && rarely(random, 3) {
                motors.push((id, motor(units.energy(), random)));
            }
            if body.joint.kind == JointKind::Spherical && rarely(random, 3) {
                spherical.push((id, spherical_motor(units.energy(), random)));
            }
        }
        Ok(Self {
            model,
            motors,
            spherical,
        })
    }
}

/// Each with the odds of one in three, over many decades about what suits the model.
fn elements(joint: &mut Joint, strength: f64, is_smooth: bool, random: &mut Random) {
    let some = |random: &mut Random| {
        let size = strength * wide(random, 6.0);
        if rarely(random, 3) { size } else { 0.0 }
    };
    let freedoms = joint.kind.dof_count();
    if !matches!(freedoms, 1 | 3) {
        return;
    }
    joint.damping = some(random);
    joint.armature = some(random);
    let stiffness = some(random);
    if stiffness > 0.0 {
        joint.spring = Some(match freedoms {
            1 => Spring::at(stiffness, random.symmetric()),
            _ => Spring::turned(stiffness, random.rotation()),
        });
    }
    if !is_smooth {
        joint.friction = some(random);
        if rarely(random, 3) {
            *joint = if freedoms == 1 {
                let (lower, upper) = (-random.unit(), random.unit() * wide(random, 3.0));
                joint.clone().with_range(lower, upper)
            } else {
                joint.clone().with_ball_range(ball_range(random))
            };
            joint.stop = match random.below(3) {
                0 => Stop::Soft {
                    stiffness: strength * wide(random, 6.0),
                    damping: strength * wide(random, 6.0),
                },
                1 => Stop::Hard {
                    restitution: random.unit(),
                },
                _ => Stop::HARD,
            };
        }
    }
}

fn ball_range(random: &mut Random) -> BallRange {
    let most = PI * random.unit();
    match random.below(3) {
        0 => BallRange::turn(most),
        1 => BallRange::cone(random.direction(), most),
        _ => {
            let [one, other] = [(); 2].map(|()| PI * random.symmetric());
            BallRange::cone_and_twist(random.direction(), most, one.min(other), one.max(other))
        }
    }
}

fn closure(random: &mut Random, length: f64) -> Closure {
    let axis = if rarely(random, 3) {
        DVec3::Z
    } else {
        random.direction()
    };
    match random.below(9) {
        0 => Closure::Distance {
            length: length * wide(random, 2.0),
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
            pitch: length * random.symmetric(),
        },
        _ => Closure::Weld,
    }
}

fn motor(strength: f64, random: &mut Random) -> Motor {
    let size = strength * wide(random, 6.0);
    let motor = match random.below(3) {
        0 => Motor::torque(size * random.symmetric()),
        1 => Motor::velocity(wide(random, 3.0), size),
        _ => Motor::position(random.symmetric(), size, size * random.unit()),
    };
    if rarely(random, 2) {
        motor.limited(strength * wide(random, 3.0))
    } else {
        motor
    }
}

fn spherical_motor(strength: f64, random: &mut Random) -> SphericalMotor {
    let size = strength * wide(random, 6.0);
    let motor = match random.below(3) {
        0 => SphericalMotor::torque(random.direction() * size),
        1 => SphericalMotor::velocity(random.direction() * wide(random, 3.0), size),
        _ => SphericalMotor::orientation(random.rotation(), size, size * random.unit()),
    };
    if rarely(random, 2) {
        motor.limited(strength * wide(random, 3.0))
    } else {
        motor
    }
}

/// Where bodies are.
fn poses(model: &Model, state: &State) -> Result<Vec<Pose>, Error> {
    let mut workspace = Workspace::new(model, Precision::F64);
    forward_kinematics(model, state, &mut workspace)?;
    body_poses(&mut workspace)?;
    model.body_ids().map(|body| workspace.pose(body)).collect()
}
