//! Models as unreasonable as the builder lets through, states and forces to match.

use core::f64::consts::FRAC_PI_2;

use vertebra::glam::{DMat3, DQuat, DVec3};
use vertebra::{
    Compound, Error, Forces, Joint, JointKind, MassProperties, Model, ModelDescription, Pose,
    Precision, Random, State, Workspace, Wrench, rnea,
};

use super::machine::Machine;

/// Bodies at most.
const BODIES: usize = 40;

/// A model, and what is asked of it.
#[derive(Debug)]
pub(super) struct Case {
    /// The model.
    pub(super) model: Model,
    /// Positions and rates.
    pub(super) state: State,
    /// Joint forces and a push.
    pub(super) forces: Forces,
    /// Joint accelerations for inverse dynamics.
    pub(super) qdd: Vec<f64>,
    /// A step in time \[s\].
    pub(super) step: f64,
    /// One in three has a machine made of it, unless that is too unreasonable.
    pub(super) machine: Option<Result<Machine, Error>>,
}

/// Scales of one model.
struct Scales {
    length: f64,
    mass: f64,
    /// Decades over which bodies' masses lie.
    spread: f64,
}

impl Case {
    /// The model of a number, the same on every machine.
    ///
    /// # Errors
    /// What the builder refuses.
    pub(super) fn new(seed: u64, number: u64) -> Result<Self, Error> {
        let mut random = Random::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ number);
        let model = model(&mut random)?;
        let mut state = state(&model, &mut random);
        let mut forces = forces(&model, &mut random);
        // Some are held at rest, where loads balance and there is next to no acceleration.
        if number.is_multiple_of(8) {
            state.qd.fill(0.0);
            if let Ok(held) = holding(&model, &state) {
                forces = held;
            }
        }
        let scale = wide(&mut random, 12.0);
        let qdd = (0..model.dof_count())
            .map(|_| random.symmetric() * scale)
            .collect();
        let step = power(random.unit() * -9.0);
        let machine = rarely(&mut random, 3).then(|| Machine::new(&model, &state, &mut random));
        Ok(Self {
            model,
            state,
            forces,
            qdd,
            step,
            machine,
        })
    }
}

fn power(exponent: f64) -> f64 {
    libm::exp10(exponent)
}

/// Evenly over so many decades up and down.
pub(super) fn wide(random: &mut Random, decades: f64) -> f64 {
    power(random.symmetric() * decades)
}

/// One in so many.
pub(super) fn rarely(random: &mut Random, one_in: usize) -> bool {
    random.below(one_in) == 0
}

fn model(random: &mut Random) -> Result<Model, Error> {
    // Few bodies more often than many: combinations are found among few.
    let most = 1 + random.below(BODIES);
    let count = 1 + random.below(most);
    let extreme = if rarely(random, 8) { 12.0 } else { 3.0 };
    let scales = Scales {
        length: wide(random, extreme),
        mass: wide(random, 2.0 * extreme),
        spread: [0.0, 2.0, 8.0, 16.0, 30.0][random.below(5)],
    };
    let gravity = match random.below(4) {
        0 => DVec3::ZERO,
        1 => random.direction() * wide(random, 10.0),
        _ => DVec3::new(0.0, 0.0, -9.81),
    };
    let reach = [1, 1, 2, 4, BODIES][random.below(5)];
    let forest = rarely(random, 6);
    let mixed = random.below(3);
    let mut axis = random.direction();
    let mut description = ModelDescription::new("wild").gravity(gravity);
    for index in 0..count {
        let is_root = index == 0 || (forest && rarely(random, 5));
        let parent = (!is_root).then(|| index - 1 - random.below(reach.min(index)));
        // Axes that repeat are the degenerate joints.
        if !rarely(random, 4) {
            axis = match random.below(4) {
                0 => DVec3::AXES[random.below(3)],
                1 => -DVec3::Z,
                _ => random.direction(),
            };
        }
        let joint = joint(random, axis, mixed)
            .at(placement(random, &scales))
            .on_child(if rarely(random, 3) {
                placement(random, &scales)
            } else {
                Pose::IDENTITY
            });
        let mass = mass(random, &scales);
        let parent = parent.map(|parent| format!("b{parent}"));
        description = description.body(format!("b{index}"), parent.as_deref(), joint, mass);
    }
    Ok(description.build()?)
}

