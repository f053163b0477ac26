//! From links and joints to bodies.

use super::Import;
use super::joint::{Axis, Joint, Mimic};
use super::model::{Read, read};
use crate::tree::Names;
use crate::{FileError, Part, Problem, Shape};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use vertebra_assembly::xml::{Node, Reader, XmlProblem};
use vertebra_assembly::{
    self as assembly, BodyId, Closure, JointKind, Location, MassProperties, Model,
    ModelDescription, ModelError,
};
use vertebra_spatial::Pose;

/// Cosine of an angle that is right but for the digits in which files state axes.
const PERPENDICULAR: f64 = 1e-6;

/// What is gathered from model to model.
struct Gathered {
    description: ModelDescription,
    names: Names,
    parts: Vec<(Option<String>, Pose, Shape)>,
    joints: Vec<(String, String)>,
    /// Loops and couplings to be closed, and those names of theirs that are taken.
    closing: Names,
    lines: HashMap<String, Location>,
    moves: bool,
}

/// All models as one; what is ignored stays with the reader.
pub(super) fn build<'n, 'a>(
    reader: &mut Reader<'a>,
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
        closing: Names::default(),
        lines: HashMap::new(),
        moves: false,
    };
    for &node in models {
        let prefix = match models.len() {
            1 => String::new(),
            _ => format!("{}::", reader.text(node, "name")?),
        };
        let model = read(reader, node, prefix)?;
        gathered.add(reader, &model)?;
    }
    if !gathered.moves {
        let problem = Problem::Empty("has no joint and no free link, so that nothing moves");
        return Err(FileError::new(reader.location(root), problem));
    }
    gathered.finish(reader, root)
}

impl Gathered {
    fn add<'n, 'a>(
        &mut self,
        reader: &mut Reader<'a>,
        model: &Read<'n, 'a>,
    ) -> Result<(), FileError> {
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
                let first = self.lines.get(&name).and_then(|first| first.line);
                let problem = Problem::DuplicateName {
                    first_line: first.unwrap_or_else(|| reader.line(link.node)),
                };
                return Err(FileError::new(reader.location(link.node), problem));
            }
            self.lines.insert(name.clone(), reader.location(link.node));
            if model.is_static {
                self.frame(name, None, place);
                continue;
            }
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
        for (index, joint) in model.joints.iter().enumerate() {
            for (axis, number) in joint.axes.iter().zip(["", "2"]) {
                if let Some(mimic) = &axis.mimic {
                    self.couple(reader, model, (index, number), mimic)?;
                }
            }
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

    /// Closes a loop by a joint whose child is carried by another.
    fn close<'a>(
        &mut self,
        reader: &mut Reader<'a>,
        model: &Read<'_, 'a>,
        index: usize,
        parent: Option<usize>,
    ) -> Result<(), FileError> {
        let joint = &model.joints[index];
        let place = model.places[model.links.len() + index];
        let child = model.link(reader, joint, joint.child)?;
        let name = format!("{}{}", model.prefix, joint.name);
        if !self.closing.take(&name) {
            return Err(reader.error(joint.node, XmlProblem::Repeated).into());
        }
        let acting = |node: &Node<'_, 'a>| matches!(node.tag_name().name(), "limit" | "dynamics");
        for node in joint.node.descendants().filter(acting) {
            let why = "the joint closes a loop, and only joints of the tree have ranges, springs and friction";
            reader.ignore_because(node, why);
        }
        let closure = match model.kinds(reader, index)? {
            (JointKind::Fixed | JointKind::Free, _) => Closure::Weld,
            (JointKind::Spherical, _) => Closure::Ball,
            (JointKind::Revolute { axis }, None) => Closure::Revolute { axis },
            (JointKind::Prismatic { axis }, _) => Closure::Prismatic { axis },
            (JointKind::Screw { axis, pitch }, _) => Closure::Screw { axis, pitch },
            (JointKind::Revolute { axis }, Some(second)) => {
                let second = second.axis().unwrap_or(axis);
                let cosine = axis.normalize().dot(second.normalize());
                let is_right = cosine.abs() <= PERPENDICULAR;
                if !is_right {
                    let problem = Problem::OutOfRange {
                        quantity: "the cosine between the two axes of a joint that closes a loop",
                        value: cosine,
                        requirement: "zero",
                    };
                    return Err(FileError::new(reader.location(joint.node), problem));
                }
                Closure::Universal {
                    first: axis,
                    second,
                }
            }
        };
        let seen = |link: Option<usize>| {
            link.map_or(Pose::IDENTITY, |link| model.places[link])
                .inverse()
                * place
        };
        let body = |link: usize| format!("{}{}", model.prefix, model.links[link].name);
        let bodies = [parent, child].map(|link| link.map(body));
        if bodies[0] == bodies[1] {
            let problem = Problem::Model(ModelError::SelfLoop { name });
            return Err(FileError::new(reader.location(joint.node), problem));
        }
        let bodies = [bodies[0].as_deref(), bodies[1].as_deref()];
        let places = [seen(parent), seen(child)];
        let description = core::mem::replace(&mut self.description, ModelDescription::new(""));
        self.description = description.close(name, bodies, places, closure);
        Ok(())
    }

    /// Couples a joint of one axis to the one it mimics; others are listed.
    fn couple<'a>(
        &mut self,
        reader: &mut Reader<'a>,
        model: &Read<'_, 'a>,
        (index, axis): (usize, &'static str),
        mimic: &Mimic<'_, 'a>,
    ) -> Result<(), FileError> {
        let joint = &model.joints[index];
        let body = |joint: &str| {
            let name = format!("{}{joint}", model.prefix);
            let carried = self.joints.iter().find(|(other, _)| *other == name);
            carried.map(|(_, body)| body.clone())
        };
        let Some(other) = model.joints.iter().find(|other| other.name == mimic.joint) else {
            let joints = model.joints.iter().map(|joint| joint.name);
            let problem = Problem::unknown("joint", mimic.joint, joints);
            return Err(FileError::new(reader.location(mimic.node), problem));
        };
        let single = |joint: &Joint<'_, '_>| joint.kind.freedoms() == 1;
        let (Some(follower), Some(leader), true) = (
            body(joint.name),
            body(other.name),
            single(joint) && single(other) && joint.name != other.name,
        ) else {
            let why = "only two joints of the tree with one freedom each are coupled";
            reader.ignore_because(mimic.node, why);
            return Ok(());
        };
        let name = format!("{}{}{axis} mimic", model.prefix, joint.name);
        let name = self.closing.fresh(name);
        let offset = mimic.offset - mimic.multiplier * mimic.reference;
        let description = core::mem::replace(&mut self.description, ModelDescription::new(""));
        self.description = description.couple(name, follower, leader, mimic.multiplier, offset);
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

    fn finish(mut self, reader: &Reader<'_>, root: Node<'_, '_>) -> Result<Import, FileError> {
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
        Ok(Import {
            parts,
            joints,
            ignored: Vec::new(),
            model,
        })
    }
}

/// A joint with what the file states at its axis.
fn made(kind: JointKind, axis: &Axis<'_, '_>) -> assembly::Joint {
    assembly::Joint {
        limits: axis.limits,
        damping: axis.damping,
        friction: axis.friction,
        spring: axis.spring,
        ..assembly::Joint::new(kind)
    }
}
