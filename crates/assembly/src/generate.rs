//! Generated models: chains, helices, trees. Seeded ones are the same on every machine.

use crate::{
    BallRange, Compound, Joint, JointKind, MassProperties, Model, ModelDescription, ModelError,
    Spring, Stop, random::Random, validate,
};
use glam::{DQuat, DVec3};
use vertebra_spatial::Pose;

/// The rod that generated models are made of: a cylinder along z, carried at one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rod {
    /// Mass \[kg\].
    pub mass: f64,
    /// Length \[m\].
    pub length: f64,
    /// Radius \[m\].
    pub radius: f64,
}

impl Rod {
    /// A rod of 1 kg and the given length \[m\], ten times as long as thick.
    #[must_use]
    pub const fn with_length(length: f64) -> Self {
        Self {
            mass: 1.0,
            length,
            radius: 0.05 * length,
        }
    }

    fn mass_properties(&self) -> MassProperties {
        MassProperties::rod(self.mass, self.length, self.radius)
    }

    /// Where the next rod is carried: the far end.
    fn tip(&self) -> Pose {
        Pose::from_translation(DVec3::new(0.0, 0.0, self.length))
    }
}

impl Default for Rod {
    /// 1 kg, 1 m.
    fn default() -> Self {
        Self::with_length(1.0)
    }
}

/// A chain of `count` rods hanging from the world, every joint the same.
///
/// # Errors
/// [`ModelError`] if `count` is zero or above what indices can count, or the joint or
/// rod is impossible.
pub fn chain(count: usize, joint: &Joint, rod: &Rod) -> Result<Model, ModelError> {
    grow("chain", count, rod, |index, placement| {
        Grown::on(index.checked_sub(1), joint.clone().at(placement))
    })
}

/// A chain of `count` rods with revolute joints about random axes: the benchmark of the source.
///
/// # Errors
/// [`ModelError`] if `count` is zero or above what indices can count, or the rod is impossible.
pub fn random_chain(count: usize, rod: &Rod, seed: u64) -> Result<Model, ModelError> {
    let mut random = Random::new(seed);
    grow("random-chain", count, rod, |index, placement| {
        let joint = Joint::revolute(random.direction()).at(placement);
        Grown::on(index.checked_sub(1), joint)
    })
}

/// How masses are spread over the bodies of a chain or tree, as multiples of a rod's mass: the
/// patterns that tell algorithms apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Masses {
    /// All alike.
    Equal,
    /// Bodies that carry no others are this many times as heavy.
    HeavyTips(f64),
    /// The last body, which carries no other, is this many times as heavy.
    HeavyLast(f64),
    /// The first body is this many times as heavy.
    HeavyBase(f64),
    /// Every other body is this many times as light.
    Alternating(f64),
    /// Random, evenly on a logarithmic scale over so many decades about 1.
    Decades(f64),
    /// Every eighth body has this mass.
    EveryEighth(f64),
}

impl Masses {
    fn of(&self, index: usize, count: usize, is_tip: bool, random: &mut Random) -> f64 {
        match *self {
            Self::HeavyTips(ratio) if is_tip => ratio,
            Self::HeavyLast(ratio) if index + 1 == count => ratio,
            Self::HeavyBase(ratio) if index == 0 => ratio,
            Self::Alternating(ratio) if index % 2 == 1 => 1.0 / ratio,
            Self::Decades(decades) => libm::exp10(0.5 * decades * random.symmetric()),
            Self::EveryEighth(mass) if index % 8 == 4 => mass,
            _ => 1.0,
        }
    }
}