/// Hinges alone, hinges and slides, or all there are.
fn joint(random: &mut Random, axis: DVec3, mixed: usize) -> Compound {
    let across = axis.any_orthonormal_vector();
    match (mixed, random.below(12)) {
        (1 | 2, 0 | 1) => Joint::prismatic(axis).into(),
        (2, 2) => Joint::spherical().into(),
        (2, 3) => Joint::free().into(),
        (2, 4) => Joint::fixed().into(),
        (2, 5) => Joint::screw(axis, random.symmetric()).into(),
        (2, 6) => Joint::cylindrical(axis),
        (2, 7) => Joint::universal(axis, across),
        (2, 8) => Joint::planar(axis, across),
        _ => Joint::revolute(axis).into(),
    }
}

fn placement(random: &mut Random, scales: &Scales) -> Pose {
    placement_of(random, scales.length)
}

/// A place about so far away, or at no distance, or much farther.
pub(super) fn placement_of(random: &mut Random, length: f64) -> Pose {
    let distance = match random.below(8) {
        0 | 1 => 0.0,
        2 => length * 1e4,
        3 => length * wide(random, 6.0),
        _ => length,
    };
    let translation = if rarely(random, 3) {
        DVec3::Z
    } else {
        random.direction()
    };
    let rotation = if rarely(random, 3) {
        DQuat::IDENTITY
    } else {
        random.rotation()
    };
    Pose::new(rotation, translation * distance)
}

fn mass(random: &mut Random, scales: &Scales) -> MassProperties {
    let mass = scales.mass * power(0.5 * scales.spread * random.symmetric());
    let length = scales.length * power(random.symmetric());
    let plain = match random.below(10) {
        0 => return MassProperties::MASSLESS,
        // A point, which turns for nothing.
        1 => MassProperties {
            mass,
            center: random.direction() * length,
            inertia: DMat3::ZERO,
        },
        2 => MassProperties::sphere(mass, length),
        3 => MassProperties::cuboid(mass, DVec3::new(length, length, 0.0)),
        4 => MassProperties::cuboid(mass, DVec3::new(length, 1e-3 * length, 0.1 * length)),
        5 => MassProperties::rod(mass, length, length * power(-8.0 * random.unit())),
        _ => MassProperties::rod(mass, length, 0.05 * length),
    };
    if rarely(random, 3) {
        plain.placed(&placement(random, scales))
    } else {
        plain
    }
}

fn state(model: &Model, random: &mut Random) -> State {
    let mut state = State::random(model, random.below(1 << 30) as u64);
    let at_rest = rarely(random, 4);
    let rates = if rarely(random, 20) {
        power(300.0 * random.unit())
    } else {
        wide(random, 4.0)
    };
    let positions = match random.below(12) {
        0 => 1e6,
        1 => 1e15,
        2 => 1e-12,
        _ => 1.0,
    };
    for body in model.bodies() {
        for q in &mut state.q[body.position_range()] {
            match body.joint.kind {
                JointKind::Spherical | JointKind::Free => {}
                // Aligned and folded: where joints lock.
                _ if rarely(random, 4) => *q = FRAC_PI_2 * [0.0, 1.0, 2.0, -1.0][random.below(4)],
                _ => *q *= positions,
            }
        }
        for qd in &mut state.qd[body.dof_range()] {
            *qd *= if at_rest { 0.0 } else { rates };
        }
    }
    state
}

/// The joint forces that leave a state without acceleration, but for rounding.
fn holding(model: &Model, state: &State) -> Result<Forces, Error> {
    let mut workspace = Workspace::new(model, Precision::F64);
    let mut forces = Forces::none(model);
    let still = vec![0.0; model.dof_count()];
    let held = rnea(model, state, &still, &forces, &mut workspace)?;
    forces.joint = held.to_vec();
    Ok(forces)
}

fn forces(model: &Model, random: &mut Random) -> Forces {
    let mut forces = Forces::none(model);
    if rarely(random, 3) {
        return forces;
    }
    let units = model.units();
    let scale = match random.below(12) {
        0 => power(308.0 * random.unit()),
        1 => power(-300.0 * random.unit()),
        _ => units.force() * wide(random, 4.0),
    };
    for force in &mut forces.joint {
        *force = random.symmetric() * scale;
    }
    let bodies: Vec<_> = model.body_ids().collect();
    for _ in 0..random.below(3) {
        let push = Wrench::at_point(
            random.direction() * scale,
            random.direction() * units.length * wide(random, 3.0),
        );
        forces.push(bodies[random.below(bodies.len())], push);
    }
    forces
}
