//! Models by themselves: what is known to be hard for algorithms, beyond masses.
//!
//! Straight, coiled and folded chains are those of R. Featherstone, "A Divide-and-Conquer
//! Articulated-Body Algorithm for Parallel O(log(n)) Calculation of Rigid-Body Dynamics. Part 2: Trees,
//! Loops, and Accuracy" (IJRR 18(9), 1999), tapered ones his `autoTree` (spatial_v2, 2015).

use core::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI};

use vertebra::generate::{self, Masses, Rod};
use vertebra::glam::{DMat3, DQuat, DVec3};
use vertebra::{
    Error, Forces, Joint, MassProperties, Model, ModelDescription, ModelError, Pose, Precision,
    Random, State, Workspace, rnea,
};

/// What is hard about a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hard {
    /// All axes parallel, at rest: the largest condition number there is for a number of bodies.
    Straight,
    /// A plane coil of five turns.
    Coil,
    /// Folded into a ball, where whatever is measured along the chain has the least to do with space.
    Ball,
    /// A tree that carries smaller copies of itself, 2^k bodies.
    Dill,
    /// Lengths go on by this factor, inertias with the cube of it, over nine decades of length at most.
    Taper(f64),
    /// The same on a tree in which every body carries two.
    TaperedTree(f64),
    /// Rods a ten-thousandth as thick as long, every other one turning about itself.
    SpinningRods,
    /// Every other body has no mass: universal joints.
    Universal,
    /// Three hinges at one place with nothing between, the middle one so near to locking \[rad\].
    Gimbal(f64),
    /// Pairs of equal axes at one place, between them a millionth of the mass.
    DuplicateAxes,
    /// Pairs of bodies carried at one place.
    ZeroLength,
    /// Lengths over six decades, a mass in proportion.
    Lengths,
    /// The base 10 km from the origin.
    Far,
    /// A body more, or a thousand: no whole number of chunks nor a power of two.
    OneMore,
    /// A plumb chain, at rest under its weight alone.
    Hanging,
    /// A tree in any position, whose joint forces hold it at rest but for their rounding.
    Held,
}

/// Decades of length that a taper spans at most.
const SPAN: f64 = 9.0;

/// Factors by which a model makes errors larger than those of plain ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lost {
    /// Of a solution.
    pub(crate) solution: f64,
    /// Of what f32 joins add to that.
    pub(crate) joins: f64,
    /// Of what one correction of the recursion leaves.
    pub(crate) recursion: f64,
    /// Of what one correction over f32 joins leaves.
    pub(crate) once: f64,
    /// Of what two corrections leave.
    pub(crate) twice: f64,
    /// By how much the forces that f32 joins on a GPU round exceed those that accelerate anything.
    pub(crate) carried: f64,
}

impl Lost {
    /// No digit.
    pub(crate) const NOTHING: Self = Self {
        solution: 1.0,
        joins: 1.0,
        recursion: 1.0,
        once: 1.0,
        twice: 1.0,
        carried: 1.0,
    };
}

