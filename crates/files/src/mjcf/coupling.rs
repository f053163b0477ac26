//! Equalities: what holds bodies together beside their joints.

use super::body::{Carrier, Entry};
use super::{Sections, name_taken};
use crate::tree::Names;
use crate::{FileError, Problem};
use glam::{DQuat, DVec3};
use std::collections::HashMap;
use vertebra_assembly::xml::{Node, Reader};
use vertebra_assembly::{Closure, JointKind, Location, ModelDescription, ModelError};
use vertebra_spatial::Pose;

/// A named place of the file.
pub(super) struct Site {
    /// Name of its body in the model; none for the world.
    pub(super) body: Option<String>,
    pub(super) placement: Pose,
}

/// What equalities refer to, by the names of the file.
pub(super) struct Known<'r, 'n> {
    pub(super) bodies: &'r HashMap<&'n str, Entry>,
    pub(super) joints: &'r HashMap<&'n str, Carrier>,
    pub(super) sites: HashMap<&'n str, &'r Site>,
}

/// A frame on a body, by its name in the model, or in the world.
type Place = (Option<String>, Pose);

/// Equalities that are read.
const KINDS: [&str; 3] = ["connect", "weld", "joint"];

/// Closes the loops and couples the joints that the equalities name; what cannot be kept is listed. Gives
/// the line of each, too.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    known: &Known<'_, 'n>,
    mut description: ModelDescription,
) -> Result<(ModelDescription, HashMap<String, Location>), FileError> {
    let mut names = Names::default();
    let mut all = Vec::new();
    for &section in &sections.equalities {
        for (tag, node) in reader.children(section)? {
            let name = reader
                .optional_text(node, "name")?
                .filter(|n| !n.is_empty());
            if name.is_some_and(|name| !names.take(name)) {
                return Err(name_taken(reader, node, &KINDS));
            }
            all.push((tag, node, name));
        }
    }
    let mut lines = HashMap::new();
    for (tag, node, name) in all {
        if node.attribute("active") == Some("false") {
            reader.ignore_because(node, "it is not active");
            continue;
        }
        let name = |names: &mut Names| match name {
            Some(name) => name.to_owned(),
            None => names.fresh(tag.to_owned()),
        };
        let name = match tag {
            "connect" | "weld" => {
                let is_weld = tag == "weld";
                let [(first, at_first), (second, at_second)] =
                    match node.has_attribute("site1") || node.has_attribute("site2") {
                        true => between_sites(reader, known, node)?,
                        false => between_bodies(reader, known, node, is_weld)?,
                    };
                let bodies = [first.as_deref(), second.as_deref()];
                let closure = if is_weld {
                    Closure::Weld
                } else {
                    Closure::Ball
                };
                let name = name(&mut names);
                description = description.close(&name, bodies, [at_first, at_second], closure);
                name
            }
            "joint" => {
                let Some(line) = line(reader, node)? else {
                    let why = "its polynomial is no line, which couplings are";
                    reader.ignore_because(node, why);
                    continue;
                };
                let name = name(&mut names);
                description = between_joints(reader, known, (node, &name), line, description)?;
                name
            }
            "tendon" | "flex" | "flexvert" | "flexstrain" => {
                reader.ignore(node);
                continue;
            }
            _ => {
                reader.ignore_unknown(node, &KINDS);
                continue;
            }
        };
        lines.insert(name, reader.location(node));
    }
    Ok((description, lines))
}

fn between_sites<'n, 'a>(
    reader: &mut Reader<'a>,
    known: &Known<'_, 'n>,
    node: Node<'n, 'a>,
) -> Result<[Place; 2], FileError> {
    reader.ignore_attributes_but(node, &["name", "site1", "site2", "active"]);
    let find = |attribute| {
        let name = reader.text(node, attribute)?;
        let site = known.sites.get(name);
        let site = site.ok_or_else(|| unknown(reader, node, ("site", name), known.sites.keys()))?;
        Ok::<_, FileError>((site.body.clone(), site.placement))
    };
    Ok([find("site1")?, find("site2")?])
}

