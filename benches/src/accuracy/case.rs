//! The cases: chains and trees of rods, with the mass patterns that tell algorithms apart, and models
//! that are hard by themselves.

use super::hard::Hard;
use super::mixed::Mixed;
use vertebra::generate::{self, Masses, Rod};
use vertebra::{Error, Forces, Model, Random, State, Wrench};

/// Gravity, by which forces are measured [m/s^2].
const GRAVITY: f64 = 9.81;

/// What the bodies are and how they move.
#[derive(Clone, Copy, Debug)]
pub struct Pattern {
    /// Name.
    pub name: &'static str,
    /// How the masses are spread.
    pub masses: Masses,
    /// The rod whose mass is multiplied.
    pub rod: Rod,
    /// Largest rate of a joint [rad/s].
    pub rate: f64,
}

/// Rods of 1 kg and 1 m with rates to 1 rad/s.
const fn rods(name: &'static str, masses: Masses) -> Pattern {
    Pattern {
        name,
        masses,
        rod: Rod::with_length(1.0),
        rate: 1.0,
    }
}

const EQUAL: Pattern = rods("equal", Masses::Equal);

/// The patterns of chains and trees.
const PATTERNS: [Pattern; 18] = [
    EQUAL,
    rods("heavy base 1e4", Masses::HeavyBase(1e4)),
    rods("heavy base 1e8", Masses::HeavyBase(1e8)),
    rods("heavy tip 1e4", Masses::HeavyLast(1e4)),
    rods("heavy tip 1e8", Masses::HeavyLast(1e8)),
    rods("light tip 1e-6", Masses::HeavyLast(1e-6)),
    rods("alternating 1e2", Masses::Alternating(1e2)),
    rods("alternating 1e4", Masses::Alternating(1e4)),
    rods("alternating 1e6", Masses::Alternating(1e6)),
    rods("4 decades", Masses::Decades(4.0)),
    rods("8 decades", Masses::Decades(8.0)),
    rods("every eighth 1e-12", Masses::EveryEighth(1e-12)),
    rods("every eighth 1e-16", Masses::EveryEighth(1e-16)),
    rods("every eighth 1e4", Masses::EveryEighth(1e4)),
    Pattern {
        name: "thin",
        rod: Rod {
            mass: 1.0,
            length: 1.0,
            radius: 1e-3,
        },
        ..EQUAL
    },
    Pattern {
        name: "1e3 rad/s",
        rate: 1e3,
        ..EQUAL
    },
    // A nanometre and a picogram: what model units are for.
    Pattern {
        name: "tiny",
        rod: Rod {
            mass: 1e-15,
            length: 1e-9,
            radius: 5e-11,
        },
        ..EQUAL
    },
    // A methylene group on a bond, and what a picosecond does to its angles.
    Pattern {
        name: "molecule",
        rod: Rod {
            mass: 2.3e-26,
            length: 1.5e-10,
            radius: 3e-11,
        },
        rate: 1e12,
        ..EQUAL
    },
];

/// Models that are hard by themselves.
const HARD: [(&str, Hard); 21] = [
    ("straight, at rest", Hard::Straight),
    ("coil", Hard::Coil),
    ("ball", Hard::Ball),
    ("dill", Hard::Dill),
    ("taper 0.9", Hard::Taper(0.9)),
    ("taper 0.98", Hard::Taper(0.98)),
    ("taper 1.02", Hard::Taper(1.02)),
    ("taper 1.1", Hard::Taper(1.1)),
    ("tapered tree 0.9", Hard::TaperedTree(0.9)),
    ("tapered tree 1.1", Hard::TaperedTree(1.1)),
    ("spinning rods", Hard::SpinningRods),
    ("universal joints", Hard::Universal),
    ("gimbals 1e-2 from lock", Hard::Gimbal(1e-2)),
    ("gimbals 1e-6 from lock", Hard::Gimbal(1e-6)),
    ("duplicate axes", Hard::DuplicateAxes),
    ("zero lengths", Hard::ZeroLength),
    ("lengths 1e-3 to 1e3 m", Hard::Lengths),
    ("10 km from the origin", Hard::Far),
    ("a body more", Hard::OneMore),
    ("hanging at rest", Hard::Hanging),
    ("held at rest", Hard::Held),
];

/// Trees and forests on joints of all kinds.
const MIXED: [(&str, Mixed, Masses); 7] = [
    ("on the ground", Mixed::Grounded, Masses::Equal),
    ("floating", Mixed::Floating, Masses::Equal),
    ("forest of 8", Mixed::Forest, Masses::Equal),
    ("all ten joints", Mixed::AllJoints, Masses::Equal),
    (
        "floating, alternating 1e4",
        Mixed::Floating,
        Masses::Alternating(1e4),
    ),
    ("floating, 8 decades", Mixed::Floating, Masses::Decades(8.0)),
    (
        "floating, heavy branch tips 1e4",
        Mixed::Floating,
        Masses::HeavyTips(1e4),
    ),
];

