//! Models put together in sentences: body after body, parts repeated, mirrored, and inserted many times.
//!
//! A [`Builder`] stands on a body, or in the world, and every body is added where it stands: "from the
//! palm, a chain of three". It collects what is wrong and goes on, so that [`build`](Builder::build) can
//! say all of it at once.
//!
//! ```
//! use glam::DVec3;
//! use vertebra_assembly::{Builder, Joint, BodyShape};
//! use vertebra_spatial::Pose;
//!
//! let tip = |length: f64| Pose::from_translation(DVec3::new(0.0, 0.0, length));
//! let bone = BodyShape::capsule(0.008, 0.04).placed(&tip(0.02));
//! let finger = Builder::new("finger")
//!     .chain("bone", 3, Joint::revolute(DVec3::X).with_range(0.0, 1.6), bone, tip(0.04))
//!     .tag("fingertip");
//!
//! let hand = Builder::new("hand")
//!     .body("palm", Joint::free(), BodyShape::cuboid(DVec3::new(0.08, 0.02, 0.1)).of_mass(0.4))
//!     .repeat(4, |hand, index| {
//!         let at = DVec3::new(0.02 * f64::from(index) - 0.03, 0.0, 0.05);
//!         hand.attach(&format!("finger {index}"), &finger, Pose::from_translation(at))
//!     })
//!     .build()?;
//! assert_eq!(hand.model.bodies().len(), 1 + 4 * 3);
//! assert_eq!(hand.tagged("fingertip").len(), 4);
//! assert!(hand.model.find("finger 2/bone-0").is_some());
//! # Ok::<(), vertebra_assembly::BuildError>(())
//! ```

mod closure;
mod curve;
mod error;
mod mesh;
mod mirror;
mod shape;

pub use curve::Centerline;
pub use error::{BuildError, Problem};
pub use shape::{BodyShape, SolidError};

use crate::description::STANDARD_GRAVITY;
use crate::{
    BodyId, Compound, CouplingDescription, FrameDescription, LoopDescription, MassProperties,
    Model, ModelDescription, spelling, validate,
};
use glam::{DQuat, DVec3};
use mirror::Mirror;
use std::collections::HashMap;
use vertebra_spatial::Pose;

/// What a body is made of: mass properties that are known, or a [`BodyShape`].
#[derive(Clone, Debug, PartialEq)]
pub enum Matter {
    /// Mass, centre and inertia as given.
    Given(MassProperties),
    /// A solid of uniform density.
    BodyShape(BodyShape),
}

impl From<MassProperties> for Matter {
    fn from(mass: MassProperties) -> Self {
        Self::Given(mass)
    }
}

impl From<BodyShape> for Matter {
    fn from(solid: BodyShape) -> Self {
        Self::BodyShape(solid)
    }
}

impl Matter {
    pub(crate) fn mass_properties(&self) -> Result<MassProperties, SolidError> {
        match self {
            Self::Given(mass) => Ok(*mass),
            Self::BodyShape(solid) => solid.mass_properties(),
        }
    }
}

/// A body with its joint.
#[derive(Clone, Debug)]
struct Part {
    name: String,
    parent: Option<String>,
    joint: Compound,
    mass: MassProperties,
    tags: Vec<String>,
    joint_name: Option<String>,
}

/// A model in the making; see the [module](self).
#[derive(Clone, Debug)]
pub struct Builder {
    name: String,
    gravity: DVec3,
    parts: Vec<Part>,
    frames: Vec<FrameDescription>,
    loops: Vec<LoopDescription>,
    couplings: Vec<CouplingDescription>,
    /// Index of each name.
    by_name: HashMap<String, usize>,
    /// The part it stands on; none for the world.
    at: Option<usize>,
    problems: Vec<Problem>,
}

/// A model that was built, and its tags.
#[derive(Clone, Debug)]
pub struct Built {
    /// The model.
    pub model: Model,
    tags: HashMap<String, Vec<BodyId>>,
    joints: HashMap<String, BodyId>,
}

impl Built {
    /// The bodies with a tag, in the order in which they were added.
    #[must_use]
    pub fn tagged(&self, tag: &str) -> &[BodyId] {
        self.tags.get(tag).map_or(&[], Vec::as_slice)
    }

