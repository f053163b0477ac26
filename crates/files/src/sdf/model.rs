//! A model element: its links, joints and frames, and where they all are.

use super::frames::{Frames, MODEL, Statement, WORLD};
use super::joint::{self, Axis, Joint, Kind};
use super::link::{self, Link};
use super::values::{self, flag};
use crate::{FileError, Problem};
use vertebra_assembly::JointKind;
use vertebra_assembly::xml::{Node, Reader};
use vertebra_spatial::Pose;

/// Elements that may stand in a model.
const KNOWN: [&str; 5] = ["link", "joint", "frame", "pose", "static"];

/// A model element, read.
pub(super) struct Read<'n, 'a> {
    pub(super) links: Vec<Link<'n, 'a>>,
    pub(super) joints: Vec<Joint<'n, 'a>>,
    pub(super) frames: Frames<'n>,
    /// Poses in the world of links, joints and frames, in this order.
    pub(super) places: Vec<Pose>,
    /// Names of `<frame>`s, and the links that carry them.
    pub(super) named: Vec<(&'n str, usize)>,
    pub(super) pose: Pose,
    pub(super) is_static: bool,
    /// Put before all names.
    pub(super) prefix: String,
}

/// Reads a model, names of which get `prefix` before them.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    node: Node<'n, 'a>,
    prefix: String,
) -> Result<Read<'n, 'a>, FileError> {
    let (mut links, mut joints) = (Vec::new(), Vec::new());
    let (mut pose, mut is_static) = (None, false);
    let mut stated_frames = Vec::new();
    reader.ignore_attributes_but(node, &["name", "canonical_link", "placement_frame"]);
    for (tag, child) in reader.children(node)? {
        match tag {
            "link" => links.push(link::read(reader, child)?),
            "joint" => joints.push(joint::read(reader, child)?),
            "frame" => stated_frames.push(child),
            "pose" => reader.once(&mut pose, child)?,
            "static" => {
                let text = values::text(reader, child, "`true` or `false`")?;
                is_static = flag(reader, child, "static", text)?;
            }
            "include" => {
                let problem = Problem::NotExpanded {
                    program: "gz sdf -p",
                };
                return Err(FileError::new(reader.location(child), problem));
            }
            "model" => {
                let place = "<sdf> or a <world>";
                return Err(FileError::new(
                    reader.location(child),
                    Problem::Misplaced { place },
                ));
            }
            _ => reader.ignore_unknown(child, &KNOWN),
        }
    }
    let mut statements = Vec::new();
    for link in &mut links {
        statements.extend(link.stated.take().map(|stated| Statement {
            name: link.name,
            stated,
            usual: None,
            attached_to: None,
            location: reader.location(link.node),
        }));
    }
    for joint in &mut joints {
        statements.extend(joint.stated.take().map(|stated| Statement {
            name: joint.name,
            stated,
            usual: Some(joint.child),
            attached_to: Some(joint.child),
            location: reader.location(joint.node),
        }));
    }
    let canonical = canonical_link(reader, node, &links)?;
    let mut named = Vec::new();
    for frame in stated_frames {
        reader.ignore_attributes_but(frame, &["name", "attached_to"]);
        let name = reader.text(frame, "name")?;
        let [pose] = reader.only(frame, ["pose"])?;
        let attached_to = reader
            .optional_text(frame, "attached_to")?
            .filter(|name| !name.is_empty());
        named.push((name, statements.len()));
        statements.push(Statement {
            name,
            stated: values::pose(reader, pose)?,
            usual: attached_to,
            // The model's own frame moves with its canonical link.
            attached_to: attached_to.filter(|&name| name != MODEL).or(canonical),
            location: reader.location(frame),
        });
    }
    let stated = values::pose(reader, pose)?;
    if let Some(name) = stated.relative_to.filter(|&name| name != WORLD) {
        return Err(unknown(reader, node, ("frame of the world", name), [WORLD]));
    }
    let frames = Frames::new(statements)?;
    let places = frames.resolve()?;
    let placed = match reader.optional_text(node, "placement_frame")? {
        None | Some("" | MODEL) => Pose::IDENTITY,
        Some(name) => match frames.find(name) {
            Some(frame) => places[frame],
            None => return Err(unknown(reader, node, ("frame", name), frames.names())),
        },
    };
    let pose = stated.pose * placed.inverse();
    Ok(Read {
        links,
        joints,
        places: places.into_iter().map(|place| pose * place).collect(),
        frames,
        named,
        pose,
        is_static,
        prefix,
    })
}

