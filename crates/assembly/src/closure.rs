//! Closed loops and couplings: what holds bodies together beside the joints of the tree.

use crate::{Body, BodyId, Mimic, Model, ModelDescription, ModelError, validate};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::{HashMap, HashSet};
use vertebra_spatial::Pose;

/// The joint that closes a loop: how the second frame may move against the first. Axes are given in both
/// frames alike, and need not be of unit length.
///
/// | closure | equations | what it keeps |
/// |---|---|---|
/// | weld | 6 | both frames together |
/// | ball | 3 | their origins together |
/// | revolute | 5 | origins, and the axis of one along that of the other |
/// | prismatic | 5 | orientations, and the origins on one line along the axis |
/// | screw | 5 | axes in one line, turning and sliding together |
/// | cylindrical | 4 | axes in one line |
/// | universal | 4 | origins, and the two axes perpendicular |
/// | planar | 3 | the second origin in the plane of the first, normals parallel |
/// | distance | 1 | origins this far apart: a rod with a ball at each end |
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Closure {
    /// No motion.
    Weld,
    /// Turns about a point.
    Ball,
    /// Turns about an axis.
    Revolute {
        /// Direction of the axis.
        axis: DVec3,
    },
    /// Slides along an axis.
    Prismatic {
        /// Direction of the axis.
        axis: DVec3,
    },
    /// Turns about an axis and slides along it in proportion.
    Screw {
        /// Direction of the axis.
        axis: DVec3,
        /// Distance for each radian [m/rad].
        pitch: f64,
    },
    /// Turns about an axis and slides along it.
    Cylindrical {
        /// Direction of the axis.
        axis: DVec3,
    },
    /// Turns about one axis that is fixed in the first frame and one that is fixed in the second.
    Universal {
        /// Direction of the first axis, in the first frame.
        first: DVec3,
        /// Direction of the second axis, in the second frame.
        second: DVec3,
    },
    /// Slides in a plane and turns in it.
    Planar {
        /// Direction of the plane's normal.
        normal: DVec3,
    },
    /// Keeps a distance.
    Distance {
        /// The distance between the origins \[m\].
        length: f64,
    },
}

/// A closed loop as written down: two bodies that another joint connects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopDescription {
    /// Name, unique among loops and couplings.
    pub name: String,
    /// Names of the two bodies; none for the world.
    pub bodies: [Option<String>; 2],
    /// Where the joint's frames are on the bodies.
    pub placements: [Pose; 2],
    /// The joint.
    pub closure: Closure,
}

impl LoopDescription {
    /// Connects two bodies (none for the world) by one more joint.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        bodies: [Option<&str>; 2],
        placements: [Pose; 2],
        closure: Closure,
    ) -> Self {
        Self {
            name: name.into(),
            bodies: bodies.map(|name| name.map(str::to_owned)),
            placements,
            closure,
        }
    }
}

/// A coupling of two joints as written down: q = ratio * q_other + offset, as gears and belts do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CouplingDescription {
    /// Name, unique among loops and couplings.
    pub name: String,
    /// Name of the body whose joint follows.
    pub body: String,
    /// Name of the body whose joint is followed.
    pub other: String,
    /// Ratio of the two positions [rad or m a rad or m].
    pub ratio: f64,
    /// Position where the other is at zero [rad or m].
    pub offset: f64,
}

impl CouplingDescription {
    /// Couples two joints of one freedom each, named by the bodies they carry.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        body: impl Into<String>,
        other: impl Into<String>,
        ratio: f64,
        offset: f64,
    ) -> Self {
        Self {
            name: name.into(),
            body: body.into(),
            other: other.into(),
            ratio,
            offset,
        }
    }
}

/// A closed loop of a [`Model`].
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// Name, unique among loops and couplings.
    pub name: String,
    /// The two bodies; none for the world.
    pub bodies: [Option<BodyId>; 2],
    /// Where the joint's frames are on the bodies.
    pub placements: [Pose; 2],
    /// The joint; its axes have unit length.
    pub closure: Closure,
}