    /// The body that a named joint carries.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<BodyId> {
        self.joints.get(name).copied()
    }
}

impl Builder {
    /// An empty model under standard gravity, 9.81 m/s^2 along -z; the builder stands in the world.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            gravity: STANDARD_GRAVITY,
            parts: Vec::new(),
            frames: Vec::new(),
            loops: Vec::new(),
            couplings: Vec::new(),
            by_name: HashMap::new(),
            at: None,
            problems: Vec::new(),
        }
    }

    /// Sets gravity, in world axes [m/s^2].
    #[must_use]
    pub const fn gravity(mut self, gravity: DVec3) -> Self {
        self.gravity = gravity;
        self
    }

    /// Goes to a body that was added before.
    #[must_use]
    pub fn from(mut self, body: &str) -> Self {
        match self.by_name.get(body) {
            Some(&part) => self.at = Some(part),
            None => {
                // Each hint takes a look at all bodies.
                let names = self.parts.iter().map(|part| part.name.as_str());
                let is_among_first = self.problems.len() < validate::HINTS;
                let meant = is_among_first.then(|| spelling::nearest(body, names));
                self.problems.push(Problem::UnknownBody {
                    meant: meant.flatten().map(Box::from),
                    body: body.into(),
                });
            }
        }
        self
    }

    /// Goes to the world.
    #[must_use]
    pub const fn from_world(mut self) -> Self {
        self.at = None;
        self
    }

    /// Adds a body where the builder stands and goes to it.
    #[must_use]
    pub fn body(
        mut self,
        name: impl Into<String>,
        joint: impl Into<Compound>,
        matter: impl Into<Matter>,
    ) -> Self {
        let name = name.into();
        let mass = self.mass_of(&name, &matter.into());
        let parent = self.at.map(|part| self.parts[part].name.clone());
        self.push(Part {
            name,
            parent,
            joint: joint.into(),
            mass,
            tags: Vec::new(),
            joint_name: None,
        });
        self
    }

    fn push(&mut self, part: Part) {
        self.at = Some(self.parts.len());
        self.by_name
            .entry(part.name.clone())
            .or_insert(self.parts.len());
        self.parts.push(part);
    }

    /// The mass of what a body is made of, or, with the problem noted, one that makes no further ones.
    fn mass_of(&mut self, body: &str, matter: &Matter) -> MassProperties {
        matter.mass_properties().unwrap_or_else(|source| {
            self.problems.push(Problem::BodyShape {
                body: body.to_owned(),
                source,
            });
            MassProperties::sphere(1.0, 1.0)
        })
    }

    /// The part the builder stands on; in the world there is none, which is noted.
    fn here(&mut self, verb: &'static str) -> Option<&mut Part> {
        if self.at.is_none() {
            self.problems.push(Problem::InTheWorld { verb });
        }
        self.parts.get_mut(self.at?)
    }

    /// Gives the joint of the body here a name of its own, by which [`Built::joint`] finds it.
    #[must_use]
    pub fn joint_named(mut self, name: impl Into<String>) -> Self {
        if let Some(part) = self.here("name a joint") {
            part.joint_name = Some(name.into());
        }
        self
    }

    /// Tags the body here; [`Built::tagged`] finds all bodies with a tag.
    #[must_use]
    pub fn tag(mut self, tag: impl Into<String>) -> Self {
        if let Some(part) = self.here("tag a body") {
            part.tags.push(tag.into());
        }
        self
    }

    /// Makes more matter, given in its frame, part of the body here.
    #[must_use]
    pub fn weld(mut self, matter: impl Into<Matter>) -> Self {
        let name = self.at.map(|part| self.parts[part].name.clone());
        let mass = self.mass_of(&name.unwrap_or_default(), &matter.into());
        if let Some(part) = self.here("weld something") {
            part.mass = part.mass.combined(&mass);
        }
        self
    }

    /// Adds a named place on the body here, or in the world.
    #[must_use]
    pub fn frame(mut self, name: impl Into<String>, placement: Pose) -> Self {
        self.frames.push(FrameDescription {
            name: name.into(),
            body: self.at.map(|part| self.parts[part].name.clone()),
            placement,
        });
        self
    }

    /// Does something so many times; `part` is told how often it was done before.
    #[must_use]
    pub fn repeat(self, count: u32, part: impl FnMut(Self, u32) -> Self) -> Self {
        (0..count).fold(self, part)
    }

    /// Does something and comes back to where the builder stands now.
    #[must_use]
    pub fn branch(self, part: impl FnOnce(Self) -> Self) -> Self {
        let at = self.at;
        let mut done = part(self);
        done.at = at;
        done
    }

    /// Adds a chain of like bodies `name-0`, `name-1`, ..., and goes to the last. The first is where its
    /// joint says; each other one is so placed at `step` in the frame of the one before.
    #[must_use]
    pub fn chain(
        mut self,
        name: &str,
        count: usize,
        joint: impl Into<Compound>,
        matter: impl Into<Matter>,
        step: Pose,
    ) -> Self {
        if count == 0 {
            self.problems.push(Problem::NoLinks {
                name: name.to_owned(),
            });
            return self;
        }
        let joints = joint.into().into_joints();
        let mass = self.mass_of(name, &matter.into());
        for index in 0..count {
            let joint = Compound::new(joints.iter().cloned());
            let joint = if index == 0 { joint } else { joint.at(step) };
            self = self.body(format!("{name}-{index}"), joint, mass);
        }
        self
    }

    /// Adds a helix: a [`chain`](Self::chain) of links along z, each bent about x and twisted about z against the
    /// one before. `winding` is the length of a link \[m\], the bend and the twist \[rad\].
    #[must_use]
    pub fn helix(
        mut self,
        name: &str,
        count: usize,
        joint: impl Into<Compound>,
        matter: impl Into<Matter>,
        winding: (f64, f64, f64),
    ) -> Self {
        let (length, bend, twist) = winding;
        let bad = if !(length.is_finite() && length > 0.0) {
            Some(("length of a link", length))
        } else {
            let angles = [("bend", bend), ("twist", twist)];
            angles.into_iter().find(|(_, angle)| !angle.is_finite())
        };
        if let Some((what, value)) = bad {
            self.problems.push(Problem::BadHelix {
                name: name.to_owned(),
                what,
                value,
            });
            // One that makes no further problems.
            return self.chain(name, count, joint, matter, Pose::IDENTITY);
        }
        let half = |angle: f64| (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
        let ((sx, cx), (sz, cz)) = (half(bend), half(twist));
        let turn = DQuat::from_xyzw(0.0, 0.0, sz, cz) * DQuat::from_xyzw(sx, 0.0, 0.0, cx);
        let step = Pose::new(turn, DVec3::new(0.0, 0.0, length));
        self.chain(name, count, joint, matter, step)
    }

    /// Adds a strand of links `name-0`, `name-1`, ... of equal length along a curve given in the frame of
    /// the body here, and goes to the last. Each link starts on the curve with z along itself; `matter`
    /// makes one of its length \[m\].
    #[must_use]
    pub fn along_curve<M: Into<Matter>>(
        mut self,
        name: &str,
        curve: &Centerline,
        count: usize,
        joint: impl Into<Compound>,
        mut matter: impl FnMut(f64) -> M,
    ) -> Self {
        let Some(links) = curve.links(count) else {
            self.problems.push(Problem::NoStrand {
                name: name.to_owned(),
            });
            return self;
        };
        let joints = joint.into().into_joints();
        let mut before = Pose::IDENTITY;
        for (index, (frame, length)) in links.into_iter().enumerate() {
            let joint = Compound::new(joints.iter().cloned()).at(before.inverse() * frame);
            self = self.body(format!("{name}-{index}"), joint, matter(length));
            before = frame;
        }
        self
    }

    /// Inserts another builder's bodies, frames, loops and couplings, all names with `prefix/` before them,
    /// where this one stands, the other's world at `placement`. The builder stays where it is.
    #[must_use]
    pub fn attach(self, prefix: &str, other: &Self, placement: Pose) -> Self {
        self.insert(prefix, other, placement, None)
    }

    /// The same for the mirror image of the other in the plane through its world's origin across `normal`.
    ///
    /// Joints of one freedom, and rows of them, move as the mirror image at the same coordinates. A mirror reverses
    /// turns, so that of spherical and free joints some signs change: with n the unit normal and
    /// m(v) = v - 2 (n · v) n, the x, y, z of quaternions, angular velocities and torques become -m(v), positions,
    /// linear velocities and forces m(v). Across y that is the sign of x and z of the former and of y of the latter.
    #[must_use]
    pub fn mirror(mut self, prefix: &str, other: &Self, normal: DVec3, placement: Pose) -> Self {
        match Mirror::new(normal) {
            Some(mirror) => self.insert(prefix, other, placement, Some(&mirror)),
            None => {
                self.problems.push(Problem::NoPlane {
                    prefix: prefix.to_owned(),
                });
                self
            }
        }
    }

    fn insert(
        mut self,
        prefix: &str,
        other: &Self,
        placement: Pose,
        mirror: Option<&Mirror>,
    ) -> Self {
        let at = self.at;
        let here = at.map(|part| self.parts[part].name.clone());
        let renamed = |name: &String| format!("{prefix}/{name}");
        self.problems.extend(other.problems.iter().cloned());
        for part in &other.parts {
            let joint = part.joint.clone();
            let joint = match mirror {
                Some(mirror) => mirror.compound(joint),
                None => Compound::new(joint.into_joints()),
            };
            let joint = joint.map(|mut joint| {
                if let Some(mimic) = &mut joint.mimic {
                    mimic.body = renamed(&mimic.body);
                }
                joint
            });
            let (parent, joint) = match &part.parent {
                Some(parent) => (Some(renamed(parent)), joint),
                None => (here.clone(), joint.at(placement)),
            };
            self.push(Part {
                name: renamed(&part.name),
                parent,
                joint,
                mass: mirror.map_or(part.mass, |mirror| mirror.mass(&part.mass)),
                tags: part.tags.clone(),
                joint_name: part.joint_name.as_ref().map(renamed),
            });
        }
        for frame in &other.frames {
            let own = mirror.map_or(frame.placement, |mirror| mirror.pose(&frame.placement));
            let (body, placement) = match &frame.body {
                Some(body) => (Some(renamed(body)), own),
                None => (here.clone(), placement * own),
            };
            self.frames.push(FrameDescription {
                name: renamed(&frame.name),
                body,
                placement,
            });
        }
        self.at = at;
        self.insert_closures(prefix, other, placement, mirror);
        self
    }

    /// The model as plain data, problems or not.
    #[must_use]
    pub fn describe(&self) -> ModelDescription {
        let mut description = ModelDescription::new(&self.name).gravity(self.gravity);
        for part in &self.parts {
            let joint = part.joint.clone();
            description = description.body(&part.name, part.parent.as_deref(), joint, part.mass);
        }
        description.frames = self.frames.clone();
        description.loops = self.loops.clone();
        description.couplings = self.couplings.clone();
        description
    }

    /// Checks everything and makes it a model.
    ///
    /// # Errors
    /// [`BuildError`] with every problem there is, as [`ModelDescription::problems`] lists them, and those of the
    /// sentences themselves.
    pub fn build(self) -> Result<Built, BuildError> {
        let description = self.describe();
        let mut problems = self.problems;
        problems.extend(description.problems().into_iter().map(Problem::Model));
        let mut joints = HashMap::new();
        for part in &self.parts {
            if let Some(name) = &part.joint_name
                && joints.insert(name.clone(), &part.name).is_some()
            {
                problems.push(Problem::DuplicateJoint { name: name.clone() });
            }
        }
        let refused = |problems| BuildError {
            model: self.name.clone(),
            problems,
        };
        if !problems.is_empty() {
            return Err(refused(problems));
        }
        let built = description.build();
        let model = built.map_err(|error| refused(vec![Problem::Model(error)]))?;
        let mut tags: HashMap<String, Vec<BodyId>> = HashMap::new();
        for part in &self.parts {
            if let Some(id) = model.find(&part.name) {
                for tag in &part.tags {
                    tags.entry(tag.clone()).or_default().push(id);
                }
            }
        }
        let joints = joints.into_iter();
        let joints = joints.filter_map(|(name, body)| Some((name, model.find(body)?)));
        Ok(Built {
            joints: joints.collect(),
            tags,
            model,
        })
    }
}
