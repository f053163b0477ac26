//! From links and joints to bodies.

use super::Import;
use super::frames::{Frames, MODEL, Statement, WORLD};
use super::joint::{self, Axis, Joint, Kind};
use super::link::{self, Link};
use super::values::{self, flag};
use crate::tree::Names;
use crate::{FileError, Part, Problem, Shape};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use vertebra_assembly::xml::{Node, Reader};
use vertebra_assembly::{
    self as assembly, BodyId, JointKind, Location, MassProperties, Model, ModelDescription,
};
use vertebra_spatial::Pose;

/// A joint between two bodies that are joined by others already.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Name of the joint.
    pub name: String,
    /// The parent body; none for the world.
    pub parent: Option<BodyId>,
    /// Where the joint is on it, in its frame.
    pub parent_place: Pose,
    /// The child body; none where the joint carries a part of the world.
    pub child: Option<BodyId>,
    /// Where the joint is on it, in its frame.
    pub child_place: Pose,
    /// The motion it allows.
    pub kind: JointKind,
}

/// What is gathered from model to model.
struct Gathered {
    description: ModelDescription,
    names: Names,
    parts: Vec<(Option<String>, Pose, Shape)>,
    joints: Vec<(String, String)>,
    closures: Vec<(Closure, [Option<String>; 2])>,
    lines: HashMap<String, Location>,
    moves: bool,
}

/// A model element, read.
struct Read<'n, 'a> {
    links: Vec<Link<'n, 'a>>,
    joints: Vec<Joint<'n, 'a>>,
    frames: Frames<'n>,
    /// Poses in the world of links, joints and frames, in this order.
    places: Vec<Pose>,
    /// Names of `<frame>`s, and the links that carry them.
    named: Vec<(&'n str, usize)>,
    pose: Pose,
    is_static: bool,
    /// Put before all names.
    prefix: String,
}

/// All models as one.
pub(super) fn build<'n, 'a>(
    mut reader: Reader<'a>,
    root: Node<'n, 'a>,
    models: &[Node<'n, 'a>],
    gravity: Option<DVec3>,
) -> Result<Import, FileError> {
    let Some(&first) = models.first() else {
        let problem = Problem::Empty("has no <model>; add one");
        return Err(FileError::new(reader.location(root), problem));
    };
    let mut description = ModelDescription::new(reader.text(first, "name")?);
    if let Some(gravity) = gravity {
        description.gravity = gravity;
    }
    let mut gathered = Gathered {
        description,
        names: Names::default(),
        parts: Vec::new(),
        joints: Vec::new(),
        closures: Vec::new(),
        lines: HashMap::new(),
        moves: false,
    };
    for &node in models {
        let prefix = match models.len() {
            1 => String::new(),
            _ => format!("{}::", reader.text(node, "name")?),
        };
        let model = read(&mut reader, node, prefix)?;
        gathered.add(&reader, &model)?;
    }
    if !gathered.moves {
        let problem = Problem::Empty("has no joint and no free link, so that nothing moves");
        return Err(FileError::new(reader.location(root), problem));
    }
    gathered.finish(reader, root)
}

fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    node: Node<'n, 'a>,
    prefix: String,
) -> Result<Read<'n, 'a>, FileError> {
    let (mut links, mut joints) = (Vec::new(), Vec::new());
    let (mut pose, mut is_static) = (None, false);
    let mut stated_frames = Vec::new();
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
            _ => reader.ignore(child),
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
    let mut named = Vec::new();
    for frame in stated_frames {
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
            attached_to,
            location: reader.location(frame),
        });
    }
    let stated = values::pose(reader, pose)?;
    if let Some(name) = stated.relative_to.filter(|&name| name != WORLD) {
        let problem = Problem::UnknownName {
            what: "frame of the world",
            name: name.to_owned(),
        };
        return Err(FileError::new(reader.location(node), problem));
    }
    let frames = Frames::new(statements)?;
    let places = frames
        .resolve()?
        .into_iter()
        .map(|place| stated.pose * place);
    Ok(Read {
        links,
        joints,
        places: places.collect(),
        frames,
        named,
        pose: stated.pose,
        is_static,
        prefix,
    })
}