/// Patterns of trees alone: a chain has one tip.
const BRANCHED: [Pattern; 2] = [
    rods("heavy branch tips 1e2", Masses::HeavyTips(1e2)),
    rods("heavy branch tips 1e4", Masses::HeavyTips(1e4)),
];

/// How bodies carry each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Each by the one before.
    Chain,
    /// Each by one of the four before.
    Tree,
    /// As the model wants it.
    Hard(Hard),
    /// Each by one of the four before, on joints of all kinds.
    Mixed(Mixed),
}

impl Shape {
    /// Name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Chain => "chain",
            Self::Tree => "tree",
            Self::Hard(_) => "hard",
            Self::Mixed(_) => "mixed",
        }
    }
}

/// A family of problems: one for each size and seed.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// How bodies carry each other.
    pub shape: Shape,
    /// What they are and how they move.
    pub pattern: Pattern,
}

/// A problem of forward dynamics.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The bodies.
    pub model: Model,
    /// Random positions and rates.
    pub state: State,
    /// Random forces, each about as large as the weight of the body it acts on.
    pub forces: Forces,
}

impl Case {
    /// Every case.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let of = |shape| {
            move |pattern: &Pattern| Self {
                shape,
                pattern: *pattern,
            }
        };
        let chains = PATTERNS.iter().map(of(Shape::Chain));
        let trees = PATTERNS.iter().chain(&BRANCHED).map(of(Shape::Tree));
        let hard = HARD.iter().map(|&(name, hard)| Self {
            shape: Shape::Hard(hard),
            pattern: Pattern { name, ..EQUAL },
        });
        let mixed = MIXED.iter().map(|&(name, mixed, masses)| Self {
            shape: Shape::Mixed(mixed),
            pattern: Pattern {
                name,
                masses,
                ..EQUAL
            },
        });
        chains.chain(trees).chain(hard).chain(mixed).collect()
    }

    /// Name: shape and pattern.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}, {}", self.shape.name(), self.pattern.name)
    }

    /// One problem of the family. No force is larger than its body's weight: a push on a body of
    /// nearly no mass would give it all the acceleration there is, and the others' errors would not
    /// be seen beside it.
    ///
    /// # Errors
    /// If there are no bodies.
    pub fn problem(&self, bodies: usize, seed: u64) -> Result<Problem, Error> {
        let Pattern {
            masses, rod, rate, ..
        } = &self.pattern;
        let model = match self.shape {
            Shape::Chain => generate::uneven_tree(bodies, 1, rod, masses, seed)?,
            Shape::Tree => generate::uneven_tree(bodies, 4, rod, masses, seed)?,
            Shape::Hard(hard) => hard.model(bodies, seed)?,
            Shape::Mixed(mixed) => mixed.model(bodies, masses, seed)?,
        };
        let mut state = State::random(&model, seed);
        state.qd.iter_mut().for_each(|qd| *qd *= rate);
        // How far from its joint a body's weight acts.
        let reach = match self.shape {
            Shape::Chain | Shape::Tree => [rod.length].repeat(bodies),
            Shape::Hard(_) | Shape::Mixed(_) => {
                let bodies = model.bodies().iter();
                bodies.map(|body| body.mass.center.length()).collect()
            }
        };
        if let Shape::Hard(hard) = self.shape {
            hard.pose(&mut state);
            if let Some(forces) = hard.holding(&model, &state)? {
                return Ok(Problem {
                    model,
                    state,
                    forces,
                });
            }
        }
        let mut random = Random::new(seed ^ 0x5eed);
        let mut forces = Forces::none(&model);
        for (body, reach) in model.bodies().iter().zip(reach) {
            let weight = GRAVITY * body.mass.mass;
            for force in &mut forces.joint[body.dof_range()] {
                *force = random.symmetric() * weight * reach;
            }
        }
        let (pushed, body) = {
            let index = random.below(model.bodies().len());
            let pushed = model.body_ids().nth(index);
            (pushed, &model.bodies()[index])
        };
        if let Some(pushed) = pushed {
            let push = random.direction() * (GRAVITY * body.mass.mass);
            forces.push(pushed, Wrench::at_center(push));
        }
        Ok(Problem {
            model,
            state,
            forces,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_problems_differ_by_seed() {
        let cases = Case::all();
        let names: std::collections::BTreeSet<String> = cases.iter().map(Case::name).collect();
        assert_eq!(names.len(), cases.len());
        let case = &cases[0];
        let [one, other] = [1, 2].map(|seed| case.problem(8, seed).unwrap());
        assert_ne!(one.state.q, other.state.q);
        assert_ne!(one.forces.joint, other.forces.joint);
    }
}
