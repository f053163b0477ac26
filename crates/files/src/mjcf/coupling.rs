//! Equalities: what holds bodies together beside their joints.

use super::Sections;
use super::body::Entry;
use crate::{FileError, Problem};
use glam::DVec3;
use std::collections::HashMap;
use vertebra_assembly::xml::{Node, Reader};
use vertebra_assembly::{BodyId, Mimic, Model, ModelDescription};
use vertebra_spatial::Pose;

/// Two places on bodies, or in the world, that stay together.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupling {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// The first body; none for the world.
    pub first: Option<BodyId>,
    /// The place on it, in its frame.
    pub first_place: Pose,
    /// The second body; none for the world.
    pub second: Option<BodyId>,
    /// The place on it, in its frame.
    pub second_place: Pose,
    /// Whether the places keep their orientation too. If not, only their origins stay together.
    pub is_weld: bool,
}

/// A coupling of bodies by name.
pub(super) struct Named {
    name: Option<String>,
    bodies: [Option<String>; 2],
    places: [Pose; 2],
    is_weld: bool,
}

/// Reads all equalities. Those between joints become mimics of the description's joints; what cannot
/// be held is listed.
pub(super) fn read<'n, 'a>(
    reader: &mut Reader<'a>,
    sections: &Sections<'n, 'a>,
    entries: &HashMap<&'n str, Entry>,
    joints: &[(&'n str, String)],
    description: &mut ModelDescription,
) -> Result<Vec<Named>, FileError> {
    let mut couplings = Vec::new();
    for &section in &sections.equalities {
        for (tag, node) in reader.children(section)? {
            let is_active = node.attribute("active") != Some("false");
            match tag {
                "connect" | "weld" if is_active && node.has_attribute("body1") => {
                    couplings.push(between_bodies(reader, entries, node, tag == "weld")?);
                }
                "joint" if is_active => between_joints(reader, joints, node, description)?,
                _ => reader.ignore(node),
            }
        }
    }
    Ok(couplings)
}

fn between_bodies<'n, 'a>(
    reader: &mut Reader<'a>,
    entries: &HashMap<&'n str, Entry>,
    node: Node<'n, 'a>,
    is_weld: bool,
) -> Result<Named, FileError> {
    let known = ["name", "body1", "body2", "anchor", "active"];
    let known: Vec<&str> = known
        .into_iter()
        .chain(is_weld.then_some("relpose"))
        .collect();
    reader.ignore_attributes_but(node, &known);
    let find = |attribute: &'static str| match reader.optional_text(node, attribute)? {
        None | Some("world") => Ok(None),
        Some(name) => match entries.get(name) {
            Some(entry) => Ok(Some(entry)),
            None => {
                let problem = Problem::UnknownName {
                    what: "body",
                    name: name.to_owned(),
                };
                Err(FileError::new(reader.location(node), problem))
            }
        },
    };
    let bodies = [find("body1")?, find("body2")?];
    let place = |body: Option<&Entry>| body.map_or(Pose::IDENTITY, |body| body.place);
    // The second body as the first one sees it, in the pose of the file or as it is stated.
    let mut relative = place(bodies[0]).inverse() * place(bodies[1]);
    if is_weld && let Some([x, y, z, qw, qx, qy, qz]) = reader.optional_numbers(node, "relpose")? {
        let stated = glam::DQuat::from_xyzw(qx, qy, qz, qw);
        // A quaternion of zeros asks for the pose of the file.
        if stated.length_squared() > 0.0 {
            let rotation = reader.unit_quaternion(node, "relpose", stated)?;
            relative = Pose::new(rotation, DVec3::new(x, y, z));
        }
    }
    let anchor = reader.optional_vector(node, "anchor")?.unwrap_or_default();
    // The anchor of a connection is on the first body, that of a weld on the second.
    let places = match is_weld {
        true => {
            let second = Pose::from_translation(anchor);
            [relative * second, second]
        }
        false => {
            let first = Pose::from_translation(anchor);
            [first, relative.inverse() * first]
        }
    };
    Ok(Named {
        name: reader.optional_text(node, "name")?.map(str::to_owned),
        bodies: bodies.map(|body| body.map(|body| body.name.clone())),
        places,
        is_weld,
    })
}

/// q1 = a0 + a1 q2, counted from the pose of the file, is a mimic; other polynomials are listed.
fn between_joints<'n, 'a>(
    reader: &mut Reader<'a>,
    joints: &[(&'n str, String)],
    node: Node<'n, 'a>,
    description: &mut ModelDescription,
) -> Result<(), FileError> {
    let find = |attribute: &'static str| {
        let name = reader.text(node, attribute)?;
        let body = joints.iter().find(|(joint, _)| *joint == name);
        body.map(|(_, body)| body.clone()).ok_or_else(|| {
            let problem = Problem::UnknownName {
                what: "joint",
                name: name.to_owned(),
            };
            FileError::new(reader.location(node), problem)
        })
    };
    let first = find("joint1")?;
    let coefficients = match reader.optional_text(node, "polycoef")? {
        None => vec![0.0, 1.0],
        Some(text) => reader.number_list(node, "polycoef", text)?,
    };
    let is_linear = coefficients.iter().skip(2).all(|&term| term == 0.0);
    if !node.has_attribute("joint2") || !is_linear {
        reader.ignore(node);
        return Ok(());
    }
    let mimic = Mimic {
        body: find("joint2")?,
        multiplier: coefficients.get(1).copied().unwrap_or(0.0),
        offset: coefficients.first().copied().unwrap_or(0.0),
    };
    let known = ["name", "joint1", "joint2", "polycoef", "active"];
    reader.ignore_attributes_but(node, &known);
    let follower = description
        .bodies
        .iter_mut()
        .find(|body| body.name == first);
    if let Some(body) = follower {
        if body.joint.mimic.is_some() {
            let problem = Problem::Contradiction {
                first: "this equality",
                second: "an earlier one of the same joint",
            };
            return Err(FileError::new(reader.location(node), problem));
        }
        body.joint.mimic = Some(mimic);
    }
    Ok(())
}

pub(super) fn resolve(couplings: &[Named], model: &Model) -> Vec<Coupling> {
    let find = |body: &Option<String>| body.as_deref().and_then(|name| model.find(name));
    let resolved = couplings.iter().map(|named| Coupling {
        name: named.name.clone(),
        first: find(&named.bodies[0]),
        first_place: named.places[0],
        second: find(&named.bodies[1]),
        second_place: named.places[1],
        is_weld: named.is_weld,
    });
    resolved.collect()
}