/// The link that the model's own frame moves with: the first, unless another is named.
fn canonical_link<'n, 'a>(
    reader: &Reader<'a>,
    node: Node<'n, 'a>,
    links: &[Link<'n, 'a>],
) -> Result<Option<&'n str>, FileError> {
    match reader.optional_text(node, "canonical_link")? {
        None | Some("") => Ok(links.first().map(|link| link.name)),
        Some(name) if links.iter().any(|link| link.name == name) => Ok(Some(name)),
        Some(name) => {
            let names = links.iter().map(|link| link.name);
            Err(unknown(reader, node, ("link", name), names))
        }
    }
}

fn unknown<'k>(
    reader: &Reader<'_>,
    node: Node<'_, '_>,
    (what, name): (&'static str, &str),
    known: impl IntoIterator<Item = &'k str>,
) -> FileError {
    FileError::new(reader.location(node), Problem::unknown(what, name, known))
}

impl Read<'_, '_> {
    /// The link that a name of a joint means: itself, or what carries the frame of that name; none
    /// for the world.
    pub(super) fn link(
        &self,
        reader: &Reader<'_>,
        joint: &Joint<'_, '_>,
        name: &str,
    ) -> Result<Option<usize>, FileError> {
        if name == WORLD {
            return Ok(None);
        }
        let names = || self.links.iter().map(|link| link.name);
        let unknown = || unknown(reader, joint.node, ("link", name), names());
        let carrier = self
            .frames
            .carrier(self.frames.find(name).ok_or_else(unknown)?)?;
        match carrier < self.links.len() {
            true => Ok(Some(carrier)),
            false => Err(unknown()),
        }
    }

    /// Where the link that a name means is in the world.
    pub(super) fn place_of_link(&self, name: &str) -> Pose {
        let link = self
            .frames
            .find(name)
            .and_then(|frame| self.frames.carrier(frame).ok());
        link.map_or(Pose::IDENTITY, |link| self.places[link])
    }

    /// The motion of a joint, axes in the joint's frame, and the second one of two hinges.
    pub(super) fn kinds(
        &self,
        reader: &Reader<'_>,
        index: usize,
    ) -> Result<(JointKind, Option<JointKind>), FileError> {
        let joint = &self.joints[index];
        let own = self.places[self.links.len() + index].rotation;
        let axis = |axis: &Axis<'_, '_>| {
            let frame = match axis.expressed_in {
                None => return Ok(axis.direction),
                Some(name) if name == MODEL => self.pose.rotation,
                Some(name) => match self.frames.find(name) {
                    Some(frame) => self.places[frame].rotation,
                    None => {
                        let names = self.frames.names();
                        return Err(unknown(reader, joint.node, ("frame", name), names));
                    }
                },
            };
            Ok(own.conjugate() * (frame * axis.direction))
        };
        let [first, second] = &joint.axes;
        Ok(match joint.kind {
            Kind::Fixed => (JointKind::Fixed, None),
            Kind::Ball => (JointKind::Spherical, None),
            Kind::Revolute => (JointKind::Revolute { axis: axis(first)? }, None),
            Kind::Prismatic => (JointKind::Prismatic { axis: axis(first)? }, None),
            Kind::Screw(pitch) => (
                JointKind::Screw {
                    axis: axis(first)?,
                    pitch,
                },
                None,
            ),
            Kind::TwoHinges => (
                JointKind::Revolute { axis: axis(first)? },
                Some(JointKind::Revolute {
                    axis: axis(second)?,
                }),
            ),
        })
    }
}