impl Hard {
    /// A model of about so many bodies.
    ///
    /// # Errors
    /// If there are none.
    pub(super) fn model(self, bodies: usize, seed: u64) -> Result<Model, Error> {
        let mut random = Random::new(seed);
        let rod = Rod::default();
        let on_tip = |length: f64| Pose::from_translation(DVec3::Z * length);
        let mut list = List::new();
        match self {
            Self::Straight => {
                for index in 0..bodies {
                    let tip = on_tip(rod.length).for_root(index);
                    list.push(before(index), Joint::revolute(DVec3::X).at(tip), mass(&rod));
                }
            }
            Self::Coil => {
                let a = 1.0 / real(bodies);
                for index in 0..bodies {
                    let place = link(a, 5.0 * PI / real(bodies)).for_root(index);
                    let mass = slender(a, a, 0.01);
                    list.push(before(index), Joint::revolute(DVec3::Z).at(place), mass);
                }
            }
            Self::Ball => {
                for index in 0..bodies {
                    let place = link(0.1, FRAC_PI_2).for_root(index);
                    let mass = slender(0.1, 0.1, 0.01);
                    list.push(before(index), Joint::revolute(DVec3::Z).at(place), mass);
                }
            }
            Self::Dill => list.dill(bodies.max(1).ilog2(), None, Pose::IDENTITY),
            Self::Taper(ratio) | Self::TaperedTree(ratio) => {
                let branching = if matches!(self, Self::Taper(_)) { 1 } else { 2 };
                let least = SPAN.copysign(libm::log10(ratio)) / libm::log10(ratio);
                let length = |index: usize| libm::pow(ratio, real(index).min(least));
                for index in 0..bodies {
                    let parent = index.checked_sub(1).map(|above| above / branching);
                    let reach = parent.map_or(0.0, length);
                    let turn = DQuat::from_rotation_x(FRAC_PI_3);
                    let place = Pose::new(turn, DVec3::X * reach);
                    let size = length(index);
                    let mass = slender(size * size * size, size, 0.005_f64.sqrt() * size);
                    list.push(parent, Joint::revolute(DVec3::Z).at(place), mass);
                }
            }
            Self::SpinningRods => {
                let thin = Rod {
                    radius: 1e-4,
                    ..rod
                };
                for index in 0..bodies {
                    let axis = if index % 2 == 0 {
                        random.direction()
                    } else {
                        DVec3::Z
                    };
                    let tip = on_tip(thin.length).for_root(index);
                    list.push(before(index), Joint::revolute(axis).at(tip), mass(&thin));
                }
            }
            Self::Universal => {
                for index in 0..bodies {
                    let (axis, mass) = if index % 2 == 0 && index + 1 < bodies {
                        (DVec3::X, MassProperties::MASSLESS)
                    } else {
                        (DVec3::Y, mass(&rod))
                    };
                    // The rod hangs from the cross at its place; the cross from a rod's tip.
                    let on_cross = index % 2 == 1;
                    let place = if on_cross {
                        Pose::IDENTITY
                    } else {
                        on_tip(rod.length).for_root(index)
                    };
                    list.push(before(index), Joint::revolute(axis).at(place), mass);
                }
            }
            Self::Gimbal(_) => {
                for index in 0..bodies {
                    let axis = [DVec3::X, DVec3::Y, DVec3::X][index % 3];
                    let inner = index % 3 != 2 && index + 1 < bodies;
                    let mass = if inner {
                        MassProperties::MASSLESS
                    } else {
                        mass(&rod)
                    };
                    let place = if index % 3 == 0 {
                        on_tip(rod.length).for_root(index)
                    } else {
                        Pose::IDENTITY
                    };
                    list.push(before(index), Joint::revolute(axis).at(place), mass);
                }
            }
            Self::DuplicateAxes => {
                let mut axis = DVec3::X;
                for index in 0..bodies {
                    let second = index % 2 == 1;
                    if !second {
                        axis = random.direction();
                    }
                    let light = Rod { mass: 1e-6, ..rod };
                    let last = index + 1 == bodies;
                    let mass = mass(if second || last { &rod } else { &light });
                    let place = if second {
                        Pose::IDENTITY
                    } else {
                        on_tip(rod.length).for_root(index)
                    };
                    list.push(before(index), Joint::revolute(axis).at(place), mass);
                }
            }
            Self::ZeroLength => {
                for index in 0..bodies {
                    let place = if index % 2 == 1 {
                        Pose::IDENTITY
                    } else {
                        on_tip(rod.length).for_root(index)
                    };
                    let joint = Joint::revolute(random.direction()).at(place);
                    list.push(before(index), joint, mass(&rod));
                }
            }
            Self::Lengths => {
                let mut reach = 0.0;
                for index in 0..bodies {
                    let length = libm::exp10(3.0 * random.symmetric());
                    let own = Rod {
                        mass: length,
                        ..Rod::with_length(length)
                    };
                    let joint = Joint::revolute(random.direction()).at(on_tip(reach));
                    list.push(before(index), joint, mass(&own));
                    reach = length;
                }
            }
            Self::Far => {
                for index in 0..bodies {
                    let place = match index {
                        0 => Pose::from_translation(DVec3::new(1e4, -1e4, 1e4)),
                        _ => on_tip(rod.length),
                    };
                    let joint = Joint::revolute(random.direction()).at(place);
                    list.push(before(index), joint, mass(&rod));
                }
            }
            Self::OneMore => return Ok(generate::random_chain(bodies + 1, &rod, seed)?),
            Self::Hanging => {
                let mut description = generate::random_chain(bodies, &rod, seed)?.describe();
                description.gravity = -description.gravity;
                return Ok(description.build()?);
            }
            Self::Held => {
                return Ok(generate::uneven_tree(
                    bodies,
                    4,
                    &rod,
                    &Masses::Equal,
                    seed,
                )?);
            }
        }
        Ok(list.build()?)
    }