/// A coupling of two joints of a [`Model`] of one freedom each: q = ratio * q_other + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupling {
    /// Name, unique among loops and couplings; of a joint that mimics another, that of its body.
    pub name: String,
    /// The body whose joint follows.
    pub body: BodyId,
    /// The body whose joint is followed.
    pub other: BodyId,
    /// Ratio of the two positions.
    pub ratio: f64,
    /// Position where the other is at zero [rad or m].
    pub offset: f64,
}

impl ModelDescription {
    /// Closes a loop: connects two bodies (none for the world) by one more joint, whose frames are at
    /// `placements` on them.
    ///
    /// ```
    /// use glam::DVec3;
    /// use vertebra_assembly::{Closure, Joint, MassProperties, ModelDescription};
    /// use vertebra_spatial::Pose;
    ///
    /// // A triangle of rods: two hang side by side, and their tips are pinned together.
    /// let rod = MassProperties::rod(1.0, 0.5, 0.01);
    /// let hinge = Joint::revolute(DVec3::Y);
    /// let aside = Pose::from_translation(DVec3::new(0.5, 0.0, 0.0));
    /// let tip = Pose::from_translation(DVec3::new(0.0, 0.0, 0.5));
    /// let model = ModelDescription::new("triangle")
    ///     .body("left", None, hinge.clone(), rod)
    ///     .body("right", None, hinge.at(aside), rod)
    ///     .close("tips", [Some("left"), Some("right")], [tip, tip], Closure::Revolute { axis: DVec3::Y })
    ///     .build()?;
    /// assert_eq!(model.loops().len(), 1);
    /// # Ok::<(), vertebra_assembly::ModelError>(())
    /// ```
    #[must_use]
    pub fn close(
        mut self,
        name: impl Into<String>,
        bodies: [Option<&str>; 2],
        placements: [Pose; 2],
        closure: Closure,
    ) -> Self {
        let closed = LoopDescription::new(name, bodies, placements, closure);
        self.loops.push(closed);
        self
    }

    /// Couples two joints of one freedom each, named by the bodies they carry: q = ratio * q_other + offset.
    #[must_use]
    pub fn couple(
        mut self,
        name: impl Into<String>,
        body: impl Into<String>,
        other: impl Into<String>,
        ratio: f64,
        offset: f64,
    ) -> Self {
        let coupled = CouplingDescription::new(name, body, other, ratio, offset);
        self.couplings.push(coupled);
        self
    }
}

/// Checks loops and couplings, given the bodies' indices by name.
pub(crate) fn check(
    description: &ModelDescription,
    by_name: &HashMap<&str, usize>,
    problems: &mut Vec<ModelError>,
) {
    let mut names = HashSet::new();
    for (index, closed) in description.loops.iter().enumerate() {
        problems.extend(check_name("loop", index, &closed.name, &mut names).err());
        check_loop(closed, by_name, problems);
    }
    for (index, coupling) in description.couplings.iter().enumerate() {
        problems.extend(check_name("coupling", index, &coupling.name, &mut names).err());
        check_coupling(description, coupling, by_name, problems);
    }
}

fn check_loop(
    closed: &LoopDescription,
    by_name: &HashMap<&str, usize>,
    problems: &mut Vec<ModelError>,
) {
    let is_self = closed.bodies[0] == closed.bodies[1];
    for body in closed.bodies.iter().skip(usize::from(is_self)).flatten() {
        problems.extend(known(&closed.name, body, by_name).err());
    }
    if is_self {
        problems.push(ModelError::SelfLoop {
            name: closed.name.clone(),
        });
    }
    check_places(&closed.name, &closed.placements, problems);
    check_closure(&closed.name, &closed.closure, problems);
}