/// A tree of rods of uneven masses with revolute joints about random axes. Every body is carried by
/// one of the `reach` bodies before it: 1 makes a chain.
///
/// # Errors
/// [`ModelError`] if `count` or `reach` is zero, `count` is above what indices can count, or the rod
/// or a mass is impossible.
pub fn uneven_tree(
    count: usize,
    reach: usize,
    rod: &Rod,
    masses: &Masses,
    seed: u64,
) -> Result<Model, ModelError> {
    if reach == 0 {
        return Err(ModelError::BadParameter {
            parameter: "reach",
            requirement: "at least 1",
        });
    }
    validate::check_count(count)?;
    let mut random = Random::new(seed);
    let parents: Vec<_> = (0..count)
        .map(|index| (index > 0).then(|| index - 1 - random.below(reach.min(index))))
        .collect();
    let mut is_tip = vec![true; count];
    for &parent in parents.iter().flatten() {
        is_tip[parent] = false;
    }
    grow("uneven-tree", count, rod, |index, placement| Grown {
        parent: parents[index],
        joint: Joint::revolute(random.direction()).at(placement),
        mass: masses.of(index, count, is_tip[index], &mut random),
    })
}

/// A model with the masses and inertias of its bodies multiplied by a pattern.
///
/// # Errors
/// [`ModelError`] if a mass becomes impossible, or joints are left that move nothing.
pub fn weighted(model: &Model, masses: &Masses, seed: u64) -> Result<Model, ModelError> {
    let mut random = Random::new(seed);
    let count = model.bodies().len();
    let mut is_tip = vec![true; count];
    for parent in model.bodies().iter().filter_map(|body| body.parent) {
        is_tip[parent.index()] = false;
    }
    let mut description = model.describe();
    for (index, body) in description.bodies.iter_mut().enumerate() {
        let times = masses.of(index, count, is_tip[index], &mut random);
        body.mass.mass *= times;
        body.mass.inertia *= times;
    }
    description.build()
}

/// A chain coiled to a helix: each rod is bent by `bend` about x and twisted by `twist` about z
/// \[rad\] against the one before; the joints turn about x.
///
/// # Errors
/// [`ModelError`] if `count` is zero or above what indices can count, or the rod or an
/// angle is impossible.
pub fn helix(count: usize, rod: &Rod, bend: f64, twist: f64) -> Result<Model, ModelError> {
    let half = |angle: f64| (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
    let ((sx, cx), (sz, cz)) = (half(bend), half(twist));
    let turn = DQuat::from_xyzw(0.0, 0.0, sz, cz) * DQuat::from_xyzw(sx, 0.0, 0.0, cx);
    grow("helix", count, rod, |index, placement| {
        let rotation = if index == 0 { DQuat::IDENTITY } else { turn };
        let joint = Joint::revolute(DVec3::X).at(Pose::new(rotation, placement.translation));
        Grown::on(index.checked_sub(1), joint)
    })
}

/// A tree in which every rod carries `branching` others, spread evenly about its axis and leaning
/// 45 degrees outward; joints turn about x and y in turn.
///
/// # Errors
/// [`ModelError`] if `count` or `branching` is zero, `count` is above what indices can
/// count, or the rod is impossible.
pub fn tree(count: usize, branching: usize, rod: &Rod) -> Result<Model, ModelError> {
    if branching == 0 {
        return Err(ModelError::BadParameter {
            parameter: "branching",
            requirement: "at least 1",
        });
    }
    grow("tree", count, rod, |index, placement| {
        let axis = if index % 2 == 0 { DVec3::X } else { DVec3::Y };
        let Some(above) = index.checked_sub(1) else {
            return Grown::on(None, Joint::revolute(axis));
        };
        #[expect(
            clippy::cast_precision_loss,
            reason = "an angle: the nearest f64 will do"
        )]
        let azimuth = core::f64::consts::TAU * (above % branching) as f64 / branching as f64;
        let lean = if branching == 1 {
            0.0
        } else {
            core::f64::consts::FRAC_PI_4
        };
        let (sin, cos) = (libm::sin(0.5 * lean), libm::cos(0.5 * lean));
        let rotation =
            DQuat::from_xyzw(sin * libm::cos(azimuth), sin * libm::sin(azimuth), 0.0, cos);
        let joint = Joint::revolute(axis).at(Pose::new(rotation, placement.translation));
        Grown::on(Some(above / branching), joint)
    })
}