impl Gathered {
    fn add<'n, 'a>(&mut self, reader: &Reader<'a>, model: &Read<'n, 'a>) -> Result<(), FileError> {
        let body_name = |link: usize| format!("{}{}", model.prefix, model.links[link].name);
        // The first joint that carries a link, and all further ones.
        let mut carriers: Vec<Option<usize>> = vec![None; model.links.len()];
        let mut closing = Vec::new();
        let mut parents = Vec::with_capacity(model.joints.len());
        for (index, joint) in model.joints.iter().enumerate() {
            let child = model.link(reader, joint, joint.child)?;
            parents.push(model.link(reader, joint, joint.parent)?);
            match child {
                Some(child) if carriers[child].is_none() && !model.is_static => {
                    carriers[child] = Some(index);
                }
                _ if model.is_static => {}
                _ => closing.push(index),
            }
        }
        for (index, link) in model.links.iter().enumerate() {
            let body = (!model.is_static).then(|| body_name(index));
            let place = if model.is_static {
                model.places[index]
            } else {
                Pose::IDENTITY
            };
            for (placement, shape) in &link.shapes {
                self.parts
                    .push((body.clone(), place * *placement, shape.clone()));
            }
            let name = body_name(index);
            if !self.names.take(&name) {
                let problem = Problem::DuplicateName { first_line: 0 };
                return Err(FileError::new(reader.location(link.node), problem));
            }
            if model.is_static {
                self.frame(name, None, place);
                continue;
            }
            self.lines.insert(name.clone(), reader.location(link.node));
            match carriers[index] {
                None => {
                    self.moves = true;
                    let joint = assembly::Joint::free().at(model.places[index]);
                    self.body(name, None, joint, link.mass);
                }
                Some(carrier) => {
                    let parent = parents[carrier].map(body_name);
                    self.carried(reader, model, carrier, (index, name), parent)?;
                }
            }
        }
        for (name, frame) in &model.named {
            let carrier = model.frames.carrier(*frame)?;
            let on_link = carrier < model.links.len() && !model.is_static;
            let (body, from) = match on_link {
                true => (Some(body_name(carrier)), model.places[carrier]),
                false => (None, Pose::IDENTITY),
            };
            let name = self.names.fresh(format!("{}{name}", model.prefix));
            self.frame(name, body, from.inverse() * model.places[*frame]);
        }
        for index in closing {
            self.close(reader, model, index, parents[index])?;
        }
        Ok(())
    }

    /// A link on a joint, with a massless body between where the joint has two axes.
    fn carried(
        &mut self,
        reader: &Reader<'_>,
        model: &Read<'_, '_>,
        carrier: usize,
        (link, name): (usize, String),
        parent: Option<String>,
    ) -> Result<(), FileError> {
        let joint = &model.joints[carrier];
        let place = model.places[model.links.len() + carrier];
        let from = match model.frames.find(joint.parent).filter(|_| parent.is_some()) {
            Some(_) => model.place_of_link(joint.parent),
            None => Pose::IDENTITY,
        };
        let (first, second) = model.kinds(reader, carrier)?;
        self.moves |= first != JointKind::Fixed;
        let mut placed = made(first, &joint.axes[0]).at(from.inverse() * place);
        let mut parent = parent;
        if let Some(second) = second {
            let between = self.names.fresh(format!("{name}.1"));
            self.body(between.clone(), parent, placed, MassProperties::MASSLESS);
            parent = Some(between);
            placed = made(second, &joint.axes[1]);
        }
        let placed = placed.on_child(model.places[link].inverse() * place);
        self.joints
            .push((format!("{}{}", model.prefix, joint.name), name.clone()));
        self.body(name, parent, placed, model.links[link].mass);
        Ok(())
    }

    fn close(
        &mut self,
        reader: &Reader<'_>,
        model: &Read<'_, '_>,
        index: usize,
        parent: Option<usize>,
    ) -> Result<(), FileError> {
        let joint = &model.joints[index];
        let place = model.places[model.links.len() + index];
        let child = model.link(reader, joint, joint.child)?;
        let seen = |link: Option<usize>| {
            link.map_or(Pose::IDENTITY, |link| model.places[link])
                .inverse()
                * place
        };
        let name = |link: usize| format!("{}{}", model.prefix, model.links[link].name);
        let (kind, None) = model.kinds(reader, index)? else {
            let problem = Problem::UnknownValue {
                attribute: "type",
                found: "universal".to_owned(),
                supported: "a joint with one axis, or none, to close a loop",
            };
            return Err(FileError::new(reader.location(joint.node), problem));
        };
        let closure = Closure {
            name: format!("{}{}", model.prefix, joint.name),
            parent: None,
            parent_place: seen(parent),
            child: None,
            child_place: seen(child),
            kind,
        };
        self.closures
            .push((closure, [parent.map(name), child.map(name)]));
        Ok(())
    }