fn between_bodies<'n, 'a>(
    reader: &mut Reader<'a>,
    known: &Known<'_, 'n>,
    node: Node<'n, 'a>,
    is_weld: bool,
) -> Result<[Place; 2], FileError> {
    let attributes = ["name", "body1", "body2", "anchor", "active"];
    let attributes: Vec<&str> = attributes
        .into_iter()
        .chain(is_weld.then_some("relpose"))
        .collect();
    reader.ignore_attributes_but(node, &attributes);
    let find = |name| match name {
        None | Some("world") => Ok(None),
        Some(name) => match known.bodies.get(name) {
            Some(entry) => Ok(Some(entry)),
            None => Err(unknown(reader, node, ("body", name), known.bodies.keys())),
        },
    };
    let bodies = [
        find(Some(reader.text(node, "body1")?))?,
        find(reader.optional_text(node, "body2")?)?,
    ];
    let place = |body: Option<&Entry>| body.map_or(Pose::IDENTITY, |body| body.place);
    // The second body as the first one sees it in the pose of the file.
    let relative = place(bodies[0]).inverse() * place(bodies[1]);
    let anchor = reader.optional_vector(node, "anchor")?.unwrap_or_default();
    let anchor = Pose::from_translation(anchor);
    // The anchor of a connection is on the first body, that of a weld on the second. A stated pose says which
    // point of the first body meets that anchor, and how the second is turned.
    let places = match (is_weld, stated_pose(reader, node, is_weld)?) {
        (false, _) => [anchor, relative.inverse() * anchor],
        (true, None) => [relative * anchor, anchor],
        (true, Some(stated)) => [stated, anchor],
    };
    let [first, second] = bodies.map(|body| body.map(|body| body.name.clone()));
    Ok([(first, places[0]), (second, places[1])])
}

/// The pose that a weld states, if it does: a quaternion of zeros asks for that of the file.
fn stated_pose<'a>(
    reader: &Reader<'a>,
    node: Node<'_, 'a>,
    is_weld: bool,
) -> Result<Option<Pose>, FileError> {
    if !is_weld {
        return Ok(None);
    }
    let Some([x, y, z, qw, qx, qy, qz]) = reader.optional_numbers(node, "relpose")? else {
        return Ok(None);
    };
    let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
    if rotation == DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0) {
        return Ok(None);
    }
    let rotation = reader.unit_quaternion(node, "relpose", rotation)?;
    Ok(Some(Pose::new(rotation, DVec3::new(x, y, z))))
}

/// Offset and ratio of q1 = a0 + a1 q2, counted from the pose of the file, unless it is a polynomial of a
/// higher degree.
fn line<'a>(reader: &Reader<'a>, node: Node<'_, 'a>) -> Result<Option<[f64; 2]>, FileError> {
    let coefficients = match reader.optional_text(node, "polycoef")? {
        None => return Ok(Some([0.0, 1.0])),
        Some(text) => reader.number_list(node, "polycoef", text)?,
    };
    let term = |index: usize| coefficients.get(index).copied().unwrap_or(0.0);
    // A polynomial of no other joint is its constant.
    let is_line = coefficients.iter().skip(2).all(|&term| term == 0.0);
    let is_line = is_line || !node.has_attribute("joint2");
    Ok(is_line.then(|| [term(0), term(1)]))
}

fn between_joints<'n, 'a>(
    reader: &mut Reader<'a>,
    known: &Known<'_, 'n>,
    (node, name): (Node<'n, 'a>, &str),
    [offset, ratio]: [f64; 2],
    description: ModelDescription,
) -> Result<ModelDescription, FileError> {
    let attributes = ["name", "joint1", "joint2", "polycoef", "active"];
    reader.ignore_attributes_but(node, &attributes);
    let find = |joint| match known.joints.get(joint) {
        Some(carrier) => Ok(carrier.body.as_str()),
        None => Err(unknown(reader, node, ("joint", joint), known.joints.keys())),
    };
    let body = find(reader.text(node, "joint1")?)?;
    match reader.optional_text(node, "joint2")? {
        Some(other) => Ok(description.couple(name, body, find(other)?, ratio, offset)),
        None => lock(reader, (node, name), body, offset, description),
    }
}

/// Keeps a joint where it is at a position: its body welded to its parent there.
fn lock<'a>(
    reader: &Reader<'a>,
    (node, name): (Node<'_, 'a>, &str),
    body: &str,
    position: f64,
    description: ModelDescription,
) -> Result<ModelDescription, FileError> {
    let Some(carried) = description.bodies.iter().find(|other| other.name == body) else {
        return Ok(description);
    };
    let moved = match carried.joint.kind {
        JointKind::Revolute { axis } => {
            let axis = axis.normalize();
            Pose::new(super::compiler::turned(axis, position), DVec3::ZERO)
        }
        JointKind::Prismatic { axis } => Pose::from_translation(axis.normalize() * position),
        kind => {
            let problem = Problem::Model(ModelError::CoupledFreedoms {
                name: name.to_owned(),
                body: body.to_owned(),
                freedoms: kind.dof_count(),
            });
            return Err(FileError::new(reader.location(node), problem));
        }
    };
    let places = [
        carried.joint.parent_placement * moved,
        carried.joint.child_placement,
    ];
    let parent = carried.parent.clone();
    let bodies = [parent.as_deref(), Some(body)];
    Ok(description.close(name, bodies, places, Closure::Weld))
}

fn unknown<'n, 'a>(
    reader: &Reader<'a>,
    node: Node<'_, 'a>,
    (what, name): (&'static str, &str),
    known: impl Iterator<Item = &'n &'n str>,
) -> FileError {
    let problem = Problem::unknown(what, name, known.copied());
    FileError::new(reader.location(node), problem)
}