/// What a random tree is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RandomTree {
    /// Number of bodies.
    pub count: usize,
    /// A body's parent is one of this many bodies before it: 1 is a chain, `count` a bush.
    pub reach: usize,
    /// Whether the first body floats freely.
    pub floating: bool,
    /// Whether all kinds of joints occur, or only revolute ones.
    pub mixed: bool,
    /// How many side by side; the bodies are shared out in blocks.
    pub articulations: usize,
}

impl RandomTree {
    /// One fixed-base tree of `count` bodies with mixed joints, half chain, half bush.
    #[must_use]
    pub const fn mixed(count: usize) -> Self {
        Self {
            count,
            reach: 4,
            floating: false,
            mixed: true,
            articulations: 1,
        }
    }
}

/// A random tree, or a forest of them: random placements, inertias, centres of mass and joints.
///
/// # Errors
/// [`ModelError`] if `count`, `reach` or `articulations` is zero or `count` is above what indices
/// can count.
pub fn random_tree(tree: &RandomTree, seed: u64) -> Result<Model, ModelError> {
    for (parameter, value) in [("reach", tree.reach), ("articulations", tree.articulations)] {
        if value == 0 {
            return Err(ModelError::BadParameter {
                parameter,
                requirement: "at least 1",
            });
        }
    }
    validate::check_count(tree.count)?;
    let mut random = Random::new(seed);
    let block = tree.count.div_ceil(tree.articulations).max(1);
    let mut description = ModelDescription::new("random-tree");
    for index in 0..tree.count {
        let within = index % block;
        let parent = (within > 0).then(|| index - 1 - random.below(tree.reach.min(within)));
        let mut joint = random_joint(&mut random, tree.mixed);
        if parent.is_none() && tree.floating {
            joint = Joint::free();
        }
        let joint = joint
            .at(random_pose(&mut random, 0.5))
            .on_child(random_pose(&mut random, 0.2));
        let mass = random_mass(&mut random);
        let parent = parent.map(name);
        description = description.body(name(index), parent.as_deref(), joint, mass);
    }
    description.build()
}

/// A random tree of `count` bodies on joints of every kind there is: those of [`random_tree`], screws,
/// cylindrical, universal and planar joints. With `elements` most joints but free and fixed ones have some: damping,
/// friction, a rotor, a spring, a range with a hard or a soft stop.
///
/// # Errors
/// [`ModelError`] if `count` is zero or above what indices can count.
pub fn random_mechanism(count: usize, elements: bool, seed: u64) -> Result<Model, ModelError> {
    validate::check_count(count)?;
    let mut random = Random::new(seed);
    // Apart, so that all else is as it is without them.
    let mut of_balls = Random::new(seed ^ 0x00ba_1100);
    let mut description = ModelDescription::new("random-mechanism");
    for index in 0..count {
        let parent = (index > 0).then(|| name(index - 1 - random.below(index.min(3))));
        let (axis, other) = (random.direction(), random.direction());
        let mut joint = match random.below(6) {
            0 => Compound::from(Joint::screw(axis, 0.2 * random.symmetric())),
            1 => Joint::cylindrical(axis),
            2 => Joint::universal(axis, axis.cross(other).normalize()),
            3 => Joint::planar(axis.cross(other).normalize(), axis),
            _ => random_joint(&mut random, true).into(),
        };
        if elements {
            joint = joint.map(|joint| with_elements(joint, &mut random));
            joint = joint.map(|joint| with_ball_laws(joint, &mut of_balls));
        }
        let joint = joint
            .at(random_pose(&mut random, 0.5))
            .on_child(random_pose(&mut random, 0.2));
        let mass = random_mass(&mut random);
        description = description.body(name(index), parent.as_deref(), joint, mass);
    }
    description.build()
}