/// Checks where the frames of a loop are on its bodies.
pub(crate) fn check_places(name: &str, placements: &[Pose; 2], problems: &mut Vec<ModelError>) {
    let quantities = [
        "placement on the first body",
        "placement on the second body",
    ];
    for (quantity, placement) in quantities.into_iter().zip(placements) {
        problems.extend(validate::check_placement(quantity, name, placement).err());
    }
}

fn check_coupling(
    description: &ModelDescription,
    coupling: &CouplingDescription,
    by_name: &HashMap<&str, usize>,
    problems: &mut Vec<ModelError>,
) {
    let name = &coupling.name;
    problems.extend(validate::finite("coupling ratio", name, coupling.ratio).err());
    problems.extend(validate::finite("coupling offset", name, coupling.offset).err());
    let bodies = [&coupling.body, &coupling.other];
    let is_self = bodies[0] == bodies[1];
    for body in bodies.into_iter().skip(usize::from(is_self)) {
        let found = known(name, body, by_name);
        let freedoms = found.map(|index| description.bodies[index].joint.kind.dof_count());
        match freedoms {
            Ok(1) => {}
            Ok(freedoms) => problems.push(ModelError::CoupledFreedoms {
                name: name.clone(),
                body: body.clone(),
                freedoms,
            }),
            Err(unknown) => problems.push(unknown),
        }
    }
    if is_self {
        problems.push(ModelError::SelfLoop { name: name.clone() });
    }
}

fn check_name<'a>(
    what: &'static str,
    index: usize,
    name: &'a str,
    names: &mut HashSet<&'a str>,
) -> Result<(), ModelError> {
    validate::check_name(what, index, name)?;
    if names.insert(name) {
        return Ok(());
    }
    Err(ModelError::DuplicateName {
        name: name.to_owned(),
    })
}

fn known(user: &str, body: &str, by_name: &HashMap<&str, usize>) -> Result<usize, ModelError> {
    (by_name.get(body).copied()).ok_or_else(|| ModelError::UnknownBody {
        user: user.into(),
        body: body.into(),
        meant: None,
    })
}

pub(crate) fn check_closure(name: &str, closure: &Closure, problems: &mut Vec<ModelError>) {
    let mut note = |checked: Result<(), ModelError>| problems.extend(checked.err());
    let is_axis = |axis: DVec3| validate::check_axis("axis of a closure", name, axis);
    match *closure {
        Closure::Weld | Closure::Ball => {}
        Closure::Revolute { axis }
        | Closure::Prismatic { axis }
        | Closure::Cylindrical { axis }
        | Closure::Planar { normal: axis } => note(is_axis(axis)),
        Closure::Screw { axis, pitch } => {
            note(validate::finite("pitch", name, pitch));
            note(is_axis(axis));
        }
        Closure::Universal { first, second } => {
            note(is_axis(first));
            note(is_axis(second));
        }
        Closure::Distance { length } => note(check_length(name, length)),
    }
}

fn check_length(name: &str, length: f64) -> Result<(), ModelError> {
    validate::finite("distance", name, length)?;
    if length > 0.0 {
        return Ok(());
    }
    Err(ModelError::OutOfRange {
        quantity: "distance",
        element: name.into(),
        value: length,
        requirement: "above zero; a ball keeps two points together",
    })
}

impl Closure {
    /// Whether both frames may be at one place, up to what is rounded off axes that are written down.
    pub(crate) fn lets_frames_coincide(&self) -> bool {
        match *self {
            Self::Distance { .. } => false,
            Self::Universal { first, second } => {
                let [first, second] = [first, second].map(validate::unit_axis);
                first.dot(second).abs() <= 1e-6
            }
            _ => true,
        }
    }