    /// The factors by which this makes errors larger; infinite where not one digit is promised.
    ///
    /// A coil's condition number grows with the square of its length before that of other chains
    /// does. Where a joint is left with a part of the inertia about it (a rod's moment about itself, a
    /// light body between equal axes, a gimbal near lock), the digits of that part are lost. Corrections
    /// bring them back, but for moments that turning a body to world axes has rounded off. At rest errors are measured by
    /// gravity, while joints carry the weight of all bodies beyond.
    pub(crate) fn lost(self, bodies: usize) -> Lost {
        let of = |solution, recursion, once, twice| Lost {
            solution,
            joins: 1.0,
            recursion,
            once,
            twice,
            carried: 1.0,
        };
        match self {
            Self::Coil => {
                let turns = (real(bodies) / 8.0).powi(2);
                Lost {
                    joins: 8.0 * turns,
                    ..of(turns, turns, turns, turns)
                }
            }
            Self::Taper(_) => of(4.0, 4.0, 4.0, 1.0),
            Self::TaperedTree(ratio) if ratio > 1.0 => of(f64::INFINITY, 1e5, 1.0, 1.0),
            Self::SpinningRods => of(1e8, 2e5, 1e5, 1e6),
            Self::Universal => of(4.0, 1.0, 1.0, 2.0),
            Self::Gimbal(short) if short < 1e-4 => {
                of(f64::INFINITY, f64::INFINITY, f64::INFINITY, f64::INFINITY)
            }
            Self::Gimbal(_) => of(1e8, 1.0, 1.0, 4.0),
            Self::DuplicateAxes => of(1e6, 4.0, 1.0, 4.0),
            Self::Lengths => of(4e9, 1e7, 6e4, 32.0),
            Self::Hanging => {
                let some = real(bodies) / 32.0;
                of(1.0, 1.0, some, some)
            }
            Self::Held => {
                let some = real(bodies) / 16.0;
                Lost {
                    carried: 2.0 * some,
                    ..of(real(bodies), some, some, some)
                }
            }
            _ => Lost::NOTHING,
        }
    }

    /// Puts a random state into the position that is hard.
    pub(super) fn pose(self, state: &mut State) {
        let count = state.q.len();
        for (index, q) in state.q.iter_mut().enumerate() {
            *q = match self {
                Self::Straight => 0.0,
                Self::Coil => 10.0 * PI / real(count),
                Self::Ball => match index % 3 {
                    1 => 1.0,
                    2 => -2.0 / 3.0,
                    _ => real(index / 3) / 3.0 % 1.0,
                },
                Self::Gimbal(short) if index % 3 == 1 => short,
                Self::Hanging => 0.0,
                _ => continue,
            };
        }
        if matches!(self, Self::Straight | Self::Hanging | Self::Held) {
            state.qd.fill(0.0);
        }
    }

    /// The joint forces of a model that loads balance on; none of the others.
    ///
    /// # Errors
    /// If numbers overflow.
    pub(super) fn holding(self, model: &Model, state: &State) -> Result<Option<Forces>, Error> {
        let mut forces = Forces::none(model);
        match self {
            Self::Hanging => Ok(Some(forces)),
            Self::Held => {
                let mut workspace = Workspace::new(model, Precision::F64);
                let still = vec![0.0; model.dof_count()];
                let held = rnea(model, state, &still, &forces, &mut workspace)?.to_vec();
                forces.joint = held;
                Ok(Some(forces))
            }
            _ => Ok(None),
        }
    }
}