/// Elements that suit the joint, each with the odds of a coin.
fn with_elements(mut joint: Joint, random: &mut Random) -> Joint {
    let freedoms = joint.kind.dof_count();
    if !matches!(freedoms, 1 | 3) {
        return joint;
    }
    if random.below(2) == 0 {
        joint.damping = random.unit();
    }
    if random.below(2) == 0 {
        joint.armature = random.unit();
    }
    if random.below(2) == 0 {
        let stiffness = 20.0 * random.unit();
        joint.spring = Some(match freedoms {
            1 => Spring::at(stiffness, random.symmetric()),
            _ => Spring::turned(stiffness, random.rotation()),
        });
    }
    if freedoms == 1 && random.below(2) == 0 {
        joint.friction = random.unit();
    }
    if freedoms == 1 && random.below(2) == 0 {
        joint = joint.with_range(-random.unit(), random.unit());
        joint.stop = match random.below(3) {
            0 => Stop::Soft {
                stiffness: 1e3 * random.unit(),
                damping: random.unit(),
            },
            1 => Stop::Hard {
                restitution: random.unit(),
            },
            _ => Stop::HARD,
        };
    }
    joint
}

/// Friction and a range of some kind in a spherical joint, each with the odds of a coin.
fn with_ball_laws(mut joint: Joint, random: &mut Random) -> Joint {
    if joint.kind != JointKind::Spherical {
        return joint;
    }
    if random.below(2) == 0 {
        joint.friction = random.unit();
    }
    if random.below(2) == 0 {
        return joint;
    }
    let (axis, most) = (random.direction(), 0.2 + random.unit());
    let range = match random.below(3) {
        0 => BallRange::turn(most),
        1 => BallRange::cone(axis, most),
        _ => BallRange::cone_and_twist(axis, most, -random.unit(), random.unit()),
    };
    let stop = match random.below(3) {
        0 => Stop::Soft {
            stiffness: 1e2 * random.unit(),
            damping: random.unit(),
        },
        1 => Stop::Hard {
            restitution: random.unit(),
        },
        _ => Stop::HARD,
    };
    joint.with_ball_range(range).with_stop(stop)
}

fn random_joint(random: &mut Random, mixed: bool) -> Joint {
    let axis = random.direction();
    match if mixed { random.below(8) } else { 0 } {
        4 => Joint::prismatic(axis),
        5 => Joint::spherical(),
        6 => Joint::free(),
        7 => Joint::fixed(),
        _ => Joint::revolute(axis),
    }
}

fn random_pose(random: &mut Random, reach: f64) -> Pose {
    Pose::new(
        random.rotation(),
        random.direction() * (reach * random.unit()),
    )
}

/// A box of 0.1 to 1.1 kg with edges of 0.1 to 0.4 m, placed anyhow.
fn random_mass(random: &mut Random) -> MassProperties {
    let mut edge = || 0.1 + 0.3 * random.unit();
    let size = DVec3::new(edge(), edge(), edge());
    let mass = 0.1 + random.unit();
    MassProperties::cuboid(mass, size).placed(&random_pose(random, 0.3))
}

fn name(index: usize) -> String {
    format!("body-{index}")
}

/// One more rod.
struct Grown {
    parent: Option<usize>,
    joint: Joint,
    /// Times the mass of the rod.
    mass: f64,
}

impl Grown {
    const fn on(parent: Option<usize>, joint: Joint) -> Self {
        Self {
            parent,
            joint,
            mass: 1.0,
        }
    }
}

fn grow(
    model: &str,
    count: usize,
    rod: &Rod,
    mut grown: impl FnMut(usize, Pose) -> Grown,
) -> Result<Model, ModelError> {
    for (parameter, value) in [
        ("length", rod.length),
        ("radius", rod.radius),
        ("mass", rod.mass),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(ModelError::BadParameter {
                parameter,
                requirement: "finite and above zero",
            });
        }
    }
    validate::check_count(count)?;
    let mut description = ModelDescription::new(model);
    for index in 0..count {
        let placement = if index == 0 {
            Pose::IDENTITY
        } else {
            rod.tip()
        };
        let Grown {
            parent,
            joint,
            mass,
        } = grown(index, placement);
        let mass = Rod {
            mass: rod.mass * mass,
            ..*rod
        };
        let parent = parent.map(name);
        description = description.body(
            name(index),
            parent.as_deref(),
            joint,
            mass.mass_properties(),
        );
    }
    description.build()
}