    /// The same with axes of unit length.
    pub(crate) fn normalized(self) -> Self {
        let unit = validate::unit_axis;
        match self {
            Self::Weld | Self::Ball | Self::Distance { .. } => self,
            Self::Revolute { axis } => Self::Revolute { axis: unit(axis) },
            Self::Prismatic { axis } => Self::Prismatic { axis: unit(axis) },
            Self::Cylindrical { axis } => Self::Cylindrical { axis: unit(axis) },
            Self::Planar { normal } => Self::Planar {
                normal: unit(normal),
            },
            Self::Screw { axis, pitch } => Self::Screw {
                axis: unit(axis),
                pitch,
            },
            Self::Universal { first, second } => Self::Universal {
                first: unit(first),
                second: unit(second),
            },
        }
    }
}

/// Loops and couplings of a checked description, the couplings of joints that mimic others last.
pub(crate) fn resolve(
    loops: Vec<LoopDescription>,
    couplings: Vec<CouplingDescription>,
    find: impl Fn(&str) -> Option<BodyId>,
) -> (Vec<Loop>, Vec<Coupling>) {
    let loops = loops.into_iter().map(|written| Loop {
        bodies: written.bodies.map(|body| body.and_then(|name| find(&name))),
        placements: written.placements.map(|placement| Pose {
            rotation: validate::unit_rotation(placement.rotation),
            ..placement
        }),
        closure: written.closure.normalized(),
        name: written.name,
    });
    let couplings = couplings.into_iter().filter_map(|written| {
        Some(Coupling {
            body: find(&written.body)?,
            other: find(&written.other)?,
            ratio: written.ratio,
            offset: written.offset,
            name: written.name,
        })
    });
    (loops.collect(), couplings.collect())
}

/// The loops and couplings that are left when bodies become others, by their new ids; none of
/// bodies that are gone, nor of joints that no longer have one freedom.
pub(crate) fn carried_over(
    (loops, couplings): (Vec<Loop>, Vec<Coupling>),
    ids: &[Option<BodyId>],
    bodies: &[Body],
) -> (Vec<Loop>, Vec<Coupling>) {
    let find = |id: BodyId| ids[id.index()];
    let loops = loops.into_iter().filter_map(|closed| {
        let mut bodies = [None; 2];
        for (new, old) in bodies.iter_mut().zip(closed.bodies) {
            *new = match old {
                Some(old) => Some(find(old)?),
                None => None,
            };
        }
        Some(Loop { bodies, ..closed })
    });
    let couplings = couplings.into_iter().filter_map(|coupling| {
        let (body, other) = (find(coupling.body)?, find(coupling.other)?);
        let single = |id: BodyId| bodies[id.index()].joint.kind.dof_count() == 1;
        (single(body) && single(other)).then_some(Coupling {
            body,
            other,
            ..coupling
        })
    });
    (loops.collect(), couplings.collect())
}

impl Model {
    /// The loops that further joints close. [`Simulation`] keeps them, on the CPU and on a GPU; algorithms that
    /// would give accelerations of the tree alone refuse them unless told to.
    ///
    /// [`Simulation`]: https://docs.rs/vertebra-dynamics
    #[must_use]
    pub fn loops(&self) -> &[Loop] {
        &self.inner.loops
    }

    /// The couplings of joints, those of joints that mimic others included.
    pub fn couplings(&self) -> impl Iterator<Item = Coupling> + '_ {
        let mimics = self.body_ids().filter_map(|id| {
            let (mimic, other) = self.followed(id)?;
            Some(Coupling {
                name: self.bodies()[id.index()].name.clone(),
                body: id,
                other,
                ratio: mimic.multiplier,
                offset: mimic.offset,
            })
        });
        self.inner.couplings.iter().cloned().chain(mimics)
    }

    /// How a body's joint mimics another and whose, if both have one freedom and are two.
    pub(crate) fn followed(&self, id: BodyId) -> Option<(&Mimic, BodyId)> {
        let mimic = self.bodies()[id.index()].joint.mimic.as_ref()?;
        let other = self.find(&mimic.body)?;
        let single = |id: BodyId| self.bodies()[id.index()].joint.kind.dof_count() == 1;
        (single(id) && single(other) && id != other).then_some((mimic, other))
    }
}