    fn body(
        &mut self,
        name: String,
        parent: Option<String>,
        joint: assembly::Joint,
        mass: MassProperties,
    ) {
        let description = core::mem::replace(&mut self.description, ModelDescription::new(""));
        self.description = description.body(name, parent.as_deref(), joint, mass);
    }

    fn frame(&mut self, name: String, body: Option<String>, placement: Pose) {
        let description = core::mem::replace(&mut self.description, ModelDescription::new(""));
        self.description = description.frame(name, body.as_deref(), placement);
    }

    fn finish<'a>(mut self, reader: Reader<'a>, root: Node<'_, 'a>) -> Result<Import, FileError> {
        let model: Model = self.description.build().map_err(|error| {
            let place = error.culprit().and_then(|name| self.lines.remove(name));
            let place = place.unwrap_or_else(|| reader.location(root));
            FileError::new(place, Problem::Model(error))
        })?;
        let find = |name: Option<String>| name.and_then(|name| model.find(&name));
        let parts = self.parts.into_iter().map(|(body, placement, shape)| Part {
            body: find(body),
            placement,
            shape,
        });
        let parts = parts.collect();
        let joints: BTreeMap<String, BodyId> = (self.joints.into_iter())
            .filter_map(|(joint, body)| Some((joint, model.find(&body)?)))
            .collect();
        let closures = self
            .closures
            .into_iter()
            .map(|(closure, [parent, child])| Closure {
                parent: find(parent),
                child: find(child),
                ..closure
            });
        let closures = closures.collect();
        let mut ignored = reader.into_ignored();
        ignored.sort_by_key(|element| element.line);
        Ok(Import {
            parts,
            joints,
            closures,
            ignored,
            model,
        })
    }
}

impl Read<'_, '_> {
    /// The link that a name of a joint means: itself, or what carries the frame of that name; none
    /// for the world.
    fn link(
        &self,
        reader: &Reader<'_>,
        joint: &Joint<'_, '_>,
        name: &str,
    ) -> Result<Option<usize>, FileError> {
        if name == WORLD {
            return Ok(None);
        }
        let unknown = || {
            let problem = Problem::UnknownName {
                what: "link",
                name: name.to_owned(),
            };
            FileError::new(reader.location(joint.node), problem)
        };
        let carrier = self
            .frames
            .carrier(self.frames.find(name).ok_or_else(unknown)?)?;
        match carrier < self.links.len() {
            true => Ok(Some(carrier)),
            false => Err(unknown()),
        }
    }

    /// Where the link that a name means is in the world.
    fn place_of_link(&self, name: &str) -> Pose {
        let link = self
            .frames
            .find(name)
            .and_then(|frame| self.frames.carrier(frame).ok());
        link.map_or(Pose::IDENTITY, |link| self.places[link])
    }

    /// The motion of a joint, axes in the joint's frame, and the second one of two hinges.
    fn kinds(
        &self,
        reader: &Reader<'_>,
        index: usize,
    ) -> Result<(JointKind, Option<JointKind>), FileError> {
        let joint = &self.joints[index];
        let own = self.places[self.links.len() + index].rotation;
        let axis = |axis: &Axis<'_>| {
            let frame = match axis.expressed_in {
                None => return Ok(axis.direction),
                Some(name) if name == MODEL => self.pose.rotation,
                Some(name) => match self.frames.find(name) {
                    Some(frame) => self.places[frame].rotation,
                    None => {
                        let problem = Problem::UnknownName {
                            what: "frame",
                            name: name.to_owned(),
                        };
                        return Err(FileError::new(reader.location(joint.node), problem));
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

/// A joint with what the file states at its axis.
fn made(kind: JointKind, axis: &Axis<'_>) -> assembly::Joint {
    assembly::Joint {
        limits: axis.limits,
        damping: axis.damping,
        friction: axis.friction,
        spring: axis.spring,
        ..assembly::Joint::new(kind)
    }
}