/// The body before on a chain.
fn before(index: usize) -> Option<usize> {
    index.checked_sub(1)
}

#[expect(clippy::cast_precision_loss, reason = "numbers of bodies")]
fn real(count: usize) -> f64 {
    count as f64
}

fn mass(rod: &Rod) -> MassProperties {
    MassProperties::rod(rod.mass, rod.length, rod.radius)
}

/// Denavit and Hartenberg's link: along x, then turned about it.
fn link(length: f64, twist: f64) -> Pose {
    Pose::new(DQuat::from_rotation_x(twist), DVec3::X * length)
}

/// A cylinder along x from the origin.
fn slender(mass: f64, length: f64, radius: f64) -> MassProperties {
    let across = mass * (3.0 * radius * radius + length * length) / 12.0;
    let along = 0.5 * mass * radius * radius;
    MassProperties {
        mass,
        center: DVec3::X * (0.5 * length),
        inertia: DMat3::from_diagonal(DVec3::new(along, across, across)),
    }
}

trait ForRoot {
    /// The world's origin for the first body.
    fn for_root(self, index: usize) -> Self;
}

impl ForRoot for Pose {
    fn for_root(self, index: usize) -> Self {
        if index == 0 { Self::IDENTITY } else { self }
    }
}

/// Bodies in the order of their numbers.
struct List {
    description: ModelDescription,
}

impl List {
    fn new() -> Self {
        Self {
            description: ModelDescription::new("hard"),
        }
    }

    fn push(&mut self, parent: Option<usize>, joint: Joint, mass: MassProperties) {
        let name = |index: usize| format!("body-{index}");
        let body = name(self.description.bodies.len());
        let description = core::mem::replace(&mut self.description, ModelDescription::new(""));
        self.description = description.body(body, parent.map(name).as_deref(), joint, mass);
    }

    /// A stem with a smaller dill of each order at equal distances along it.
    fn dill(&mut self, order: u32, parent: Option<usize>, at: Pose) {
        let size = f64::from(order.max(1));
        let mass = slender(0.1 * size * size * size, 0.1 * size, 0.01 * size);
        let own = self.description.bodies.len();
        self.push(parent, Joint::revolute(DVec3::Z).at(at), mass);
        for branch in 1..=order {
            let i = f64::from(branch);
            let lift = if branch == order { 0.0 } else { 0.01 * size };
            let turn = DQuat::from_rotation_x(i * FRAC_PI_3);
            let place = Pose::new(turn, DVec3::new(0.1 * i, 0.0, lift));
            self.dill(branch - 1, Some(own), place);
        }
    }

    fn build(self) -> Result<Model, ModelError> {
        self.description.build()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::case::Case;

    #[test]
    fn hard_models_are_what_they_are_called() {
        let bodies = |hard: Hard, count| hard.model(count, 1).unwrap().bodies().len();
        assert_eq!(bodies(Hard::Dill, 32), 32);
        assert_eq!(bodies(Hard::Dill, 100), 64);
        assert_eq!(bodies(Hard::OneMore, 32), 33);
        let tapered = Hard::Taper(0.9).model(400, 1).unwrap();
        let length = |index: usize| 2.0 * tapered.bodies()[index].mass.center.x;
        assert!((length(0) - 1.0).abs() < 1e-15 && (length(1) - 0.9).abs() < 1e-15);
        assert!((length(399) - 1e-9).abs() < 1e-18 && length(399) == length(398));
        let light = Hard::Universal.model(9, 1).unwrap();
        let massless = light.bodies().iter().filter(|body| body.mass.mass == 0.0);
        assert_eq!(massless.count(), 4);
    }

    /// One body, and numbers that are no power of two.
    #[test]
    fn every_case_has_a_problem_of_any_size() {
        for case in Case::all() {
            for bodies in [1, 2, 3, 7, 33] {
                let problem = case.problem(bodies, 1);
                assert!(problem.is_ok(), "{} of {bodies}: {problem:?}", case.name());
            }
        }
    }
}
